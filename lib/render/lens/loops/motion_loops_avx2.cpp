// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_FUNCTION avx2_motion_loops
#include "render/lens/loops/motion_loops.inc"
