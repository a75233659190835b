// SPDX-License-Identifier: LGPL-2.1-or-later
// The split view: frame, matte, status and result in one picture.
#include <algorithm>
#include <vector>

#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

constexpr int grey = 128;  // behind the result: light and dark rims show on it alike

/// RGBA pixels, opaque: \p pixels over grey.
void put_on_grey(std::vector<std::uint8_t>& pixels) {
  for (std::size_t i = 0; i < pixels.size(); i += 4) {
    const int alpha = pixels[i + 3];
    for (std::size_t c = i; c < i + 3; ++c)
      pixels[c] = static_cast<std::uint8_t>((pixels[c] * alpha + grey * (255 - alpha) + 127) / 255);
    pixels[i + 3] = 255;
  }
}

/// The means of two by two pixels of two rows; what lies beyond an odd width is the last column.
void halve(const std::vector<std::uint8_t>& upper, const std::vector<std::uint8_t>& lower,
           int width, int count, std::uint8_t* out) {
  for (int x = 0; x < count; ++x) {
    const std::size_t a = 8 * static_cast<std::size_t>(x);
    const std::size_t b = 2 * x + 1 < width ? a + 4 : a;
    for (std::size_t c = 0; c < 4; ++c)
      out[4 * x + static_cast<int>(c)] = static_cast<std::uint8_t>(
          (upper[a + c] + upper[b + c] + lower[a + c] + lower[b + c] + 2) / 4);
  }
}

/// A square of \p colour with a white border, its corner at \p out.
void put_swatch(const Rgb& colour, int size, std::uint8_t* out, std::ptrdiff_t stride) {
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      std::uint8_t* p = out + stride * y + 4 * static_cast<std::ptrdiff_t>(x);
      const bool border = x == 0 || y == 0 || x == size - 1 || y == size - 1;
      for (int c = 0; c < 3; ++c) p[c] = border ? 255 : colour[static_cast<std::size_t>(c)];
    }
}

}  // namespace

void Keyer::write_split(const FrameView& frame, const Matte& matte, std::uint8_t* rgba,
                        std::ptrdiff_t stride) const {
  const int left = (frame.width + 1) / 2, top = (frame.height + 1) / 2;
  std::vector<std::uint8_t> rows[2];
  for (auto& row : rows) row.resize(4 * static_cast<std::size_t>(frame.width));
  // Quarter by quarter, from left to right and from top to bottom.
  for (int quarter = 0; quarter < 4; ++quarter) {
    const int x0 = quarter % 2 == 0 ? 0 : left, y0 = quarter < 2 ? 0 : top;
    const int across = quarter % 2 == 0 ? left : frame.width - left;
    const int down = quarter < 2 ? top : frame.height - top;
    for (int y = 0; y < down; ++y) {
      for (int i = 0; i < 2; ++i) {
        const int from = std::min(2 * y + i, frame.height - 1);
        const Rectangle whole{0, from, frame.width, 1};
        if (quarter == 0) {
          convert_row(frame, from, 0, frame.width, rows[i].data());
        } else {
          constexpr KeyView views[] = {KeyView::matte, KeyView::status, KeyView::composite};
          write_rgba(frame, matte, whole, views[quarter - 1], rows[i].data(), stride);
          if (quarter == 3) put_on_grey(rows[i]);
        }
      }
      halve(rows[0], rows[1], frame.width, across,
            rgba + stride * (y0 + y) + 4 * static_cast<std::ptrdiff_t>(x0));
    }
  }
  // What the key was made of: the screen's colour and the subject's, in the frame's lower left.
  const int size = frame.height / 16;
  if (!state_->samples.valid || size < 4 || 3 * size > left) return;
  std::uint8_t* corner = rgba + stride * (top - size - size / 2) + 4 * (size / 2);
  put_swatch(state_->samples.screen, size, corner, stride);
  put_swatch(state_->samples.foreground, size, corner + 4 * static_cast<std::ptrdiff_t>(size),
             stride);
}

}  // namespace polyhull
