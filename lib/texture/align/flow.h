// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where a picture shows what another one shows: dense optical flow.
///
/// Sought is d(x) with a(x + d) = b(x), the least of
///   sum over x of  w(x) |a(x + d) - b(x)|^2  over a window around x,  + s |grad d|^2 + r(x) |d|^2
/// from coarse to fine, linearised anew on each level (Lucas and Kanade's windows in Horn and
/// Schunck's smoothness: Bruhn, Weickert and Schnoerr 2005), solved by Jacobi's method. Where nothing
/// counts, r pulls d to 0.
#pragma once

#include <cstddef>
#include <vector>

namespace polyhull {

/// A picture's texels, row by row.
struct FlowImage {
  int width = 0, height = 0;
  std::vector<float> channel[3];  ///< codes, 0..255
  std::vector<float> weight;      ///< how much a texel counts, 0..1; 0 all around the picture
  std::size_t texels() const { return static_cast<std::size_t>(width) * height; }
  void resize(int across, int down);  ///< to texels of nothing
  bool operator==(const FlowImage&) const = default;
};

/// Texels from b to a.
struct Flow {
  std::vector<float> dx, dy;
};

/// Finds flows one after the other and keeps the memory. Not for use by two threads at once.
class FlowFinder {
 public:
  /// From \p b to \p a, which must have the same size. Beyond \p most texels d is cut off.
  void find(const FlowImage& a, const FlowImage& b, float most, Flow& out);

 private:
  void halve(const FlowImage& from, FlowImage& to);
  void begin(const Flow& coarse, int coarse_width, int coarse_height, const FlowImage& level);
  void step(const FlowImage& a, const FlowImage& b);
  void judge(const FlowImage& a, const FlowImage& b, float most, Flow& out);

  std::vector<FlowImage> a_, b_;  // smaller and smaller, without the largest
  FlowImage moved_;
  std::vector<float> equations_[5], room_, rest_, target_x_, target_y_, next_x_, next_y_;
  Flow flow_, coarse_;
};

}  // namespace polyhull
