// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A Mesh as application/x-polyhull-mesh bytes, and back. Layout: payload.h; the pixel blocks are
/// the views' pixels in the views' order.
#pragma once

#include "mesh/mesh.h"
#include "wire/payload.h"

namespace polyhull {

/// Everything but the pixels. Throws Error for a mesh that read_mesh() would refuse.
std::vector<std::uint8_t> write_mesh_header(const Mesh& mesh);

/// The number of bytes that write_mesh_header() makes of a valid mesh, without making them. Throws
/// Error for lists that are too long for a payload.
std::size_t mesh_header_size(const Mesh& mesh);

/// The whole payload in one run. Throws Error as write_mesh_header() does.
std::vector<std::uint8_t> write_mesh(const Mesh& mesh);

/// Parses bytes from anywhere: every size, index and number is checked, also each view's and each
/// calibration's. The views' pixels borrow from \p segments. Throws Error, see Payload.
Mesh read_mesh(std::span<const Bytes> segments);

/// The same for a payload in one run.
Mesh read_mesh(Bytes bytes);

/// Throws Error if \p mesh breaks a rule of read_mesh().
void validate_mesh(const Mesh& mesh);

}  // namespace polyhull
