// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From one set of views to one mesh: contours undistorted, hull built, everything packed into a
/// buffer that shares the views' pixels.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hull/hull.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/statistics.h"
#include "rig/rig.h"
#include "rig/undistort.h"

namespace polyhull::element {

/// How hulls are built.
struct HullParameters {
  double weld_distance = 0.0;
  double max_deviation = 0.0;
  Unseen unseen = Unseen::carve;
  bool use_bounds = true;
  int threads = 0;  ///< 0: all of the pool
};

/// One view of a set and the name of the camera that it counts as.
struct SetView {
  std::string camera;
  const ViewBuffer* view = nullptr;
};

/// Builds meshes, keeping from set to set what can be reused. For one thread.
class HullStage {
 public:
  explicit HullStage(Statistics& statistics);

  void set_rig(Rig rig);
  const Rig& rig() const { return rig_; }

  /// Throws Error if the rig has no camera \p camera or its size is not width x height; \p where
  /// names the pad.
  void check(const std::string& where, const std::string& camera, int width, int height) const;

  /// A buffer with the mesh of \p views (any order; each camera once, each checked), without times.
  /// Fewer than two views with foreground give an empty hull. Warnings are posted on \p element.
  GstBuffer* build(GstElement* element, std::vector<SetView> views,
                   const HullParameters& parameters, std::uint64_t trigger);

  /// Of the last set: whether its hull is empty, and whether each of its views, two at least, has a
  /// foreground.
  bool is_empty() const { return mesh_.hull.empty(); }
  bool all_see_foreground() const;

  /// Forgets contours and hulls of former frames.
  void reset();

 private:
  struct Contours {
    Rings real;
    UndistortedRings ideal;
    bool known = false;
  };
  const UndistortedRings& undistorted(const Camera& camera, const Rings& real);
  void build_hull(GstElement* element, const HullParameters& parameters);
  void report_hull(const HullStatistics& figures);
  void report();

  Statistics& statistics_;
  Rig rig_;
  std::map<std::string, Contours> contours_;
  std::unique_ptr<HullBuilder> builder_;
  Mesh mesh_;                      // the last one; its hull stays where the builder says so
  bool hull_is_builders_ = false;  // mesh_.hull is the builder's last result, and
  double welded_ = 0.0;            // welded by this distance
};

}  // namespace polyhull::element
