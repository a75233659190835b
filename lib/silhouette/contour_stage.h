// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From the matte of a frame to its contours, with what is kept between frames.
#pragma once

#include "silhouette/contour/approximate.h"
#include "silhouette/contour/trace.h"
#include "silhouette/pixels/matte_content.h"

namespace polyhull {

class ContourStage {
 public:
  struct Settings {
    TraceSettings trace;
    ApproximateSettings approximate;
    bool operator==(const Settings&) const = default;
  };

  /// The contours of \p content. With \p reuse, where neither content nor settings changed, those
  /// of the frame before. The reference stays valid until the next call.
  const Rings& find(const MatteContent& content, const Settings& settings, bool reuse);

  /// Whether the last find() took over the contours of the frame before.
  bool reused() const { return reused_; }

  const ApproximateCounts& counts() const { return approximator_.counts(); }

  /// Forgets the frame before.
  void reset();

 private:
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

}  // namespace polyhull
