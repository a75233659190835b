// SPDX-License-Identifier: LGPL-2.1-or-later
// Real frames from $POLYHULL_DATA/greenscreen: photographs with a hand-cut alpha, and a film.
#include <gst/app/gstappsink.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/picture.h"
#include "elements/element_checks.h"
#include "elements/frames.h"
#include "elements/views.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// The path of a real file, or "" with a message where it is missing.
std::string real(const std::string& name) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string path = std::string(data != nullptr ? data : ".") + "/greenscreen/" + name;
  if (std::filesystem::exists(path)) return path;
  g_printerr("SKIPPED: the real input %s is not here\n", path.c_str());
  return "";
}

bool have(const char* element) {
  GstElementFactory* factory = gst_element_factory_find(element);
  if (factory == nullptr) {
    g_printerr("SKIPPED: the element %s is not installed\n", element);
    return false;
  }
  gst_object_unref(factory);
  return true;
}

/// Runs a line that ends in "appsink name=sink" and hands every buffer to \p take.
void for_each_buffer(const std::string& line, const std::function<void(GstBuffer*)>& take) {
  GstElement* pipeline = parse(line);
  GstElement* sink = named(pipeline, "sink");
  g_object_set(sink, "sync", FALSE, nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink))) {
    take(gst_sample_get_buffer(sample));
    gst_sample_unref(sample);
  }
  check_ended(wait_for_end(pipeline));
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

// Without any of the data meson is told so, instead of a test that passed.
const bool has_data = before_cases([] {
  const char* data = std::getenv("POLYHULL_DATA");
  if (data != nullptr && std::filesystem::exists(std::string(data) + "/greenscreen")) return;
  g_printerr("SKIPPED: needs the folder greenscreen under $POLYHULL_DATA\n");
  std::exit(77);
});

}  // namespace

/// The matte against the alpha cut by hand; the default must beat the prototype's rule.
ELEMENT_TEST(photographs_keyed_like_by_hand) {
  for (const char* name : {"toy_train1", "toy_train2"}) {
    const std::string photo = real(std::string(name) + "_green.png");
    const std::string cut = real(std::string(name) + "_alpha.png");
    if (photo.empty() || cut.empty() || !have("pngdec")) return;
    const Picture truth = load_picture(cut, 4);
    const auto error_of = [&](const std::string& settings) {
      double sum = 0.0;
      for_each_buffer("filesrc location=" + photo +
                          " ! pngdec ! videoconvert ! video/x-raw,format=RGBx ! chromamatte " +
                          settings + " ! appsink name=sink",
                      [&](GstBuffer* buffer) {
                        for_each_pixel(buffer, truth.width, truth.height,
                                       [&](int x, int y, const std::uint8_t* p) {
                                         sum += std::abs(p[3] - truth.row(y)[4 * x + 3]) / 255.0;
                                       });
                      });
      return sum / (truth.width * truth.height);
    };
    const double soft = error_of("");
    const double automatic = error_of("key=auto");
    const double prototype = error_of("method=prototype");
    g_print("%s: mean absolute alpha error: soft %.4f, key=auto %.4f, prototype %.4f\n", name, soft,
            automatic, prototype);
    fail_unless(soft < 0.6 * prototype, "%s: soft %g, prototype %g", name, soft, prototype);
    fail_unless(automatic < 0.6 * prototype, "%s: auto %g, prototype %g", name, automatic,
                prototype);
    fail_unless(soft < 0.006, "%s: %g", name, soft);
  }
}

/// A man before a yellow-green wall: in each frame of the first ten seconds one large silhouette,
/// which does not jump; one pass and chain find the same contours.
ELEMENT_TEST(a_film_becomes_views) {
  const std::string film = real("mdn_yellow_screen_man_320x192.mp4");
  if (film.empty() || !have("qtdemux") || !have("avdec_h264")) return;
  const std::string front = "filesrc location=" + film + " ! qtdemux ! avdec_h264 ! ";
  const std::string settings = "key=auto sigma=1.5 tolerance=0.5 min-area=200";
  std::vector<ReadView> one;
  double before = -1.0;
  for_each_buffer(
      front + "identity eos-after=250 ! silhouette camera=man " + settings + " ! appsink name=sink",
      [&](GstBuffer* buffer) {
        const ReadView read = take_view(gst_buffer_ref(buffer));
        const double share = area_of(read.view.contours) / (320.0 * 192.0);
        fail_unless(share > 0.2 && share < 0.8, "frame %u: %g of the picture", (unsigned)one.size(),
                    share);
        fail_unless(before < 0.0 || std::abs(share - before) < 0.05, "frame %u: %g after %g",
                    (unsigned)one.size(), share, before);
        before = share;
        one.push_back(read);
      });
  fail_unless(one.size() >= 249, "%u frames", (unsigned)one.size());
  std::size_t i = 0;
  for_each_buffer(front +
                      "identity eos-after=250 ! chromamatte key=auto ! gaussblur sigma=1.5 ! "
                      "contourfind camera=man tolerance=0.5 min-area=200 ! appsink name=sink",
                  [&](GstBuffer* buffer) {
                    // Not the whole payload: the capture time tells when the pipeline was started.
                    const ReadView read = take_view(gst_buffer_ref(buffer));
                    fail_unless(i < one.size());
                    fail_unless(read.view.contours == one[i].view.contours, "frame %u",
                                (unsigned)i);
                    ++i;
                  });
  fail_unless_equals_int(static_cast<int>(i), static_cast<int>(one.size()));
}

/// The man's face is a little as yellow as the wall, and so is nearly solid only: the matte does
/// not show the blocks of 16 columns in which it is made so. Steps at their borders are as large as
/// those between any other columns.
ELEMENT_TEST(a_nearly_solid_face_shows_no_blocks) {
  const std::string film = real("mdn_yellow_screen_man_320x192.mp4");
  if (film.empty() || !have("qtdemux") || !have("avdec_h264")) return;
  double steps[2] = {}, count[2] = {};
  for_each_buffer("filesrc location=" + film +
                      " ! qtdemux ! avdec_h264 ! identity eos-after=250 ! chromamatte key=auto ! "
                      "appsink name=sink",
                  [&](GstBuffer* buffer) {
                    int left = 0;
                    for_each_pixel(buffer, 320, 192, [&](int x, int, const std::uint8_t* p) {
                      if (x > 0 && std::min<int>(p[3], left) > 180) {
                        steps[x % 16 == 0] += std::abs(p[3] - left);
                        count[x % 16 == 0] += 1.0;
                      }
                      left = p[3];
                    });
                  });
  const double at_blocks = steps[1] / count[1], elsewhere = steps[0] / count[0];
  g_print("mean step of the film's matte: %.3f levels at blocks, %.3f elsewhere\n", at_blocks,
          elsewhere);
  fail_unless(at_blocks < 1.5 * elsewhere, "%g at blocks, %g elsewhere", at_blocks, elsewhere);
}

/// Skin before a screen of nearly its hue, as it is and with the colours that docs/keying.md advises: the face is
/// solid, the wall empty; and the removal of spill leaves the face its colour, advised or not.
ELEMENT_TEST(skin_before_a_yellow_wall) {
  const std::string film = real("mdn_yellow_screen_man_320x192.mp4");
  if (film.empty() || !have("qtdemux") || !have("avdec_h264")) return;
  struct Look {
    double face = 0.0, wall = 0.0, red = 0.0, blue = 0.0;
  };
  const auto look_of = [&](const std::string& settings) {
    Look look;
    double face = 0.0, wall = 0.0;
    for_each_buffer("filesrc location=" + film +
                        " ! qtdemux ! avdec_h264 ! identity eos-after=200 ! chromamatte key=auto " +
                        settings + " ! appsink name=sink",
                    [&](GstBuffer* buffer) {
                      for_each_pixel(buffer, 320, 192, [&](int x, int y, const std::uint8_t* p) {
                        if (x >= 112 && x < 176 && y >= 35 && y < 120) {
                          face += 1.0;
                          look.face += p[3] < 250;
                          look.red += p[0];
                          look.blue += p[2];
                        } else if ((x < 70 || x >= 230) && y < 100) {
                          wall += 1.0;
                          look.wall += p[3] > 5;
                        }
                      });
                    });
    look = {look.face / face, look.wall / wall, look.red / face, look.blue / face};
    g_print("%s: face below 250: %.1f %%, wall above 5: %.1f %%, red - blue %.0f\n",
            settings.c_str(), 100.0 * look.face, 100.0 * look.wall, look.red - look.blue);
    return look;
  };
  const Look plain = look_of("spill=1");
  const Look advised = look_of("screen-colour=0xb1b108 foreground-colour=0xc39366");
  const Look filmed = look_of("spill=0");
  for (const Look& look : {plain, advised})
    fail_unless(look.face < 0.02 && look.wall < 0.01, "face %g, wall %g", look.face, look.wall);
  for (const Look& look : {plain, advised})
    fail_unless(look.red - look.blue > 0.6 * (filmed.red - filmed.blue), "%g of %g",
                look.red - look.blue, filmed.red - filmed.blue);
}
