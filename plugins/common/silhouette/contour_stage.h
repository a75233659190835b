// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From the matte of a frame to its contours, with what is kept between frames.
#pragma once

#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/silhouette/contour_properties.h"
#include "silhouette/contour/approximate.h"
#include "silhouette/contour/trace.h"

namespace polyhull::element {

class ContourStage {
 public:
  /// The contours of \p content. Where reuse is on and neither content nor settings changed, those
  /// of the frame before. The reference stays valid until the next call.
  const Rings& find(const MatteContent& content, const ContourValues& values, double tolerance);

  /// Whether the last find() took over the contours of the frame before.
  bool reused() const { return reused_; }

  const ApproximateCounts& counts() const { return approximator_.counts(); }

  /// Forgets the frame before.
  void reset();

 private:
  struct Settings {
    TraceSettings trace;
    ApproximateSettings approximate;
    bool operator==(const Settings&) const = default;
  };

  Tracer tracer_;
  Approximator approximator_;
  Field unblurred_;
  Rings traced_;
  std::vector<std::int32_t> parents_;
  Rings rings_;
  bool reused_ = false;
  MatteContent before_;
  Settings settings_;
};

}  // namespace polyhull::element
