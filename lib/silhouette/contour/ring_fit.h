// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One ring's polygon: runs of traced points, each with its line. Internal.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "silhouette/contour/approximate.h"

namespace polyhull::silhouette {

/// Vertices of approximated rings are multiples of 1/this px.
inline constexpr double vertex_unit = 512.0;

/// The nearest point with such coordinates.
Vec2f snapped(double x, double y);

/// Working memory shared by the fits of a frame.
struct FitMemory {
  // Two numbers at a time: the sums over many points are most of the work.
  using Pair = double __attribute__((vector_size(16)));
  struct Sums {
    Pair x_y, xx_yy;
    Pair cross_xy;  // cross of each point with the one before: twice the area swept from the first
    double x() const { return x_y[0]; }
    double y() const { return x_y[1]; }
    double xx() const { return xx_yy[0]; }
    double yy() const { return xx_yy[1]; }
    double cross() const { return cross_xy[0]; }
    double xy() const { return cross_xy[1]; }
  };
  std::vector<Sums> sums;
};

/// A corner of the polygon and the run that starts there.
struct FitNode {
  int point = 0;        ///< index of the traced point where the run begins
  bool pinned = false;  ///< the corner is that point itself
  bool kept = false;    ///< the corner is given
  bool dirty = true;    ///< the run has not been checked against its edge
  Vec2f vertex{};
  double deviation = 0.0;              ///< of the run's traced points from its edge, at most, px
  double nx = 0.0, ny = 0.0, c = 0.0;  ///< the run's line, relative to the ring's first point
};

/// The polygon of one ring, from the first fit to the last refinement.
class RingFit {
 public:
  /// Approximates \p points (a closed ring) within \p tolerance. The points must outlive the fit.
  /// \p kept: corners that are given, the first at point 0, their points counted from \p begin.
  void fit(std::span<const Vec2f> points, double tolerance, FitMemory& memory,
           std::span<const RingNode> kept = {}, std::uint32_t begin = 0);

  /// Makes run \p r finer: first its corners are pinned, then it is halved. False when it is a
  /// single traced edge already. Call settle() afterwards.
  bool refine(std::size_t r);

  /// Checks runs whose corners have moved and refines them until all are within the tolerance.
  void settle();

  const std::vector<FitNode>& nodes() const { return nodes_; }
  /// marked[r]: run r is refined by the next refine_marked(), which says whether any could be.
  std::vector<std::uint8_t> marked;
  bool refine_marked();

 private:
  struct Line {
    double nx, ny, c;
  };
  Line line_of(int first, int last) const;
  bool fits(int first, int last, double tolerance) const;
  int longest(int first, int end, int guess, double tolerance) const;
  void place_breaks(std::span<const RingNode> kept, std::uint32_t begin);
  void break_up(int end);
  void relax();
  void balance();
  void restore_area();
  double excess(std::size_t r) const;
  bool try_vertex(std::size_t r, Vec2f to);
  bool grow_at(std::size_t r, double area);
  void place_vertex(std::size_t r);
  double deviation(std::size_t r) const;
  int farthest(std::size_t r) const;
  void insert(std::size_t r, int point);
  std::size_t after(std::size_t r) const { return r + 1 < nodes_.size() ? r + 1 : 0; }
  int last_point(std::size_t r) const {
    return r + 1 < nodes_.size() ? nodes_[r + 1].point : static_cast<int>(points_.size());
  }
  Vec2f point(int i) const { return points_[static_cast<std::size_t>(i) % points_.size()]; }

  std::span<const Vec2f> points_;
  double tolerance_ = 1.0;
  double margin_ = 0.0;  // for the rounding of the checks
  FitMemory* memory_ = nullptr;
  std::vector<float> x_, y_;  // relative to the first point, which is repeated at the end
  std::vector<FitNode> nodes_;
};

}  // namespace polyhull::silhouette
