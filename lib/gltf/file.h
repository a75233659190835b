// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A glTF 2.0 file as it lies on disk: container, JSON, buffers and what addresses lead to.
///
/// tinygltf reads the JSON. What is around it is read here, as tinygltf stops at small faults of the
/// container, knows few spellings of data addresses, and repeats them in its messages.
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <vector>

namespace polyhull {

/// Reads the file at \p path, a GLB or a text by its content, whatever its name's ending.
///
/// Buffers hold what there is of them, none where the file has none; of images there are `name`,
/// `uri` and `bufferView` alone; an accessor without data has bufferView -1. Throws Error: what is
/// no glTF 2.0 file, a required extension that is not known, a buffer's file that is missing.
tinygltf::Model read_gltf(const std::string& path);

/// The bytes to which \p uri in the glTF file at \p path leads: data within it, or a file beside
/// it; none where such a file is missing. \p what names in errors whose they are. Throws Error for
/// damaged data and a file that cannot be read.
std::vector<unsigned char> read_address(const std::string& path, const std::string& uri,
                                        const std::string& what);

}  // namespace polyhull
