// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raster/raster_loops.h"

#include "base/instruction_set.h"

namespace polyhull {

const RasterLoops& raster_loops() {
#if defined(__x86_64__)
  static const RasterLoops& chosen = may_use_avx2() ? avx2_raster_loops() : baseline_raster_loops();
  return chosen;
#else
  return baseline_raster_loops();
#endif
}

}  // namespace polyhull
