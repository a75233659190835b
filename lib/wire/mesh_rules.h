// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What makes a mesh usable, whether it is to be written or was read: validate_mesh() of
/// mesh_payload.h.
#pragma once

#include <string>

namespace polyhull {

/// Throws the Error (bad_input) that says what is wrong with a mesh.
[[noreturn]] void refuse_mesh(const std::string& what);

}  // namespace polyhull
