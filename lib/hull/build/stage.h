// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The whole hull stage, from contours as the cameras saw them to a hull whose faces know their
/// contour edges: undistorted (rig/undistort.h), mended (hull/repair/repair.h), intersected
/// (hull_builder.h), welded (hull/weld.h). Keeps from set to set what can be reused.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "hull/build/hull_builder.h"
#include "hull/camera_contours.h"
#include "hull/repair/doubts.h"
#include "hull/repair/repair.h"
#include "hull/repair/tangency.h"
#include "rig/undistort.h"

namespace polyhull {

/// One object per stream; not for use by two threads at once.
class HullStage {
 public:
  /// The hull of \p views, each of another camera name, which stands for the same calibration in
  /// all calls; HullFace::view indexes them, HullFace::edge the points of their contours(). Fewer
  /// than two views with a foreground have an empty hull: one cone never closes. \p weld_distance:
  /// world units, see weld_vertices(). Valid until the next call.
  /// Throws Error as HullBuilder::build() does.
  const Hull& build(std::span<const CameraContours> views, const HullOptions& options,
                    double weld_distance, Repair repair = Repair::off);

  /// Of the last call: the contours that view number \p view went into the hull with, in real
  /// pixels (the caller's own where nothing was mended, so they must still be there), and what was
  /// mended of them.
  const Rings& contours(std::size_t view) const { return *used_[view].real; }
  const ViewRepair& repair(std::size_t view) const { return repairs_[view]; }

  /// The hull of the silhouettes of the last call, as they went into it, by other \p options and
  /// without the views \p lost; keeps nothing. Throws Error as HullBuilder::build() does.
  Hull rebuilt(const HullOptions& options, std::span<const std::size_t> lost = {}) const;

  /// What the silhouettes of the last call, as they went into the hull, say of each other: see
  /// find_doubts().
  CameraDoubts doubts(Unseen unseen, int points, std::uint32_t round) const;
  /// The same of their frontier points: see find_tangencies().
  std::vector<Tangency> tangencies(std::size_t most_pairs, std::uint32_t round) const;

  /// Of the last call; all zero where no hull was built. The time of undistort_rings() is apart, in
  /// seconds.
  const HullStatistics& statistics() const { return statistics_; }
  double seconds_undistort() const { return seconds_undistort_; }
  /// The time of find_repairs(), in seconds; 0 where the silhouettes are the last call's.
  double seconds_repair() const { return seconds_repair_; }

 private:
  struct Contours {
    Camera camera;
    Rings real;
    UndistortedRings ideal;
    // Without the rings that the last repair of them leaves out, if it does.
    std::vector<std::uint32_t> left_out;
    Rings mended_real;
    UndistortedRings mended_ideal;
    bool is_new = true;  // since the last find_repairs()
  };
  /// A view's contours as the hull takes them.
  struct Used {
    const Rings* real = nullptr;
    const UndistortedRings* ideal = nullptr;
  };
  std::vector<Silhouette> silhouettes() const;
  static std::uint32_t real_edge(const Used& view, std::uint32_t edge);
  Contours& undistorted(const CameraContours& view);
  void find_repairs(std::span<const CameraContours> views, const RepairOptions& options);
  void mend(Contours& contours, const std::vector<std::uint32_t>& leave_out);

  std::map<std::string, Contours> contours_;
  std::vector<Contours*> views_;     // of the last call
  std::vector<Contours*> repaired_;  // views_ at the last find_repairs(), and
  RepairOptions repair_options_;     // its options, and
  std::vector<ViewRepair> repairs_;  // what it found
  std::vector<Used> used_;
  HullBuilder builder_;
  Hull hull_;
  HullStatistics statistics_;
  double seconds_undistort_ = 0.0, seconds_repair_ = 0.0;
  bool is_builders_ = false;  // hull_ is the builder's last result, and
  double welded_ = 0.0;       // welded by this distance
};

}  // namespace polyhull
