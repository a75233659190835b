// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// As lib/precompiled/headers.h, for the elements.

#include <gst/base/gstaggregator.h>
#include <gst/base/gstbasesink.h>
#include <gst/base/gstbasetransform.h>
#include <gst/base/gstpushsrc.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "lib/precompiled/headers.h"
