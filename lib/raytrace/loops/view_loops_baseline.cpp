// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_FUNCTION baseline_view_loops
#include "raytrace/loops/view_loops.inc"
