// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pads of an aggregator as its children, for gst-launch's mesh_0::translate-x. A setting
/// that cannot be taken (unknown property, unreadable value, no such pad) is said by a warning when
/// a stream starts.
#pragma once

namespace polyhull::element {

/// The GInterfaceInitFunc for GST_TYPE_CHILD_PROXY of an element.
void pads_as_children(void* interface, void* data);

}  // namespace polyhull::element
