// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of contourfind, which silhouette has too.
#pragma once

#include <span>
#include <string>

#include "plugins/common/property_table.h"
#include "silhouette/silhouette.h"

namespace polyhull::element {

/// Where a view's trigger number comes from.
enum class TriggerSource { meta, offset, none };

/// What users can set on contourfind.
struct ContourValues {
  std::string camera;
  TraceMethod method = SilhouetteSettings{}.method;
  bool correct_curvature = SilhouetteSettings{}.correct_curvature;
  double tolerance = ApproximateSettings{}.tolerance;
  int min_edges = ApproximateSettings{}.min_edges;
  double min_area = ApproximateSettings{}.min_area;
  double min_hole_area = ApproximateSettings{}.min_hole_area;
  int keep_largest = ApproximateSettings{}.keep_largest;
  double steadiness = ContourSettings{}.steadiness;
  bool adaptive = false;
  double target_rate = 0.0;
  bool reuse = SilhouetteSettings{}.reuse;
  TriggerSource trigger = TriggerSource::meta;

  /// The approximation's settings, with \p tolerance_now (px) in the place of the one set.
  ApproximateSettings approximation(double tolerance_now) const {
    return {tolerance_now, min_edges, min_area, min_hole_area, keep_largest};
  }
};

/// One row per property of ContourValues.
std::span<const Property<ContourValues>> contour_properties();

}  // namespace polyhull::element
