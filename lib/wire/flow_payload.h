// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Texturing::flows as a part of mesh.fbs.
#pragma once

#include <string>
#include <vector>

#include "mesh/mesh.h"
#include "wire/mesh_generated.h"

namespace polyhull {

/// What is wrong with the flows of \p texturing, whose maps are in order; nothing: empty.
std::string flows_fault(const Texturing& texturing);

/// An estimate of their packed size, bytes.
std::size_t packed_flows_size(const std::vector<PictureFlow>& flows);

flatbuffers::Offset<flatbuffers::Vector<flatbuffers::Offset<wire::PictureFlow>>> pack_flows(
    flatbuffers::FlatBufferBuilder& builder, const std::vector<PictureFlow>& flows);

/// Throws Error where they unpack to more than \p most bytes: their contents are shared.
std::vector<PictureFlow> unpack_flows(
    const flatbuffers::Vector<flatbuffers::Offset<wire::PictureFlow>>* tables, std::size_t most);

}  // namespace polyhull
