// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/pixels/frame.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

#include "base/content_hash.h"
#include "base/error.h"

namespace polyhull {
namespace {

struct PlaneShape {
  int planes;
  int bytes;  // per pixel of plane 0
};

PlaneShape shape_of(FrameFormat format) {
  switch (format) {
    case FrameFormat::rgbx:
    case FrameFormat::bgrx:
    case FrameFormat::rgba:
    case FrameFormat::bgra:
      return {1, 4};
    case FrameFormat::rgb:
    case FrameFormat::bgr:
      return {1, 3};
    case FrameFormat::gray8:
    case FrameFormat::bayer8:
      return {1, 1};
    case FrameFormat::bayer10le:
    case FrameFormat::bayer12le:
      return {1, 2};
    case FrameFormat::i420:
      return {3, 1};
    case FrameFormat::nv12:
      return {2, 1};
    case FrameFormat::yuy2:
    case FrameFormat::uyvy:
      return {1, 2};
    case FrameFormat::i420_10le:
      return {3, 2};
    case FrameFormat::v210:
    case FrameFormat::described:
      break;  // no whole bytes per pixel: see row_bytes()
  }
  return {1, 4};
}

int planes_of(const FrameView& frame) {
  if (frame.format != FrameFormat::described) return shape_of(frame.format).planes;
  int last = 0;
  for (const auto& each : frame.samples.components) last = std::max(last, each.plane);
  return last + 1;
}

// The part of a plane's row that holds columns [x0, x1), in bytes.
struct Span {
  std::ptrdiff_t begin, end;
};

Span described_row_bytes(const SampleLayout& samples, int plane, int x0, int x1) {
  Span span{std::numeric_limits<std::ptrdiff_t>::max(), 0};
  for (int c = 0; c < 3; ++c) {
    const SampleLayout::Component& at = samples.components[c];
    if (at.plane != plane) continue;
    const bool halved = c > 0 && samples.halved_across;
    const std::ptrdiff_t first = halved ? x0 / 2 : x0, last = (halved ? (x1 + 1) / 2 : x1) - 1;
    span.begin = std::min(span.begin, at.offset + at.step * first);
    span.end = std::max(span.end, at.offset + at.step * last + (samples.bits > 8 ? 2 : 1));
  }
  return span;
}

Span row_bytes(const FrameView& frame, int plane, int x0, int x1) {
  const FrameFormat format = frame.format;
  if (format == FrameFormat::described) return described_row_bytes(frame.samples, plane, x0, x1);
  const int c0 = x0 / 2, c1 = (x1 + 1) / 2;
  if (plane > 0) {
    if (format == FrameFormat::i420) return {c0, c1};
    return {2 * c0, 2 * c1};  // NV12's pairs, I420_10LE's words
  }
  if (format == FrameFormat::yuy2 || format == FrameFormat::uyvy) return {4 * c0, 4 * c1};
  if (format == FrameFormat::v210) return {16 * (x0 / 6), 16 * ((x1 + 5) / 6)};  // six pixels
  const int bytes = shape_of(format).bytes;
  return {static_cast<std::ptrdiff_t>(bytes) * x0, static_cast<std::ptrdiff_t>(bytes) * x1};
}

}  // namespace

bool is_yuv(FrameFormat format) {
  switch (format) {
    case FrameFormat::i420:
    case FrameFormat::nv12:
    case FrameFormat::yuy2:
    case FrameFormat::uyvy:
    case FrameFormat::i420_10le:
    case FrameFormat::v210:
    case FrameFormat::described:
      return true;
    default:
      return false;
  }
}

bool is_422(FrameFormat format) {
  return format == FrameFormat::yuy2 || format == FrameFormat::uyvy || format == FrameFormat::v210;
}

bool is_ten_bit(FrameFormat format) {
  return format == FrameFormat::i420_10le || format == FrameFormat::v210;
}

bool is_yuv(const FrameView& frame) {
  return is_yuv(frame.format) && !(frame.format == FrameFormat::described && frame.samples.rgb);
}

bool is_deep(const FrameView& frame) {
  return frame.format == FrameFormat::described ? frame.samples.bits > 8 : is_ten_bit(frame.format);
}

bool halved_across(const FrameView& frame) {
  return frame.format == FrameFormat::described ? frame.samples.halved_across
                                                : is_yuv(frame.format);
}

bool halved_down(const FrameView& frame) {
  return frame.format == FrameFormat::described ? frame.samples.halved_down
                                                : is_yuv(frame.format) && !is_422(frame.format);
}

int bayer_bits(FrameFormat format) {
  switch (format) {
    case FrameFormat::bayer8:
      return 8;
    case FrameFormat::bayer10le:
      return 10;
    case FrameFormat::bayer12le:
      return 12;
    default:
      return 0;
  }
}

const char* name_of(FrameFormat format) {
  switch (format) {
    case FrameFormat::rgbx:
      return "RGBx";
    case FrameFormat::bgrx:
      return "BGRx";
    case FrameFormat::rgba:
      return "RGBA";
    case FrameFormat::bgra:
      return "BGRA";
    case FrameFormat::rgb:
      return "RGB";
    case FrameFormat::bgr:
      return "BGR";
    case FrameFormat::gray8:
      return "GRAY8";
    case FrameFormat::i420:
      return "I420";
    case FrameFormat::nv12:
      return "NV12";
    case FrameFormat::yuy2:
      return "YUY2";
    case FrameFormat::uyvy:
      return "UYVY";
    case FrameFormat::i420_10le:
      return "I420_10LE";
    case FrameFormat::v210:
      return "v210";
    case FrameFormat::bayer8:
      return "8-bit Bayer";
    case FrameFormat::bayer10le:
      return "10-bit Bayer";
    case FrameFormat::bayer12le:
      return "12-bit Bayer";
    case FrameFormat::described:
      return "described";
  }
  return "unknown";
}

void check_frame(const FrameView& frame) {
  const auto fail = [&](const std::string& what) {
    throw Error(Error::Kind::bad_input, "Frame ({}, {}x{}): {}.", name_of(frame.format),
                frame.width, frame.height, what);
  };
  if (frame.width < 1 || frame.height < 1 || frame.width > 32767 || frame.height > 32767)
    fail("width and height must be from 1 to 32767");
  for (int plane = 0; plane < planes_of(frame); ++plane) {
    if (!frame.planes[plane]) fail(fmt::format("plane {} is missing", plane));
    const Span bytes = row_bytes(frame, plane, 0, frame.width);
    if (frame.height > 1 && std::abs(frame.strides[plane]) < bytes.end)
      fail(fmt::format("the stride of plane {} is {} bytes, a row needs {}", plane,
                       frame.strides[plane], bytes.end));
  }
}

namespace {

// Calls body(plane, y, bytes) for the rows of all planes that hold the region, one chroma sample
// (or pixel of a mosaic) more on each side because interpolation reaches that far, until it returns
// false.
template <typename Body>
bool each_row(const FrameView& frame, const Rectangle& region, const Body& body) {
  if (region.empty()) return true;
  const bool yuv = is_yuv(frame);
  const bool halved = halved_down(frame);
  const int mosaic = bayer_bits(frame.format) > 0 ? 1 : 0;
  const int x0 = std::max(region.x - (yuv ? 2 : mosaic), 0);
  const int x1 = std::min(region.x + region.width + (yuv ? 3 : mosaic), frame.width);
  for (int plane = 0; plane < planes_of(frame); ++plane) {
    int y0 = std::max(region.y - mosaic, 0);
    int y1 = std::min(region.y + region.height + mosaic, frame.height);
    if (plane > 0 && halved) {
      y0 = std::max(y0 / 2 - 1, 0);
      y1 = std::min((y1 + 1) / 2 + 1, (frame.height + 1) / 2);
    }
    const Span bytes = row_bytes(frame, plane, x0, x1);
    for (int y = y0; y < y1; ++y)
      if (!body(plane, y, bytes)) return false;
  }
  return true;
}

}  // namespace

bool same_layout(const FrameView& a, const FrameView& b) {
  return a.format == b.format && a.width == b.width && a.height == b.height &&
         a.matrix == b.matrix && a.full_range == b.full_range && a.site == b.site &&
         a.bayer == b.bayer && a.samples == b.samples;
}

bool same_pixels(const FrameView& a, const FrameView& b, const Rectangle& region) {
  if (!same_layout(a, b)) return false;
  return each_row(a, region, [&](int plane, int y, Span bytes) {
    return std::memcmp(a.row(plane, y) + bytes.begin, b.row(plane, y) + bytes.begin,
                       static_cast<std::size_t>(bytes.end - bytes.begin)) == 0;
  });
}

std::uint64_t hash_of_some_rows(const FrameView& frame, const Rectangle& region) {
  ContentHash hash;
  if (region.empty()) return hash.value();
  constexpr int rows = 16;
  const Span bytes = row_bytes(frame, 0, region.x, region.x + region.width);
  for (int i = 0; i < rows; ++i) {
    const std::uint8_t* row = frame.row(0, region.y + (2 * i + 1) * region.height / (2 * rows));
    // Whole words.
    hash.add_bytes(row + bytes.begin, static_cast<std::size_t>(bytes.end - bytes.begin) / 8 * 8);
  }
  return hash.value();
}

void FrameCopy::assign(const FrameView& frame, const Rectangle& region) {
  view_ = frame;
  for (int plane = 0; plane < planes_of(frame); ++plane) {
    view_.strides[plane] = row_bytes(frame, plane, 0, frame.width).end;
    planes_[plane].resize(static_cast<std::size_t>(view_.strides[plane]) * frame.height);
    view_.planes[plane] = planes_[plane].data();
  }
  each_row(frame, region, [&](int plane, int y, Span bytes) {
    std::memcpy(planes_[plane].data() + view_.strides[plane] * y + bytes.begin,
                frame.row(plane, y) + bytes.begin,
                static_cast<std::size_t>(bytes.end - bytes.begin));
    return true;
  });
}

}  // namespace polyhull
