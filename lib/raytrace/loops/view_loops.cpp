// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/loops/view_loops.h"

#include "base/instruction_set.h"

namespace polyhull {

const ViewLoops& view_loops() {
#if defined(__x86_64__)
  static const ViewLoops& chosen = may_use_avx2() ? avx2_view_loops() : baseline_view_loops();
  return chosen;
#else
  return baseline_view_loops();
#endif
}

}  // namespace polyhull
