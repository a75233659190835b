// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// As plugins/precompiled/headers.h, for the tests of elements.
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <thread>

#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gst/video/video.h>
#include "lib/precompiled/headers.h"

#include "elements/element_test.h"
