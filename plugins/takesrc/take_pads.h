// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// takesrc's pads: one a stream. They outlive the take, so that what they are linked to plays the next.
#pragma once

#include <gst/gst.h>

#include <set>
#include <string>

namespace polyhull::element {

/// Name of the pad of the take's stream \p index, which is named \p stream: sink_3's is src_3. \p taken: the
/// names of others; it is added to them.
std::string take_pad_name(const std::string& stream, std::size_t index,
                          std::set<std::string>& taken);

/// The pad \p name of \p element: that of the last time, which may be linked, or a new one, active, with
/// \p event and \p query. \p element keeps it.
GstPad* take_pad(GstElement* element, const std::string& name, GstPadEventFunction event,
                 GstPadQueryFunction query);

/// Takes away the pads of \p element that are none of \p names: those of another take.
void remove_other_pads(GstElement* element, const std::set<std::string>& names);

}  // namespace polyhull::element
