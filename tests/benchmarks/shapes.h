// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Shapes with a known boundary, and frames that show them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/rings.h"
#include "silhouette/pixels/frame.h"
#include "silhouette/pixels/matte.h"

namespace polyhull::benchmark {

/// A shape whose boundary is known: r(phi) = radius + swing * cos(points * phi), an ellipse with
/// half axes radius and radius * squeeze, both about a centre.
struct Shape {
  double cx = 0.0;
  double cy = 0.0;
  double radius = 100.0;
  double swing = 0.0;
  int points = 0;
  double squeeze = 1.0;

  bool inside(double x, double y) const;

  /// Signed distance in px of a point near the boundary, negative inside; exact to about 1e-4.
  double distance(double x, double y) const;

  /// Points of the boundary, \p step px apart or less.
  std::vector<Vec2> boundary(double step) const;
};

/// The figure of the chain's benchmark: 17 % of 1920x1080, boundary of about 12,000 px.
Shape figure_of_17_percent();

/// What fraction of each pixel the shape covers, as 8-bit alpha, from 16x16 samples at the rim.
Matte matte_of(const Shape& shape, int width, int height);

/// A frame with memory of its own.
struct Frame {
  FrameView view;
  std::vector<std::uint8_t> bytes;
};

/// The matte's subject (textured) before an even screen of colour (30, 190, 60), with Gaussian
/// noise of standard deviation \p noise per channel.
/// \p texture: levels by which the subject's colours vary.
Frame frame_of(const Matte& matte, FrameFormat format, double noise, unsigned seed,
               double texture = 12.0);

/// Distances of contours to the shape's boundary: signed, positive where the contour lies outside.
struct ContourError {
  double mean_absolute = 0.0;
  double bias = 0.0;
  double p999 = 0.0;       ///< 99.9 percentile of the absolute
  double hausdorff = 0.0;  ///< largest distance, both ways
  std::size_t vertices = 0;
};

/// Measures along the edges, a sample every quarter of a pixel.
ContourError contour_error(const Rings& rings, const Shape& shape);

/// Largest distance between two closed lines, both ways, samples \p step apart.
double hausdorff(std::span<const Vec2f> a, std::span<const Vec2f> b, double step = 0.25);

}  // namespace polyhull::benchmark
