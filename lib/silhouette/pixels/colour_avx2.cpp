// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/pixels/colour_kernels.inc"

#include "silhouette/pixels/bayer_kernels.inc"

namespace polyhull::silhouette {

const ColourKernels& avx2_colour_kernels() {
  static const ColourKernels table{convert_yuv, convert_bayer, composite_yuv, composite};
  return table;
}

}  // namespace polyhull::silhouette
