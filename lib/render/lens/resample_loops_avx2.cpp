// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_FUNCTION avx2_loops
#include "render/lens/resample_loops.inc"
