// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The shaders of shaders/, embedded by tools/embed_shaders.py.
#pragma once

#include <span>
#include <string_view>

namespace polyhull {

struct ShaderSource {
  std::string_view name;  ///< the file's name, "hull.vert"
  std::string_view text;
};

/// All of them.
std::span<const ShaderSource> shader_sources();

}  // namespace polyhull
