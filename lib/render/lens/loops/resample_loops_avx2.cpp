// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_FUNCTION avx2_resample_loops
#include "render/lens/loops/resample_loops.inc"
