// SPDX-License-Identifier: LGPL-2.1-or-later
// The views in takes by H.264 encoders of GStreamer: bytes, processor time and error, with the matte
// packed beside without loss, beside what JPEG makes of the same pixels; and what H.264 would do to
// the mattes. Frames by themselves lie at the upper left of a picture that holds the largest of them;
// for prediction from the frame before they lie where the camera saw them.
#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>
#include <gst/gst.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "measure.h"
#include "take_pixels.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

using Packets = std::vector<std::vector<std::uint8_t>>;

struct Picture {
  int left = 0, top = 0, width = 0, height = 0;
};

/// Even, as 4:2:0 wants it.
Picture picture_of(const std::vector<Frame>& frames, bool in_place) {
  int left = in_place ? 1 << 30 : 0, top = left, right = 0, bottom = 0;
  for (const Frame& frame : frames) {
    const int x = in_place ? frame.left : 0, y = in_place ? frame.top : 0;
    left = std::min(left, x);
    top = std::min(top, y);
    right = std::max(right, x + frame.shape.width);
    bottom = std::max(bottom, y + frame.shape.height);
  }
  return {left, top, (right - left + 1) & ~1, (bottom - top + 1) & ~1};
}

/// Calls \p each (byte of the picture, byte of the frame) for each pixel.
template <class Each>
void for_pixels(const Picture& picture, const Frame& frame, bool in_place, Each&& each) {
  const int left = in_place ? frame.left - picture.left : 0;
  const int top = in_place ? frame.top - picture.top : 0;
  for (int y = 0; y < frame.shape.height; ++y)
    for (int x = 0; x < frame.shape.width; ++x)
      each(4 * (static_cast<std::size_t>(top + y) * static_cast<std::size_t>(picture.width) +
                static_cast<std::size_t>(left + x)),
           4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.shape.width) +
                static_cast<std::size_t>(x)));
}

/// Sends \p in through "appsrc ! \p elements ! appsink"; \p caps are those of what goes in, then of
/// what comes out. The processor time of it all, ms, goes to \p time.
Packets pass(const std::string& elements, GstCaps*& caps, const Packets& in, double& time) {
  g_autoptr(GError) error = nullptr;
  const std::string line =
      "appsrc name=in format=time max-bytes=0 ! " + elements + " ! appsink name=out sync=false";
  GstElement* pipeline = gst_parse_launch(line.c_str(), &error);
  if (pipeline == nullptr || error != nullptr) throw std::runtime_error(error->message);
  GstElement* source = gst_bin_get_by_name(GST_BIN(pipeline), "in");
  GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline), "out");
  gst_app_src_set_caps(GST_APP_SRC(source), caps);
  const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  for (std::size_t i = 0; i < in.size(); ++i) {
    GstBuffer* buffer = gst_buffer_new_memdup(in[i].data(), in[i].size());
    GST_BUFFER_PTS(buffer) = i * GST_SECOND / 25;
    gst_app_src_push_buffer(GST_APP_SRC(source), buffer);
  }
  gst_app_src_end_of_stream(GST_APP_SRC(source));
  Packets out;
  gst_clear_caps(&caps);
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink))) {
    if (caps == nullptr) caps = gst_caps_ref(gst_sample_get_caps(sample));
    GstMapInfo map;
    gst_buffer_map(gst_sample_get_buffer(sample), &map, GST_MAP_READ);
    out.emplace_back(map.data, map.data + map.size);
    gst_buffer_unmap(gst_sample_get_buffer(sample), &map);
    gst_sample_unref(sample);
  }
  time = now(CLOCK_PROCESS_CPUTIME_ID) - begin;
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(source);
  gst_object_unref(sink);
  gst_object_unref(pipeline);
  if (out.size() != in.size())
    throw std::runtime_error(std::to_string(out.size()) + " of " + std::to_string(in.size()) +
                             " frames came out of " + elements);
  return out;
}

struct Result {
  double bytes = 0, pack = 0, unpack = 0;  // of a frame; ms
  double psnr = 0;                         // of the colours where the matte is 255
  double matte_error = 0, flipped = 0;     // where it is coded as a grey picture: see report()
};

Result run(const std::vector<Frame>& frames, const std::string& encoder, const char* format,
           bool in_place, bool matte) {
  const Picture picture = picture_of(frames, in_place);
  Packets pictures;
  for (const Frame& frame : frames) {
    auto& to = pictures.emplace_back(static_cast<std::size_t>(picture.width) *
                                     static_cast<std::size_t>(picture.height) * 4);
    for_pixels(picture, frame, in_place, [&](std::size_t at, std::size_t from) {
      for (std::size_t c = 0; c < 3; ++c) to[at + c] = frame.pixels[from + (matte ? 3 : c)];
    });
  }
  GstCaps* caps = gst_caps_new_simple(
      "video/x-raw", "format", G_TYPE_STRING, "RGBx", "width", G_TYPE_INT, picture.width, "height",
      G_TYPE_INT, picture.height, "framerate", GST_TYPE_FRACTION, 25, 1, nullptr);
  Result result;
  const Packets packed =
      pass(std::string("videoconvert n-threads=1 ! video/x-raw,format=") + format + " ! " + encoder,
           caps, pictures, result.pack);
  const Packets back = pass(
      "h264parse ! avdec_h264 max-threads=1 ! videoconvert n-threads=1 ! video/x-raw,format=RGBx",
      caps, packed, result.unpack);
  gst_clear_caps(&caps);
  double squares = 0, samples = 0, edges = 0, differences = 0, flipped = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    result.bytes += static_cast<double>(packed[i].size());
    for_pixels(picture, frames[i], in_place, [&](std::size_t at, std::size_t from) {
      const int alpha = frames[i].pixels[from + 3];
      if (matte) {
        const int coded = back[i][at];
        flipped += (coded >= 128) != (alpha >= 128);
        if (alpha == 0 || alpha == 255) return;
        ++edges;
        differences += std::abs(coded - alpha);
      } else if (alpha == 255) {
        for (std::size_t c = 0; c < 3; ++c, ++samples)
          squares += std::pow(back[i][at + c] - frames[i].pixels[from + c], 2);
      }
    });
  }
  const auto count = static_cast<double>(frames.size());
  result.bytes /= count;
  result.pack /= count;
  result.unpack /= count;
  result.psnr = 10 * std::log10(255 * 255 * samples / std::max(squares, 1e-9));
  result.matte_error = differences / std::max(edges, 1.0);
  result.flipped = flipped / count;
  return result;
}

/// What is packed by PixelEncoder: \p channels 4 as JPEG with its matte, 1 the matte alone by zstd.
Result existing(const std::vector<Frame>& frames, int channels, int quality) {
  PixelEncoder encoder;
  PixelDecoder decoder;
  Result result;
  double squares = 0, samples = 0;
  for (const Frame& frame : frames) {
    std::vector<std::uint8_t> pixels = frame.pixels;
    PixelShape shape = frame.shape;
    shape.channels = channels;
    if (channels == 1) {
      for (std::size_t i = 0; 4 * i < frame.pixels.size(); ++i) pixels[i] = frame.pixels[4 * i + 3];
      pixels.resize(shape.bytes());
    }
    const PixelCoding coding = channels == 1 ? PixelCoding::zstd : PixelCoding::jpeg;
    std::vector<std::uint8_t> back(shape.bytes());
    const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
    const auto block = encoder.encode(coding, shape, pixels, channels * shape.width, quality);
    const double packed = now(CLOCK_PROCESS_CPUTIME_ID);
    decoder.decode(coding, shape, block, back);
    result.unpack += now(CLOCK_PROCESS_CPUTIME_ID) - packed;
    result.pack += packed - begin;
    result.bytes += static_cast<double>(block.size());
    for (std::size_t i = 0; channels == 4 && i < back.size(); i += 4)
      for (std::size_t c = 0; c < 3 && back[i + 3] == 255; ++c, ++samples)
        squares += std::pow(back[i + c] - frame.pixels[i + c], 2);
  }
  const auto count = static_cast<double>(frames.size());
  result.bytes /= count;
  result.pack /= count;
  result.unpack /= count;
  result.psnr = 10 * std::log10(255 * 255 * samples / std::max(squares, 1e-9));
  return result;
}

void print(const std::string& name, const Result& r) {
  std::printf("%-34s %8.0f %8.2f %9.2f %7.1f", name.c_str(), r.bytes, r.pack, r.unpack, r.psnr);
  for (const double link : {100.0, 1000.0, 10'000.0})
    std::printf(" %9.2f", r.pack + r.unpack + r.bytes * 8e-3 / link);
  std::printf("\n");
}

void report(const char* path) {
  const std::vector<Frame> frames = read_frames(path);
  if (frames.empty()) return;
  const Picture single = picture_of(frames, false), placed = picture_of(frames, true);
  std::printf("%s: %zu views; coded alone %d x %d, in place %d x %d\n", path, frames.size(),
              single.width, single.height, placed.width, placed.height);
  std::printf("%-34s %8s %8s %9s %7s %9s %9s %9s\n", "coding", "bytes", "pack ms", "unpack ms",
              "PSNR dB", "100 Mb/s", "1 Gb/s", "10 Gb/s");
  for (const int quality : {75, 90, 97})
    print("jpeg " + std::to_string(quality), existing(frames, 4, quality));
  const Result matte = existing(frames, 1, 0);
  // \p what is one step of, and stands for @ in \p encoder.
  const auto with_matte = [&](const char* name, std::string encoder, const char* format, bool inter,
                              const char* what, std::initializer_list<int> steps) {
    const std::size_t at = encoder.find('@');
    for (const int step : steps) {
      std::string line = encoder;
      line.replace(at, 1, std::to_string(step));
      Result r = run(frames, line, format, inter, false);
      r.bytes += matte.bytes;
      r.pack += matte.pack;
      r.unpack += matte.unpack;
      print(std::string(name) + ", " + what + " " + std::to_string(step), r);
    }
  };
  const auto by_quantiser = [&](const char* name, const std::string& encoder, const char* format,
                                bool inter) {
    with_matte(name, encoder, format, inter, "quantiser", {18, 22, 26, 30});
  };
  const std::string x264 =
      "x264enc pass=quant quantizer=@ tune=zerolatency threads=1 sliced-threads=false "
      "byte-stream=true ";
  const std::string fast = x264 + "speed-preset=ultrafast ", good = x264 + "speed-preset=veryfast ";
  by_quantiser("x264 intra 4:4:4", fast + "key-int-max=1", "Y444", false);
  by_quantiser("x264 intra 4:2:0", fast + "key-int-max=1", "I420", false);
  by_quantiser("x264 veryfast intra 4:4:4", good + "key-int-max=1", "Y444", false);
  by_quantiser("x264 inter 4:4:4", fast + "key-int-max=25", "Y444", true);
  // With intra frames alone it minds neither a quantiser nor this: one figure is all there is.
  with_matte("openh264 intra 4:2:0",
             "openh264enc rate-control=bitrate bitrate=@ complexity=low multi-thread=1 gop-size=1",
             "I420", false, "bit/s", {8'000'000});
  for (const char* step : {"10", "18", "26"}) {
    std::string line = fast + "key-int-max=1";
    line.replace(line.find('@'), 1, step);
    const Result r = run(frames, line, "Y444", false, true);
    std::printf(
        "matte by x264, quantiser %s: %.0f bytes (%.0f exact by zstd), %.1f levels of error at its "
        "edges, %.0f pixels a view change sides\n",
        step, r.bytes, matte.bytes, r.matte_error, r.flipped);
  }
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  if (argc < 2) {
    std::fprintf(stderr, "usage: h264_benchmark TAKE...   (takes of views, from takesink)\n");
    return 2;
  }
  try {
    for (int i = 1; i < argc; ++i) report(argv[i]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
