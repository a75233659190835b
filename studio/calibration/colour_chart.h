// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A colour checker of 24 patches (four rows of six) in a camera's picture, and what cameras that
/// saw one would need to see the same colours.
///
/// Of a camera's linear colours x_i of the patches and the wanted ones y_i the matrix M minimises
///   sum w_i |M x_i - y_i|^2 + w_0 |M - g I|^2,
/// g the gain alone that fits best, w_i = (Y_i + 0.02)^(-4/3), the slope of L* over the luminance
/// Y_i squared, so that dark patches count as an eye would count them.
#pragma once

#include <array>
#include <span>
#include <string>

#include "base/picture.h"
#include "base/vector.h"

namespace polyhull {

inline constexpr int chart_columns = 6, chart_rows = 4, chart_patches = 24;

struct ChartColours {
  std::array<Vec3, chart_patches> linear;     ///< from dark skin to black, row by row
  std::array<bool, chart_patches> clipped{};  ///< a hundredth of the pixels and more at 0 or >= 254
};

/// The patches of the chart whose outermost patches' outer corners lie at \p corners (pixels; at
/// dark skin, bluish green, black, white, in this order): the mean light of the middle of each,
/// sRGB undone. Throws Error, naming \p camera, for corners outside of \p picture (3 channels),
/// a four-sided figure that is not convex or less than 8 pixels per patch.
ChartColours read_chart(const Picture& picture, const std::array<Vec2, 4>& corners,
                        const std::string& camera);

/// The mean light of a grey card's part between the corners \p from and \p to (pixels, each axis in any
/// order) of \p picture (3 channels), sRGB undone. Throws Error, naming \p camera, for a rectangle that
/// is not within the picture or has less than 64 pixels, and where a hundredth of it and more is at 0
/// or >= 254.
Vec3 read_card(const Picture& picture, const Vec2& from, const Vec2& to, const std::string& camera);

/// The chart's colours as published for sRGB (X-Rite, before November 2014), linear. Cyan lies
/// outside of sRGB, whose red is clipped.
const std::array<Vec3, chart_patches>& published_chart();

/// The name of patch \p patch.
const char* chart_patch_name(int patch);

/// M as above, which brings the linear colours \p seen nearest to \p wanted; as many of both. The
/// data say little where they are fewer than three colours: M is near g I then.
Mat3 colour_matrix(std::span<const Vec3> seen, std::span<const Vec3> wanted);

}  // namespace polyhull
