// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From the matte to polygons: traced (trace.h) and approximated (approximate.h). The contours stay
/// for pictures that are the same again, or are but for noise: else each frame of a motionless
/// subject would have another polygon within the tolerance, and its outline would flicker.
#pragma once

#include <memory>

#include "base/rings.h"
#include "silhouette/contour/approximate.h"
#include "silhouette/contour/trace.h"
#include "silhouette/pixels/matte.h"

namespace polyhull {

struct ContourSettings {
  TraceSettings trace;
  ApproximateSettings approximate;
  /// Px, 0..10: where the traced line runs within this distance of that which the last contours were
  /// made of, they stay; elsewhere they are made anew. So contours lie within the tolerance of a
  /// line within this distance of the traced one: what moves, does not lag, and what drifts is
  /// followed. 0, or with a tolerance of 0: nothing of the last contours stays.
  double steadiness = 0.25;
  bool operator==(const ContourSettings&) const = default;
};

/// Finds one stream's contours; keeps its working memory between pictures.
class Contourer {
 public:
  Contourer();
  ~Contourer();
  Contourer(Contourer&&) noexcept;
  Contourer& operator=(Contourer&&) noexcept;

  /// The contours of the next picture, valid until the next call. Throws Error (bad_input) for
  /// settings out of range.
  const Rings& find(const Field& field, const ContourSettings& settings);
  /// The same of an unblurred matte.
  const Rings& find(const Matte& matte, const ContourSettings& settings);

  /// Whether contours() are what find() would give for the last picture with \p settings.
  bool holds(const ContourSettings& settings) const;
  /// Whether the last find() changed nothing of the contours (ContourSettings::steadiness).
  bool stayed() const;
  /// What find() gave for the last picture, and what it counted.
  const Rings& contours() const;
  const ApproximateCounts& counts() const;

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
