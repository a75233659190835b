// SPDX-License-Identifier: LGPL-2.1-or-later
#define FLOW_LOOPS_FUNCTION baseline_flow_loops
#include "texture/align/flow_loops.inc"
