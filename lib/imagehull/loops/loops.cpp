// SPDX-License-Identifier: LGPL-2.1-or-later
#include "imagehull/loops/loops.h"

#include "base/instruction_set.h"

namespace polyhull::imagehull {

const Loops& loops() {
#if defined(__x86_64__)
  static const Loops& chosen = may_use_avx2() ? avx2_loops() : baseline_loops();
  return chosen;
#else
  return baseline_loops();
#endif
}

}  // namespace polyhull::imagehull
