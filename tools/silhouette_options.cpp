// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette_options.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/error.h"
#include "command_line.h"

namespace polyhull {
namespace {

std::uint8_t byte(double v) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(v), 0l, 255l));
}

Rgb colour_of(const std::vector<int>& levels, const char* option) {
  Rgb out{};
  if (levels.size() != 3)
    throw Error(Error::Kind::bad_input, "{} has {} levels; give three: red green blue.", option,
                levels.size());
  for (int i = 0; i < 3; ++i) {
    if (levels[i] < 0 || levels[i] > 255)
      throw Error(Error::Kind::bad_input,
                  "{}: {} is no level; give red, green and blue from 0 to 255.", option, levels[i]);
    out[i] = static_cast<std::uint8_t>(levels[i]);
  }
  return out;
}

}  // namespace

FrameView FrameMemory::view() const {
  FrameView v;
  v.format = format;
  v.width = width;
  v.height = height;
  for (int i = 0; i < 3; ++i) {
    v.planes[i] = planes[i].empty() ? nullptr : planes[i].data();
    v.strides[i] = strides[i];
  }
  return v;
}

void allocate(FrameMemory& out, int plane, int stride, int rows) {
  out.strides[plane] = stride;
  out.planes[plane].resize(static_cast<std::size_t>(stride) * rows);
}

void pack_rgb(const Picture& picture, const std::string& format, FrameMemory& out) {
  const int w = picture.width, h = picture.height;
  const int step = format == "RGB" ? 3 : 4;
  const bool reversed = format == "BGRx";
  out.format = format == "RGB" ? FrameFormat::rgb
               : reversed      ? FrameFormat::bgrx
                               : FrameFormat::rgbx;
  allocate(out, 0, w * step, h);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int c = 0; c < 3; ++c)
        out.planes[0][static_cast<std::size_t>(y) * w * step + x * step + (reversed ? 2 - c : c)] =
            picture.row(y)[3 * x + c];
}

// BT.601, chroma as the mean of its pixels (sited left: weights 1 2 1 around the even column).
std::uint8_t luma(const Picture& picture, int x, int y) {
  const std::uint8_t* p = picture.row(y) + 3 * x;
  return byte(16.0 + (65.481 * p[0] + 128.553 * p[1] + 24.966 * p[2]) / 255.0);
}

// Of column \p i of the chroma and its first row \p y of the picture, over so many \p rows.
std::uint8_t chroma(const Picture& picture, int i, int y, int rows, bool red) {
  double sum = 0.0, weight = 0.0;
  for (int dy = 0; dy < rows; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = std::clamp(2 * i + dx, 0, picture.width - 1);
      const std::uint8_t* p = picture.row(std::min(y + dy, picture.height - 1)) + 3 * x;
      const double value = red ? 112.0 * p[0] - 93.786 * p[1] - 18.214 * p[2]
                               : -37.797 * p[0] - 74.203 * p[1] + 112.0 * p[2];
      sum += value * (dx == 0 ? 2.0 : 1.0);
      weight += dx == 0 ? 2.0 : 1.0;
    }
  return byte(128.0 + sum / weight / 255.0);
}

// I420, or with both chromas in one plane NV12.
void pack_halved(const Picture& picture, bool planar, FrameMemory& out) {
  const int w = picture.width, h = picture.height, cw = (w + 1) / 2, ch = (h + 1) / 2;
  out.format = planar ? FrameFormat::i420 : FrameFormat::nv12;
  allocate(out, 0, w, h);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      out.planes[0][static_cast<std::size_t>(y) * w + x] = luma(picture, x, y);
  allocate(out, 1, planar ? cw : 2 * cw, ch);
  if (planar) allocate(out, 2, cw, ch);
  for (int j = 0; j < ch; ++j)
    for (int i = 0; i < cw; ++i) {
      const std::size_t at = static_cast<std::size_t>(j) * cw + i;
      (planar ? out.planes[1][at] : out.planes[1][2 * at]) = chroma(picture, i, 2 * j, 2, false);
      (planar ? out.planes[2][at] : out.planes[1][2 * at + 1]) = chroma(picture, i, 2 * j, 2, true);
    }
}

void pack_pairs(const Picture& picture, bool yuy2, FrameMemory& out) {
  const int w = picture.width, h = picture.height, cw = (w + 1) / 2;
  out.format = yuy2 ? FrameFormat::yuy2 : FrameFormat::uyvy;
  allocate(out, 0, 4 * cw, h);
  for (int y = 0; y < h; ++y)
    for (int i = 0; i < cw; ++i) {
      std::uint8_t* p = out.planes[0].data() + static_cast<std::size_t>(y) * 4 * cw + 4 * i;
      p[yuy2 ? 0 : 1] = luma(picture, 2 * i, y);
      p[yuy2 ? 2 : 3] = luma(picture, std::min(2 * i + 1, w - 1), y);
      p[yuy2 ? 1 : 0] = chroma(picture, i, y, 1, false);
      p[yuy2 ? 3 : 2] = chroma(picture, i, y, 1, true);
    }
}

FrameMemory pack(const Picture& picture, const std::string& format) {
  FrameMemory out;
  out.width = picture.width;
  out.height = picture.height;
  if (format == "RGB" || format == "RGBx" || format == "BGRx")
    pack_rgb(picture, format, out);
  else if (format == "I420" || format == "NV12")
    pack_halved(picture, format == "I420", out);
  else
    pack_pairs(picture, format == "YUY2", out);
  return out;
}

void SilhouetteOptions::add_to(CommandLine& command) {
  KeySettings& k = settings_.key;
  command.option("--key", &key_,
                 "Colour of the screen: green, blue, auto, or rrggbb in hexadecimal");
  command.choice("--method", &k.method, "How the matte is made: soft, prototype or difference",
                 {{"soft", KeyMethod::soft},
                  {"prototype", KeyMethod::threshold},
                  {"difference", KeyMethod::difference}});
  command.option("--strength", &k.strength, "Prototype: margin of the key channel, 0..255");
  command.option("--bright-threshold", &k.bright_threshold,
                 "Prototype: R+G+B above this, 0..765, is foreground");
  command.option("--red-gain", &k.red_gain, "Multiplies red for the decision, 0..4");
  command.option("--blue-gain", &k.blue_gain, "Multiplies blue for the decision, 0..4");
  command.option("--roi", &roi_, "Region of interest: x y width height, px").expected(4);
  command.option("--screen", &screen_, "Soft: sample of the screen, red green blue").expected(3);
  command.option("--foreground", &foreground_, "Soft: sample of the subject, red green blue")
      .expected(3);
  command.option("--clip-black", &k.clip_black, "Alpha below this fraction is 0");
  command.option("--clip-white", &k.clip_white, "Alpha above this fraction is 255");
  command.option("--choke", &k.choke,
                 "How far the matte is shaved off, px, -32..32 (negative: grown)");
  command.option("--close", &k.close, "Gaps up to twice this width are closed, px, 0..32");
  command.option("--spill", &k.spill, "Fraction of the spill that is removed, 0..1");
  command.option("--difference-low", &k.difference_low,
                 "Difference: background up to this distance in levels");
  command.option("--difference-high", &k.difference_high,
                 "Difference: foreground from this distance in levels on");
  command.option("--shadow-darkest", &k.shadow_darkest,
                 "Difference: fraction of the light that a shadow leaves at least");
  command.option("--light-brightest", &k.light_brightest,
                 "Difference: most light relative to the plate, 1..4");
  command.option("--light-penalty", &k.light_penalty,
                 "Difference: fraction of a change of light that counts");
  command.option("--inside-mask", &inside_mask_, "Grey picture: where it is not 0 is foreground");
  command.option("--outside-mask", &outside_mask_, "Grey picture: where it is not 0 is background");
  command.option("--sigma", &settings_.blur.sigma, "Blur of the matte, px, 0..100");
  command.choice(
      "--blur", &settings_.blur.method, "How the blur is computed: fir, box or recursive",
      {{"fir", BlurMethod::fir}, {"box", BlurMethod::box}, {"recursive", BlurMethod::recursive}});
  command.option("--passes", &settings_.blur.passes, "Box: passes, 1..10");
  command.option("--threshold", &settings_.blur.threshold,
                 "Level, 1..255, from which on the blurred matte is 255, else 0; 0: stays grey");
  command.choice("--trace", &settings_.method, "Which line is traced: subpixel or binary",
                 {{"subpixel", TraceMethod::subpixel}, {"binary", TraceMethod::binary}});
  command.flag("--uncorrected", &uncorrected_,
               "Leave the shift that the blur puts on curved boundaries");
  command.option("--tolerance", &settings_.approximate.tolerance,
                 "How far polygons may leave the traced line, px; 0: every traced vertex");
  command.option("--min-edges", &settings_.approximate.min_edges,
                 "Rings with fewer edges are dropped, 3..1000");
  command.option("--min-area", &settings_.approximate.min_area,
                 "Smaller outer rings are dropped, px²");
  command.option("--min-hole-area", &settings_.approximate.min_hole_area,
                 "Smaller holes are filled, px²");
  command.option("--keep-largest", &settings_.approximate.keep_largest,
                 "Only so many outer rings, the largest; 0: all");
}

SilhouetteSettings SilhouetteOptions::settings() const {
  SilhouetteSettings s = settings_;
  if (key_ == "green") {
    s.key.key = KeyColour::green;
  } else if (key_ == "blue") {
    s.key.key = KeyColour::blue;
  } else if (key_ == "auto") {
    s.key.key = KeyColour::automatic;
  } else {
    unsigned rgb = 0;
    char rest = 0;
    if (key_.size() != 6 || std::sscanf(key_.c_str(), "%6x%c", &rgb, &rest) != 1)
      throw Error(Error::Kind::bad_input,
                  "--key {}: expected green, blue, auto or six hexadecimal digits such as 1040c0.",
                  key_);
    s.key.key = KeyColour::custom;
    s.key.colour = {static_cast<std::uint8_t>(rgb >> 16), static_cast<std::uint8_t>(rgb >> 8),
                    static_cast<std::uint8_t>(rgb)};
  }
  if (!roi_.empty()) s.key.roi = {roi_[0], roi_[1], roi_[2], roi_[3]};
  if (!screen_.empty()) s.key.screen = colour_of(screen_, "--screen");
  if (!foreground_.empty()) s.key.foreground = colour_of(foreground_, "--foreground");
  if (!inside_mask_.empty())
    s.key.inside_mask = std::make_shared<Picture>(load_grey_mask(inside_mask_));
  if (!outside_mask_.empty())
    s.key.outside_mask = std::make_shared<Picture>(load_grey_mask(outside_mask_));
  s.correct_curvature = !uncorrected_;
  return s;
}

}  // namespace polyhull
