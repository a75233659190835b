// SPDX-License-Identifier: LGPL-2.1-or-later
/// Colour sensors' mosaics: processor time of `silhouette` on them, against `bayer2rgb` in front of it and
/// against frames with all colours in every pixel, 1920x1080 from memory; and how far the contours of
/// a disk are off. Writes silhouette_bayer.csv and silhouette_bayer_error.csv to the folder given.
#include <gst/check/gstharness.h>
#include <gst/gst.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>

#include "benchmarks/measure.h"
#include "benchmarks/shapes.h"
#include "wire/view_payload.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr int width = 1920, height = 1080, frames = 8;
constexpr double disk_x = 960.3, disk_y = 540.6, disk_radius = 400.4;

/// R, G, B, unused per pixel, in levels.
using Levels = std::vector<float>;

/// A disk through a lens whose blur is 1.6 px wide, and a sensor's noise.
Levels disk(double noise) {
  Levels levels(4 * static_cast<std::size_t>(width) * height);
  std::mt19937 random(1);
  std::normal_distribution<double> grain(0.0, std::max(noise, 1e-9));
  constexpr std::array subject{170.0, 110.0, 90.0}, screen{40.0, 170.0, 60.0};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double outside = std::hypot(x - disk_x, y - disk_y) - disk_radius;
      const double share = std::clamp(0.5 - outside / 1.6, 0.0, 1.0);
      for (std::size_t c = 0; c < 3; ++c)
        levels[4 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)) + c] =
            static_cast<float>(share * subject[c] + (1.0 - share) * screen[c] + grain(random));
    }
  return levels;
}

Levels levels_of(const std::vector<std::uint8_t>& rgbx) {
  return {rgbx.begin(), rgbx.end()};
}

GstBuffer* buffer_of(const std::vector<std::uint8_t>& bytes) {
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, bytes.size(), nullptr);
  gst_buffer_fill(buffer, 0, bytes.data(), bytes.size());
  GST_BUFFER_PTS(buffer) = 0;
  return buffer;
}

/// \p bits 0: RGBx; else the mosaic "rggb" of so many bits.
GstBuffer* frame_of_levels(const Levels& levels, int bits) {
  const auto pixels = static_cast<std::size_t>(width) * height;
  std::vector<std::uint8_t> bytes(pixels * (bits == 0 ? 4 : bits > 8 ? 2 : 1));
  const auto sample = [&](std::size_t at, int depth) {
    const long most = (1l << depth) - 1;
    return std::clamp(std::lround(std::ldexp(levels[at], depth - 8)), 0l, most);
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    if (bits == 0) {
      for (std::size_t c = 0; c < 3; ++c)
        bytes[4 * i + c] = static_cast<std::uint8_t>(sample(4 * i + c, 8));
      continue;
    }
    const std::size_t x = i % width, y = i / width;
    const long v = sample(4 * i + (x & 1) + (y & 1), bits);
    if (bits == 8) {
      bytes[i] = static_cast<std::uint8_t>(v);
    } else {
      bytes[2 * i] = static_cast<std::uint8_t>(v & 255);
      bytes[2 * i + 1] = static_cast<std::uint8_t>(v >> 8);
    }
  }
  return buffer_of(bytes);
}

std::string caps_of(int bits) {
  const std::string format = bits == 0 ? "video/x-raw,format=RGBx"
                             : bits == 8
                                 ? "video/x-bayer,format=rggb"
                                 : "video/x-bayer,format=rggb" + std::to_string(bits) + "le";
  return format + ",width=1920,height=1080,framerate=30/1";
}

struct Line {
  std::string name, front;
  int bits;
};
const std::array lines = {Line{"silhouette, 8-bit mosaic", "", 8},
                          Line{"silhouette, 10-bit mosaic", "", 10},
                          Line{"silhouette, 12-bit mosaic", "", 12},
                          Line{"bayer2rgb ! silhouette, 8-bit mosaic",
                               "bayer2rgb ! capsfilter caps=video/x-raw,format=RGBx ! ", 8},
                          Line{"silhouette, RGBx", "", 0}};

void measure_time(const std::string& folder, int rounds) {
  const auto matte = matte_of(figure_of_17_percent(), width, height);
  std::vector<Levels> pictures;
  for (int i = 0; i < frames; ++i)
    pictures.push_back(levels_of(frame_of(matte, FrameFormat::rgbx, 1.0, i).bytes));
  std::vector<Contender> contenders;
  for (const Line& line : lines) {
    const std::shared_ptr<GstHarness> harness(
        gst_harness_new_parse(
            (line.front + "silhouette camera=c sigma=2 tolerance=1 reuse=false").c_str()),
        gst_harness_teardown);
    gst_harness_set_src_caps_str(harness.get(), caps_of(line.bits).c_str());
    std::vector<GstBuffer*> buffers;
    for (const Levels& picture : pictures) buffers.push_back(frame_of_levels(picture, line.bits));
    contenders.push_back({line.name, [harness, buffers](int i) {
                            GstBuffer* in = buffers[static_cast<std::size_t>(i) % buffers.size()];
                            gst_buffer_unref(
                                gst_harness_push_and_pull(harness.get(), gst_buffer_ref(in)));
                          }});
  }
  // Processor time, of all threads: of a busy machine's clock on the wall much is not ours.
  for (int round = -1; round < rounds; ++round)
    for (Contender& contender : contenders) {
      const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
      contender.run(round + 1);
      if (round >= 0) contender.times.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - begin);
    }
  Table table(folder + "/silhouette_bayer.csv", "elements,median ms of processor time,best ms");
  for (const Contender& c : contenders)
    table.row("%s,%.3f,%.3f", c.name.c_str(), c.median(), c.best());
}

void measure_error(const std::string& folder) {
  Table table(folder + "/silhouette_bayer_error.csv",
              "elements,noise,sigma,mean absolute px,bias px,largest px");
  for (const double noise : {0.0, 4.0}) {
    const Levels levels = disk(noise);
    for (const double sigma : {0.0, 1.0, 2.0})
      for (const Line& line : lines) {
        GstHarness* harness = gst_harness_new_parse(
            (line.front +
             "silhouette camera=c tolerance=0 keep-largest=1 sigma=" + std::to_string(sigma))
                .c_str());
        gst_harness_set_src_caps_str(harness, caps_of(line.bits).c_str());
        GstBuffer* out = gst_harness_push_and_pull(harness, frame_of_levels(levels, line.bits));
        double sum = 0.0, bias = 0.0, largest = 0.0;
        {
          GstMapInfo map;
          gst_buffer_map(out, &map, GST_MAP_READ);
          const View view = read_view({map.data, map.size});
          const auto ring = view.contours.ring(0);
          for (const Vec2f& p : ring) {
            const double off = std::hypot(p.x - disk_x, p.y - disk_y) - disk_radius;
            sum += std::abs(off);
            bias += off;
            largest = std::max(largest, std::abs(off));
          }
          sum /= static_cast<double>(ring.size());
          bias /= static_cast<double>(ring.size());
          gst_buffer_unmap(out, &map);
        }
        gst_buffer_unref(out);
        gst_harness_teardown(harness);
        table.row("%s,%g,%g,%.4f,%+.4f,%.4f", line.name.c_str(), noise, sigma, sum, bias, largest);
      }
  }
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(nullptr, nullptr);
  const std::string folder = argc > 1 ? argv[1] : ".";
  measure_time(folder, argc > 2 ? std::atoi(argv[2]) : 40);
  measure_error(folder);
  return 0;
}
