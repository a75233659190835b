// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_NAME "avx2"
#define LOOPS_FUNCTION avx2_loops
#include "render/processor/loops/loops.inc"
