// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Meshes as elements send them.
#pragma once

#include <gst/gst.h>

#include <vector>

#include "wire/mesh_payload.h"

namespace polyhull::test {

inline constexpr char mesh_caps[] = "application/x-polyhull-mesh";

inline GstBuffer* mesh_buffer(const Mesh& mesh, GstClockTime time) {
  const std::vector<std::uint8_t> bytes = write_mesh(mesh);
  GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
  GST_BUFFER_PTS(buffer) = time;
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

}  // namespace polyhull::test
