// SPDX-License-Identifier: LGPL-2.1-or-later
#pragma once

#include <cstdio>
#include <string>
#include <utility>

#include "base/error.h"

namespace polyhull {

/// Width and height, px, of \p text, the value of \p option: WIDTHxHEIGHT. Throws Error for another, or a
/// size that no picture has.
inline std::pair<int, int> picture_size(const std::string& option, const std::string& text) {
  constexpr int most = 32768;
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 1 ||
      height < 1 || width > most || height > most)
    throw Error(Error::Kind::bad_input,
                "{} is '{}'; expected WIDTHxHEIGHT in pixels, such as 1920x1080.", option, text);
  return {width, height};
}

}  // namespace polyhull
