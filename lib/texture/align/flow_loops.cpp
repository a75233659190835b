// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/align/flow_loops.h"

#include "base/instruction_set.h"

namespace polyhull {

const FlowLoops& flow_loops() {
#if defined(__x86_64__)
  static const FlowLoops& chosen = may_use_avx2() ? avx2_flow_loops() : baseline_flow_loops();
  return chosen;
#else
  return baseline_flow_loops();
#endif
}

}  // namespace polyhull
