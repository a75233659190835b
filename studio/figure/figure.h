// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The procedural figure: a person of 1.75 m in a striped shirt, trousers and shoes.
///
/// An implicit skin around a skeleton is polygonised at rest when polyhull is built
/// (figure_skin.h); per instant the vertices follow the bones by dual-quaternion blending (L. Kavan
/// et al., "Skinning with dual quaternions", I3D 2007), so the surface is the same closed 2-manifold
/// at all times. Colours are a function of the position at rest, drawn with edges as sharp as the
/// asker's pixels.
#pragma once

#include "studio/figure/figure_skin.h"
#include "studio/figure/skeleton.h"
#include "studio/figure/subject.h"

namespace polyhull {

/// Diffuse albedo (linear Rec. 709) of the figure at the rest position \p p (metres); edges are as
/// wide as \p width.
Vec3f figure_albedo(const Vec3f& p, float width);

class Figure : public Subject {
 public:
  /// \p coarser, if any, will do where a pixel sees \p pixel metres of the figure.
  explicit Figure(FigureSkin skin, std::shared_ptr<const Figure> coarser = nullptr,
                  float pixel = 0.0f);

  void pose(double seconds, SubjectFrame& frame) const override;
  Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float width) const override;

  const std::vector<Vec3f>& rest_positions() const { return skin_.positions; }

 private:
  FigureSkin skin_;                 // but its triangles
  std::vector<glm::vec4> painted_;  // position and openness, which colours are a function of
};

}  // namespace polyhull
