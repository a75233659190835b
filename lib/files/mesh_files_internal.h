// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the writers of mesh_files.h share. Internal.
#pragma once

#include <string>
#include <string_view>

#include "files/mesh_files.h"

namespace polyhull {

/// Replaces the file at \p path in one step, so that nobody reads half of it. Throws Error.
void write_whole_file(const std::string& path, std::string_view content);

/// write_mesh_file() for each of the formats. Throw Error.
void write_glb(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);
void write_ply(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);
void write_obj(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);

}  // namespace polyhull
