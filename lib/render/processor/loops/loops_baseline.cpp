// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_NAME "baseline"
#define LOOPS_FUNCTION baseline_loops
#include "render/processor/loops/loops.inc"
