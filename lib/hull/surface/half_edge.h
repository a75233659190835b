// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Half-edges of a triangle mesh by number: those of triangle t are 3 t, 3 t + 1 and 3 t + 2, and
/// half-edge h begins at the vertex triangles[h].
#pragma once

#include <cstdint>

namespace polyhull::hull {

/// The next half-edge around the same triangle, which begins where \p h ends.
inline std::uint32_t following(std::uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}

}  // namespace polyhull::hull
