// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The boundary of the half level of a blurred matte.
///
/// subpixel: the matte u is known at pixel centres. Where u passes the half level between two
/// neighbouring centres, linear interpolation gives a vertex; each square of four centres joins its
/// vertices by one or two segments (marching squares). With two (a saddle), the mean of the four
/// decides which corners are connected. Vertices never fall on pixel centres, so rings are simple
/// and disjoint by construction. At the frame's border the region ends at x = -0.5, y = -0.5, x =
/// w-0.5, y = h-0.5.
///
/// Correction of the blur's shift: blurring moves a boundary of curvature κ by σ²κ/2 towards the
/// centre of curvature. G_σ acts as exp(σ²Δ/2); applying (1 − s²Δ/2) to the blurred matte removes
/// the shift to second order, s² = σ² + 1/12 (a pixel's own square aperture). The product still is
/// a smoothing filter: its frequency response (1+x)exp(−x), x = σ²ω²/2, falls monotonically from 1.
/// Since it acts on the field and not on the line, the rings stay simple.
#pragma once

#include <cstdint>
#include <memory>

#include "silhouette/matte.h"
#include "silhouette/rings.h"

namespace polyhull {

enum class TraceMethod : std::uint8_t {
  subpixel,
  binary,  ///< the outline of the pixels at or above the half level, along their sides
};

struct TraceSettings {
  TraceMethod method = TraceMethod::subpixel;
  double corrected_sigma = 0.0;  ///< px; the sigma whose shift is corrected, 0: no correction
};

/// Traces a field row by row.
class Tracer {
 public:
  Tracer();
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  void begin(int width, int height, const TraceSettings& settings);

  /// The next row, top to bottom; width values and blocks_across(width) states. Copies what it
  /// needs.
  void push(const std::int16_t* values, const BlockState* states);

  /// After `height` rows: the rings, one vertex per crossing, in the order of their topmost vertex.
  void finish(Rings& rings);

  /// begin(), push() for each row, finish().
  void trace(const Field& field, const TraceSettings& settings, Rings& rings);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Area enclosed by a ring in px², positive for outer rings (counter-clockwise on screen), negative
/// for holes.
double ring_area(std::span<const Vec2f> ring);

}  // namespace polyhull
