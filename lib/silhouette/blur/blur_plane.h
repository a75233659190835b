// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Blurs that run over whole rows and columns, in float: box and recursive. Internal.
#pragma once

#include <vector>

#include "silhouette/blur/blur.h"

namespace polyhull::silhouette {

class PlaneBlur {
 public:
  /// Blurs into \p field, whose size is the matte's; writes values and states.
  void apply(const Matte& matte, const BlurSettings& settings, Field& field);

 private:
  std::vector<float> plane_, padded_, result_;
};

}  // namespace polyhull::silhouette
