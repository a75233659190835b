// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where the pictures and the lists of numbers lie in a view's or mesh's bytes.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "take/packed_layout.h"

namespace polyhull {

/// What there is to find.
struct PayloadRegions {
  std::vector<Region> regions;  ///< by offset, none over another
  /// Of a mesh, of the regions: the hull's vertices.
  std::optional<std::size_t> vertices;
  double metres_per_unit = 1.0;
};

/// Of \p packet, which \p caps say what it is. Of what is neither view nor mesh, or damaged: none.
PayloadRegions find_regions(std::string_view caps, Bytes packet);

}  // namespace polyhull
