// SPDX-License-Identifier: LGPL-2.1-or-later
// What the writers of mesh_files.h share; not installed.
#pragma once

#include <string>
#include <string_view>

#include "files/mesh_files.h"

namespace polyhull {

/// Replaces the file at \p path in one step, so that nobody reads half of it. Throws Error.
void write_whole_file(const std::string& path, std::string_view content);

void write_glb(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);
void write_ply(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);
void write_obj(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);

}  // namespace polyhull
