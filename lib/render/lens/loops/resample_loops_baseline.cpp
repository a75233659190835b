// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_FUNCTION baseline_resample_loops
#include "render/lens/loops/resample_loops.inc"
