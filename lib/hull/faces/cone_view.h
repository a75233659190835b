// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A face in another camera's picture. The grid over that camera's silhouette tells which of its
/// edges may meet what is left of the face there; if none, that lies inside or outside as a whole.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hull/faces/face_chart.h"

namespace polyhull::hull {

/// A box around corners in (t, w).
struct Extent {
  double t0, t1, w0, w1;
  double error;  ///< the largest of the corners' tolerances
  bool endless;  ///< up to the apex, or not known
};

/// One cone as the chart's face meets it. For one thread.
class ConeView {
 public:
  explicit ConeView(FaceChart& chart) : chart_(chart) {}

  /// Before the first face, where the largest cone has \p most edges.
  void begin(std::size_t most);

  /// Has the cone look at the chart's face.
  void look_from(std::uint32_t cone);
  const Cone& cone() const { return *cone_; }
  std::uint32_t base() const { return base_; }  ///< the cone's first plane

  enum class Meeting { inside, outside, perhaps };
  /// Finds the edges of the cone that may meet what lies in the extent, or that there is none.
  Meeting gather(const Extent& extent);
  /// What gather() has found.
  std::span<const std::uint32_t> edges() const { return {candidates_.data(), candidate_count_}; }

  /// The line that the cone's face \p edge makes on the chart.
  const Line& line(std::uint32_t edge) {
    if (line_stamp_[edge] != look_now_) {
      line_stamp_[edge] = look_now_;
      lines_[edge] = line_of(cone_->normals[edge], axes_);
    }
    return lines_[edge];
  }

  /// Whether the loop of the node, which crosses no face of the cone, lies inside it.
  bool inside(const Node& node);

 private:
  struct Quadrilateral;
  Meeting gather_edges(Quadrilateral& quad, const ContourGrid::Block& block, double error);
  void find_rows(const Quadrilateral& quad, const ContourGrid::Block& block);
  Meeting locate(const Vec2& pixel, double error) const;
  double pixel_error(double tolerance, double sum, const Vec2& pixel, double z) const;
  bool inside_exactly(const Node& node);

  FaceChart& chart_;
  const Cone* cone_ = nullptr;
  std::uint32_t base_ = 0;
  ChartAxes axes_{};                                 ///< from the cone's centre
  Vec3 pixel_a_{0.0}, pixel_b_{0.0}, pixel_d_{0.0};  ///< axes_ in homogeneous pixels
  std::vector<std::uint32_t> candidates_;
  std::uint32_t candidate_count_ = 0;
  std::vector<std::uint32_t> stamp_, line_stamp_;
  std::vector<Line> lines_;
  std::vector<std::array<int, 2>> rows_;
  std::uint32_t stamp_now_ = 0, look_now_ = 0;
};

}  // namespace polyhull::hull
