// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the writers of glTF files share: one buffer and what lies in it. Internal.
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// A glTF model with one scene and one buffer. What is added gets the next index, which comes back.
struct GltfBuilder {
  template <typename T>
  static constexpr int default_target =
      std::is_same_v<T, std::uint32_t> ? TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER
      : std::is_same_v<T, float>       ? 0
                                       : TINYGLTF_TARGET_ARRAY_BUFFER;

  GltfBuilder();

  /// A buffer view of the \p size bytes from \p data on, which begins at a multiple of four;
  /// \p target as in glTF (0: none).
  int add_view(const void* data, std::size_t size, int target = 0);

  /// An accessor of vertex attributes (Vec2f, Vec3f), of indices (std::uint32_t), or of an
  /// animation's values (float, Vec3f; \p target 0).
  template <typename T>
  int add_accessor(const std::vector<T>& values, int target = default_target<T>) {
    constexpr bool is_index = std::is_same_v<T, std::uint32_t>;
    constexpr bool is_scalar = is_index || std::is_same_v<T, float>;
    static_assert(is_scalar || std::is_same_v<T, Vec2f> || std::is_same_v<T, Vec3f>);
    tinygltf::Accessor accessor;
    accessor.bufferView = add_view(values.data(), values.size() * sizeof(T), target);
    accessor.componentType =
        is_index ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT : TINYGLTF_COMPONENT_TYPE_FLOAT;
    accessor.type = is_scalar                  ? TINYGLTF_TYPE_SCALAR
                    : std::is_same_v<T, Vec2f> ? TINYGLTF_TYPE_VEC2
                                               : TINYGLTF_TYPE_VEC3;
    accessor.count = values.size();
    return add(model.accessors, std::move(accessor));
  }

  /// The same with the bounds that positions must have.
  int add_positions(const std::vector<Vec3f>& positions);

  /// A texture whose picture is \p encoded, a file's bytes of \p mime_type ("image/png").
  int add_texture(const std::vector<std::uint8_t>& encoded, const std::string& mime_type);

  /// Names \p extension among those that the file uses.
  void use(const char* extension);

  template <typename T>
  static int add(std::vector<T>& list, T item) {
    list.push_back(std::move(item));
    return static_cast<int>(list.size()) - 1;
  }

  tinygltf::Model model;
};

}  // namespace polyhull
