// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Checked reading of glTF accessors: tinygltf hands over what the file says without holding it
/// against the buffers' sizes.
#pragma once

#include <tiny_gltf.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/error.h"

namespace polyhull {

/// Where numbers of a file lie, and words for the errors.
struct GltfSource {
  const tinygltf::Model& model;
  const std::string& path;
};

/// The error (bad_input) that says "Scene 'path' " and \p what, a sentence's end.
Error broken_scene(const std::string& path, const std::string& what);

/// A number of a glTF extension; \p otherwise where it is missing or no number.
double gltf_number(const tinygltf::ExtensionMap& extensions, const char* extension,
                   const char* name, double otherwise);

/// The error (unsupported) that says that \p what ("positions of mesh 'table'") cannot be unpacked.
Error compressed(const GltfSource& source, const std::string& what, const std::string& extension);

/// All elements of accessor \p index as floats, \p components per element (normalised integers
/// become 0..1 or -1..1); those that a sparse accessor replaces are replaced, and zeros where it has
/// no other data. \p what names them in errors ("positions of mesh 'table'"). Throws Error when the
/// accessor does not exist, has another number of components, or reaches beyond its buffer.
std::vector<float> read_floats(const GltfSource& source, int index, std::size_t components,
                               const std::string& what);

/// All elements of scalar accessor \p index, unsigned integers. Throws Error as read_floats() does.
std::vector<std::uint32_t> read_indices(const GltfSource& source, int index,
                                        const std::string& what);

/// Bytes of the file, which live as long as its model.
struct GltfBytes {
  const unsigned char* data;
  std::size_t size;
};
/// The bytes of buffer view \p index, without up to three of padding that the file leaves out.
/// Throws Error when it does not exist, reaches beyond its buffer, or is only there compressed.
GltfBytes read_view(const GltfSource& source, int index, const std::string& what);

}  // namespace polyhull
