// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a hull's vertices look like in the pictures that see them, for fill_colours.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/texturing.h"

namespace polyhull {

/// A view's pixels.
struct FillPicture {
  Rectangle roi;                         ///< the part of the frame that `pixels` covers
  int stride = 0;                        ///< bytes from one row to the next
  std::span<const std::uint8_t> pixels;  ///< RGBA, alpha the matte; none: the view colours nothing
  Mat3f colour{1.0f};                    ///< what its linear colours are multiplied by
};

/// A colour, and how sure it is that it is the surface's own.
struct FillSample {
  Vec3f colour{0.0f};       ///< sRGB codes, 0..255
  float confidence = 0.0f;  ///< 1: seen straight and far from all rims; 0: no colour
  bool open = false;        ///< the vertex's colour is to be found; if not, it is the sample's
};

/// One sample per vertex, from the two views that weigh most there: means of 3 x 3 pixels that the
/// mattes hold whole, the confidence w' * fade with w' = min(1, 3 weight) of the better view. A
/// vertex on a rim, as a hull's own are, takes what the larger triangles around it show at their
/// middles. Open are the vertices that no view sees, and the doubtful ones (confidence < 1) around
/// them and on larger triangles; beside those and theirs no vertex has a colour, as none is shown.
/// \p all: there, too. Other parameters as FillColours::find()'s.
std::vector<FillSample> fill_samples(const Hull& hull, std::span<const Camera> cameras,
                                     std::span<const FillPicture> pictures,
                                     const Texturing& texturing, int threads, bool all = false);

/// The size of the views' pixels at the hull, world units; the mean over the views, 1 without views.
float mean_pixel_size(const Hull& hull, std::span<const Camera> cameras);

}  // namespace polyhull
