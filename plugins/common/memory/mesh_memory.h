// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A mesh as a GstMemory: an object for the elements of this process, and bytes for whoever maps it
/// (a wire, a file, an element that is not ours). The bytes are made when they are first asked for;
/// they are those of write_mesh_header().
#pragma once

#include <gst/gst.h>

#include <cstddef>
#include <span>
#include <vector>

#include "mesh/mesh.h"

namespace polyhull::element {

/// A read-only memory that holds \p mesh. \p pixels: for each view the memory with its pixels
/// (null: it has none), which stays mapped as long as this memory lives, and which View::pixels is
/// set to. Throws Error for a mesh that breaks a rule of validate_mesh(), or pixels that cannot be
/// read.
GstMemory* make_mesh_memory(Mesh mesh, std::span<GstMemory* const> pixels);

/// A read-only memory of all pixels of \p mesh, a memory of make_mesh_memory(), one after the other;
/// for buffers, which hold 16 memories at most. They are put together when they are first asked for.
GstMemory* make_all_pixels_memory(GstMemory* mesh);

/// The memory with the pixels of view \p number of the mesh that \p buffer holds as an object, which
/// lives as long as the buffer; null: it has none.
GstMemory* mesh_pixels(GstBuffer* buffer, std::size_t number);

/// The mesh that \p buffer holds as an object, which lives as long as the buffer; null: its bytes
/// have to be read.
const Mesh* mesh_object(GstBuffer* buffer);

}  // namespace polyhull::element
