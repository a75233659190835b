// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The boundary of the half level of a blurred matte.
///
/// subpixel: the matte u is known at pixel centres. Where u passes the half level between two
/// neighbouring centres, linear interpolation gives a vertex; each square of four centres joins its
/// vertices by one or two segments (marching squares). With two (a saddle), the mean of the four
/// decides which corners are connected. Vertices never fall on pixel centres and are multiples of
/// 1/512 px (exact in float up to 32767), so rings are simple and disjoint by construction. At the
/// frame's border the region ends at x = -0.5, y = -0.5, x = w-0.5, y = h-0.5.
///
/// Correction of the blur's shift: the half level of a blurred edge of curvature κ lies off the
/// edge by (κ/2) ∫t²k(t,0)dt / ∫k(t,0)dt towards the centre of curvature, where k(t,n) is the
/// kernel along (t) and across (n) the edge. For the Gaussian G_s that is s²κ/2; here s² = σ² +
/// 1/12, the second term for the pixel's own square aperture (and 1/8 more for the traced line's
/// segments, which are chords of the boundary: of mean squared length l² they lie l²/(12R) inside).
/// Of (1 − cΔ)G_s along n = 0 the second moment is proportional to s² − c, so u − s²Δu has no shift
/// to second order. Since this acts on the field and not on the line, the rings stay simple. The
/// combined frequency response (1+2x)exp(−x), x = s²ω²/2, nowhere exceeds 1.22.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/rings.h"
#include "silhouette/pixels/matte.h"

namespace polyhull {

enum class TraceMethod : std::uint8_t {
  subpixel,
  binary,  ///< the outline of the pixels at or above the half level, along their sides
};

struct TraceSettings {
  TraceMethod method = TraceMethod::subpixel;
  double corrected_sigma = 0.0;  ///< px; the sigma whose shift is corrected, 0: no correction
  bool operator==(const TraceSettings&) const = default;
};

/// Traces fields; keeps its working memory.
class Tracer {
 public:
  Tracer();
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  /// The rings, one vertex per crossing, in the order of their topmost rows. \p parents, if given:
  /// for each ring the ring directly around it, -1 for none.
  void trace(const Field& field, const TraceSettings& settings, Rings& rings,
             std::vector<std::int32_t>* parents = nullptr);

  struct State;

 private:
  std::unique_ptr<State> state_;
};

/// Area enclosed by a ring in px², positive for outer rings (counter-clockwise on screen), negative
/// for holes.
double ring_area(std::span<const Vec2f> ring);

}  // namespace polyhull
