// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The procedural figure: a person of 1.75 m in a striped shirt, trousers and shoes.
///
/// An implicit skin around a skeleton is polygonised once at rest; per instant the vertices follow
/// the bones by dual-quaternion blending (L. Kavan et al., "Skinning with dual quaternions", I3D
/// 2007), so the surface is the same closed 2-manifold at all times. Colours are a function of the
/// position at rest, drawn with edges as sharp as the asker's pixels.
#pragma once

#include <array>

#include "studio/figure/implicit_skin.h"
#include "studio/figure/skeleton.h"
#include "studio/figure/subject.h"

namespace polyhull {

/// The bodies of the figure's skin at rest.
std::vector<SkinBody> figure_bodies();

/// Diffuse albedo (linear Rec. 709) of the figure at the rest position \p p (metres); edges are as
/// wide as \p width.
Vec3f figure_albedo(const Vec3f& p, float width);

class Figure : public Subject {
 public:
  /// \p step is the grid spacing of the polygonisation in metres.
  explicit Figure(float step = 0.019f);

  void pose(double seconds, SubjectFrame& frame) const override;
  Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float width) const override;

  const std::vector<Vec3f>& rest_positions() const { return rest_positions_; }

 private:
  static constexpr int influences = 4;
  std::vector<Vec3f> rest_positions_;
  std::vector<Vec3f> rest_normals_;
  std::vector<float> openness_;  // share of the light from around that no other part holds back
  std::vector<std::array<std::uint8_t, influences>> bones_;
  std::vector<std::array<float, influences>> weights_;
};

}  // namespace polyhull
