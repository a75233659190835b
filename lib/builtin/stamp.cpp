// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/stamp.h"

#include <algorithm>

namespace polyhull {
namespace {

constexpr int cells = 7;               // along a side, the rim's included
constexpr int smallest_subject = 24;   // pixels
constexpr int cells_per_subject = 44;  // of the subject's height
constexpr std::uint32_t always_white = 1u << 24;

/// The 25 bits in the label's inside.
std::uint32_t code_of(std::uint16_t number) {
  const std::uint32_t check = (number * 0x9E3779B1u) >> 24;
  return number | check << 16 | always_white;
}

bool is_rim(int cell_x, int cell_y) {
  return cell_x == 0 || cell_y == 0 || cell_x == cells - 1 || cell_y == cells - 1;
}

bool is_magenta(const std::uint8_t* p) {
  return p[0] > 150 && p[2] > 150 && p[1] < 100 && p[3] > 250;
}

}  // namespace

void draw_stamp(std::uint16_t number, const Rectangle& subject, std::uint8_t* pixels,
                std::ptrdiff_t stride, int width, int height) {
  if (subject.height < smallest_subject) return;
  const int cell = std::max(2, (subject.height + cells_per_subject / 2) / cells_per_subject);
  const int size = cells * cell;
  // The chest is a little above the middle. Even, so that halved chroma has whole cells.
  const int left = (subject.x + subject.width / 2 - size / 2) & ~1;
  const int top = (subject.y + subject.height * 2 / 5 - size / 2) & ~1;
  const std::uint32_t code = code_of(number);
  for (int y = std::max(top, 0); y < std::min(top + size, height); ++y)
    for (int x = std::max(left, 0); x < std::min(left + size, width); ++x) {
      const int cell_x = (x - left) / cell, cell_y = (y - top) / cell;
      const bool rim = is_rim(cell_x, cell_y);
      const bool white = !rim && (code >> ((cell_y - 1) * (cells - 2) + cell_x - 1) & 1) != 0;
      std::uint8_t* p = pixels + y * stride + 4 * x;
      p[0] = p[2] = rim || white ? 255 : 0;
      p[1] = white ? 255 : 0;
      p[3] = 255;
    }
}

std::optional<std::uint16_t> read_stamp(const std::uint8_t* pixels, std::ptrdiff_t stride,
                                        int width, int height) {
  int left = width, right = -1, top = height, bottom = -1;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!is_magenta(pixels + y * stride + 4 * x)) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  const double cell_x = (right + 1 - left) / static_cast<double>(cells);
  const double cell_y = (bottom + 1 - top) / static_cast<double>(cells);
  if (right < 0 || cell_x < 1.5 || cell_y < 1.5) return {};
  std::uint32_t code = 0;
  for (int row = 1; row < cells - 1; ++row)
    for (int column = 1; column < cells - 1; ++column) {
      const int x = left + static_cast<int>((column + 0.5) * cell_x);
      const int y = top + static_cast<int>((row + 0.5) * cell_y);
      if (pixels[y * stride + 4 * x + 1] > 127)
        code |= 1u << ((row - 1) * (cells - 2) + column - 1);
    }
  const auto number = static_cast<std::uint16_t>(code & 0xFFFF);
  if (code != code_of(number)) return {};
  return number;
}

}  // namespace polyhull
