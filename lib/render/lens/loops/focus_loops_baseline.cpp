// SPDX-License-Identifier: LGPL-2.1-or-later
#define LOOPS_FUNCTION baseline_focus_loops
#include "render/lens/loops/focus_loops.inc"
