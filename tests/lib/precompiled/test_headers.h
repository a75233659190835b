// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// As lib/precompiled/headers.h, for the tests of lib.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "lib/precompiled/headers.h"
