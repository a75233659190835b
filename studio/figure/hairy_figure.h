// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The figure with a coat of hair: an outline that no polygon follows.
///
/// Every strand is a closed tapered tube, thinner than a pixel of the built-in rig's cameras, so that
/// what a pixel shows of it is a share of the pixel; cameras, mattes and truths need to know nothing
/// of it.
#pragma once

#include <memory>

#include "studio/figure/figure.h"

namespace polyhull {

class HairyFigure : public Subject {
 public:
  /// About \p strands strands stand on \p figure, longer on the head, none on the feet.
  explicit HairyFigure(std::shared_ptr<const Figure> figure, int strands = 16000);

  void pose(double seconds, SubjectFrame& frame) const override;
  Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float width) const override;

 private:
  struct Strand {
    std::uint32_t triangle = 0;  ///< of the figure, on which it stands
    Vec3f at{0.0f};              ///< where, barycentric
    Vec3f lean{0.0f};            ///< of its tip, as a share of the length
    float length = 0.0f;         ///< metres
    float radius = 0.0f;         ///< at the root, metres
    float shade = 1.0f;          ///< of the skin's colour
  };
  std::shared_ptr<const Figure> figure_;
  std::vector<Strand> strands_;
};

}  // namespace polyhull
