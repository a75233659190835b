// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a sender's packets say, held against what may be: frames, their format, their segment.
#pragma once

#include <gst/gst.h>

#include <string_view>

#include "mesh/view.h"
#include "plugins/viewclientsrc/settings.h"
#include "wire/packet.h"

namespace polyhull::element {

/// The most bytes of a caps or event packet.
inline constexpr std::uint32_t longest_text = 4096;

/// The caps that the text of a caps packet names, to be given back; null where they are neither
/// views' nor meshes', or not fixed.
GstCaps* read_caps(std::string_view text);

/// Reads a segment event's text into \p segment; false where it is none of times.
bool read_segment(std::string_view text, GstSegment& segment);

/// Reads the frame in \p bytes, a view's or a mesh's by \p format, from end to end, and gives its
/// capture time where that is of a pipeline's clock, otherwise no_time. Throws Error for bytes that
/// break a rule of the format, and for a view that \p limits do not allow.
std::int64_t verify_frame(Bytes bytes, std::string_view format, const ViewClientSettings& limits);

}  // namespace polyhull::element
