// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/instruction_set.h"
#include "render/lens/loops/focus_loops.h"
#include "render/lens/loops/motion_loops.h"
#include "render/lens/loops/resample_loops.h"

namespace polyhull::lens {

#if defined(__x86_64__)
const ResampleLoops& resample_loops() {
  static const bool avx2 = may_use_avx2();
  return avx2 ? avx2_resample_loops() : baseline_resample_loops();
}
const FocusLoops& focus_loops() {
  static const bool avx2 = may_use_avx2();
  return avx2 ? avx2_focus_loops() : baseline_focus_loops();
}
const MotionLoops& motion_loops() {
  static const bool avx2 = may_use_avx2();
  return avx2 ? avx2_motion_loops() : baseline_motion_loops();
}
#else
const ResampleLoops& resample_loops() {
  return baseline_resample_loops();
}
const FocusLoops& focus_loops() {
  return baseline_focus_loops();
}
const MotionLoops& motion_loops() {
  return baseline_motion_loops();
}
#endif

}  // namespace polyhull::lens
