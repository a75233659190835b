// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pictures side by side, to be looked at.
#pragma once

#include <algorithm>
#include <string>

#include "base/picture.h"
#include "base/vector.h"

namespace polyhull::benchmark {

/// A grid of cells of one size, each a part of a picture, in RGB.
class Sheet {
 public:
  /// \p part: of the pictures, which the cells show.
  Sheet(int columns, int rows, const Rectangle& part)
      : part_(part), sheet_{columns * part.width, rows * part.height, 3, {}} {
    sheet_.pixels.resize(static_cast<std::size_t>(sheet_.width) * sheet_.height * 3);
  }

  /// \p picture: RGB or RGBA.
  void put(const Picture& picture, int column, int row) {
    for (int y = 0; y < part_.height; ++y) {
      const std::uint8_t* in = picture.row(part_.y + y) + picture.channels * part_.x;
      std::uint8_t* out = sheet_.row(row * part_.height + y) + 3 * column * part_.width;
      for (int x = 0; x < part_.width; ++x) std::copy_n(in + picture.channels * x, 3, out + 3 * x);
    }
  }

  /// Throws Error as save_picture().
  void save(const std::string& path) const { save_picture(sheet_, path); }

 private:
  Rectangle part_;
  Picture sheet_;
};

}  // namespace polyhull::benchmark
