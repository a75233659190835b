// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// As lib/precompiled/headers.h, for the synthetic stage.

#include "lib/precompiled/headers.h"
