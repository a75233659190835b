// SPDX-License-Identifier: LGPL-2.1-or-later
/// Time of the elements in GStreamer, against the one-pass element and against GStreamer's own
/// `alpha` and `gaussianblur`, 1920x1080 frames from memory. Writes silhouette_elements.csv to the
/// folder given.
#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <cstdlib>
#include <memory>

#include "benchmarks/measure.h"
#include "benchmarks/shapes.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr int width = 1920;
constexpr int height = 1080;
constexpr int frames = 12;

std::string caps_of(const char* format) {
  return std::string("video/x-raw,format=") + format +
         ",width=1920,height=1080,framerate=30/1,colorimetry=bt709";
}

/// A bin that is fed with buffers that take turns.
class Fed {
 public:
  Fed(const std::string& description, const char* format, std::vector<GstBuffer*> buffers)
      : harness_(gst_harness_new_parse(description.c_str())), buffers_(std::move(buffers)) {
    gst_harness_set_src_caps_str(harness_, caps_of(format).c_str());
  }
  ~Fed() { gst_harness_teardown(harness_); }
  Fed(const Fed&) = delete;
  Fed& operator=(const Fed&) = delete;

  void push(int i) {
    GstBuffer* in = gst_buffer_ref(buffers_[static_cast<std::size_t>(i) % buffers_.size()]);
    GstBuffer* out = gst_harness_push_and_pull(harness_, in);
    if (out == nullptr) throw std::runtime_error("no buffer came out");
    gst_buffer_unref(out);
  }

 private:
  GstHarness* harness_;
  std::vector<GstBuffer*> buffers_;
};

GstBuffer* buffer_of(const std::vector<std::uint8_t>& bytes) {
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, bytes.size(), nullptr);
  gst_buffer_fill(buffer, 0, bytes.data(), bytes.size());
  GST_BUFFER_PTS(buffer) = 0;
  GST_BUFFER_DURATION(buffer) = GST_SECOND / 30;
  return buffer;
}

bool have(const char* element) {
  GstElementFactory* factory = gst_element_factory_find(element);
  if (factory == nullptr) return false;
  gst_object_unref(factory);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(nullptr, nullptr);
  const std::string folder = argc > 1 ? argv[1] : ".";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 40;
  const Matte matte = matte_of(figure_of_17_percent(), width, height);
  std::vector<GstBuffer*> bgrx, nv12, same, rgba;
  for (int i = 0; i < frames; ++i) {
    bgrx.push_back(buffer_of(frame_of(matte, FrameFormat::bgrx, 1.0, i).bytes));
    nv12.push_back(buffer_of(frame_of(matte, FrameFormat::nv12, 1.0, i).bytes));
    same.push_back(buffer_of(frame_of(matte, FrameFormat::bgrx, 1.0, 5).bytes));
    rgba.push_back(buffer_of(frame_of(matte, FrameFormat::rgba, 1.0, i).bytes));
  }
  const std::string chain =
      "chromamatte ! gaussblur sigma=2 ! contourfind camera=c tolerance=1 reuse=false";
  struct Line {
    std::string name, description;
    const char* format;
    const std::vector<GstBuffer*>* buffers;
  };
  std::vector<Line> lines = {
      {"silhouette BGRx", "silhouette camera=c sigma=2 tolerance=1 reuse=false", "BGRx", &bgrx},
      {"three elements BGRx", chain, "BGRx", &bgrx},
      {"silhouette NV12", "silhouette camera=c sigma=2 tolerance=1 reuse=false", "NV12", &nv12},
      {"three elements NV12", chain, "NV12", &nv12},
      {"silhouette unchanged BGRx", "silhouette camera=c sigma=2 tolerance=1", "BGRx", &same},
      {"chromamatte BGRx", "chromamatte", "BGRx", &bgrx},
      {"chromamatte NV12", "chromamatte", "NV12", &nv12},
      {"chromamatte gaussblur BGRx", "chromamatte ! gaussblur sigma=2", "BGRx", &bgrx},
      {"identity BGRx", "identity", "BGRx", &bgrx},
  };
  if (have("alpha")) {
    lines.push_back({"alpha method=green BGRx to ARGB",
                     "alpha method=green ! capsfilter caps=video/x-raw,format=ARGB", "BGRx",
                     &bgrx});
    lines.push_back({"alpha method=green NV12 to AYUV",
                     "videoconvert ! capsfilter caps=video/x-raw,"
                     "format=I420 ! alpha method=green",
                     "NV12", &nv12});
  }
  if (have("videoconvert")) {
    lines.push_back({"videoconvert NV12 to BGRx",
                     "videoconvert ! capsfilter caps=video/x-raw,format=BGRx", "NV12", &nv12});
  }
  std::vector<Contender> contenders;
  std::vector<std::shared_ptr<Fed>> fed;
  for (const Line& line : lines) {
    auto bin = std::make_shared<Fed>(line.description, line.format, *line.buffers);
    fed.push_back(bin);
    contenders.push_back({line.name, [bin](int i) { bin->push(i); }});
  }
  race(contenders, rounds);
  std::vector<Contender> slow;
  if (have("gaussianblur")) {
    auto bin = std::make_shared<Fed>(
        "videoconvert ! capsfilter caps=video/x-raw,format=AYUV ! "
        "gaussianblur sigma=2",
        "NV12", nv12);
    auto conversion = std::make_shared<Fed>(
        "videoconvert ! capsfilter caps=video/x-raw,format=AYUV", "NV12", nv12);
    slow.push_back({"videoconvert AYUV ! gaussianblur sigma=2", [bin](int i) { bin->push(i); }});
    slow.push_back({"videoconvert NV12 to AYUV", [conversion](int i) { conversion->push(i); }});
    race(slow, std::min(rounds, 8));
  }

  Table table(folder + "/silhouette_elements.csv", "elements,median ms,best ms");
  for (const auto* group : {&contenders, &slow}) {
    for (const Contender& c : *group) {
      table.row("%s,%.3f,%.3f", c.name.c_str(), c.median(), c.best());
    }
  }
  Table bars(folder + "/silhouette_elements_bars.csv", "bar,asked,measured,held");
  for (const char* format : {"BGRx", "NV12"}) {
    const double ratio = best_of(contenders, std::string("three elements ") + format) /
                         best_of(contenders, std::string("silhouette ") + format);
    bars.row("three elements over one %s,<= 2,%.2f,%s", format, ratio, bar(ratio <= 2.0));
  }
  return 0;
}
