// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A view's pixels made ready to be sampled as skin, and smaller pictures of them for where the
/// subject is drawn smaller than it was seen.
///
/// With r the pixels of the view that a pixel of the composite spans at a point of the surface, by
/// their cameras' focal lengths and the point's depths, level floor(log2 r) and the next are mixed,
/// by r / 2^level - 1; where r is 1 or less, the view's own pixels are all. A surface that lies
/// slanted is not seen smaller for that: its picture would be blurred along its other side.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh.h"

namespace polyhull {

/// The region of interest with a border of one repeated pixel all around, so (width + 2) x (height
/// + 2) RGBA pixels. Where the matte is not fully in the foreground (its soft edge, and a few
/// pixels beyond) the colour is continued from the nearest fully covered pixels, so that no
/// background colour is sampled at the silhouette's rim; \p reach: how many pixels. With soft_reach
/// the colours of the soft edge are the view's own, which are straight, and alpha stays the matte, 0 in
/// the border where the frame goes on beyond. \p pixels keeps its memory between calls.
void prepare_view_picture(const View& view, int reach, std::vector<std::uint32_t>& pixels);

inline constexpr int sharp_reach = 6, soft_reach = 16;  ///< pixels beyond sharp and soft edges

/// A smaller picture: pixel i stands for 2^level of the view's, from 2^level i on. A column and a
/// row more than that needs repeat the last.
struct SmallerPicture {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
};

inline constexpr int most_levels = 5;  ///< of smaller pictures; the last is a 32nd in size

/// Half the size of \p pixels (\p width x \p height): each pixel the mean of four in linear light,
/// weighted by how much they show the subject, where any do.
SmallerPicture halved(std::span<const std::uint32_t> pixels, int width, int height);

/// How many smaller pictures of view \p view there must be at least for \p mesh as it is seen from
/// \p eyes (mesh world coordinates) by viewports whose pixels measure \p pixel_size at depth 1.
int levels_needed(const Mesh& mesh, int view, const std::vector<Vec3>& eyes, double pixel_size);

}  // namespace polyhull
