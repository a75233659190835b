// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What happens to a view as it enters hullbuild: its buffer's times become the running time at
/// which it was taken, on one scale for all cameras (mesh/instants.h). All that comes after, the
/// base class too, goes by these.
#pragma once

#include <gst/gst.h>

namespace polyhull::element {

/// For LivePadState::entry. Views of before running time 0 are dropped and counted as views-early.
GstPadProbeReturn place_view(GstPad* pad, GstPadProbeInfo* info);

}  // namespace polyhull::element
