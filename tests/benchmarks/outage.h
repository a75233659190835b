// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a viewer sees of the moving figure while cameras of its rig are missing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/picture.h"
#include "hull/build/hull_builder.h"
#include "hull/hull.h"
#include "refine/refine.h"
#include "rig/rig.h"
#include "studio/cameras/coverage_raster.h"

namespace polyhull::benchmark {

constexpr double frame_time = 0.04;  // s

/// A frame after the last one with all cameras (frame -1), and how many it stands for.
struct Instant {
  int frame;
  int weight;
};

/// Where the hull that is shown comes from.
enum Source {
  whole,    ///< all cameras, as if none were missing
  without,  ///< the cameras that are left
  held,     ///< those, and the last silhouettes of the missing ones
  frozen,   ///< the last hull of all cameras
  source_count
};

/// A picture of 320 x 240 in black and white.
struct Bits {
  std::vector<std::uint64_t> words;
  bool at(int x, int y) const { return words[(y * 320 + x) / 64] >> x % 64 & 1; }
  int area() const;
  /// Pixels of this and not of \p other.
  int beyond(const Bits& other) const;
};
using Pictures = std::vector<Bits>;  // one per viewpoint

/// Outages that begin at one time of the figure's motion. Viewpoints: at the azimuth of each camera
/// and half-way between neighbours.
class Outage {
 public:
  static constexpr int dense = 25;    ///< every frame up to this one is looked at,
  static constexpr int longest = 75;  ///< and every fifth from there to here

  /// \p refined: as hullrefine shows it, else the hull itself.
  Outage(const Rig& rig, double start, bool refined);

  /// Makes the pictures of all sources with these cameras fallen out.
  void lose(const std::vector<int>& missing);

  /// Frame k, up to `dense`, has the index k + 1.
  const std::vector<Instant>& instants() const { return instants_; }
  const Pictures& shown(Source source, std::size_t i) const { return shown_[source][i]; }

  // Shares of the figure's area, means of the viewpoints:
  double error(const Pictures& shown, std::size_t i) const;    ///< what is wrong
  double cut_off(const Pictures& shown, std::size_t i) const;  ///< what is missing of the figure
  /// What changes from \p before to \p after, shown at instant \p i, less the figure's own change.
  double jump(const Pictures& before, const Pictures& after, std::size_t i) const;

  /// Draws all sources (down) at frames 1, 9 and 24 from two viewpoints (across): white is right,
  /// red cut off, blue added.
  Picture sheet() const;

 private:
  const Hull& build(const std::vector<Rings>& rings, const std::vector<int>& missing = {});
  Pictures pictures(const Hull& hull);
  Pictures pictures(const CoverageRaster::Mesh& mesh);

  Rig rig_;
  std::vector<Camera> views_;
  std::vector<Instant> instants_;
  bool refined_;
  HullBuilder builder_;
  HullRefiner refiner_;
  HullOptions options_;
  CoverageRaster raster_;
  std::vector<std::vector<Rings>> rings_;      // per instant and camera
  std::vector<Pictures> truth_;                // per instant
  std::vector<Pictures> shown_[source_count];  // per instant
};

}  // namespace polyhull::benchmark
