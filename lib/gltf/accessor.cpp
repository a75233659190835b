// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gltf/accessor.h"

#include <algorithm>
#include <cstring>

#include "base/error.h"

namespace polyhull {
namespace {

Error broken_accessor(const GltfSource& source, const std::string& what, const std::string& why) {
  return Error(Error::Kind::bad_input, "Scene '{}': the {} cannot be read: {}.", source.path, what,
               why);
}

/// Sparse accessors may have no data but what they replace: zeros whose number nothing bounds.
constexpr std::size_t most_without_data = std::size_t{1} << 20;

/// 0: no type of glTF's.
std::size_t component_bytes(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

/// Elements in a buffer view: element i starts at data + i * stride.
struct Run {
  const unsigned char* data;
  std::size_t stride;
};

/// \p count elements of \p element bytes each from \p offset on in buffer view \p view.
Run open_run(const GltfSource& source, int view, std::size_t offset, std::size_t count,
             std::size_t element, const std::string& what) {
  const GltfBytes bytes = read_view(source, view, what);
  const std::size_t declared = source.model.bufferViews[view].byteStride;
  const std::size_t stride = declared ? declared : element;
  if (count > 0 && (offset > bytes.size || stride < element || bytes.size - offset < element ||
                    (bytes.size - offset - element) / stride < count - 1)) {
    throw broken_accessor(
        source, what, "its accessor reaches beyond its buffer (the file is cut short or damaged)");
  }
  return {bytes.data + offset, stride};
}

/// The accessor, whose count is one that it has data for.
const tinygltf::Accessor& checked_accessor(const GltfSource& source, int index,
                                           std::size_t components, const std::string& what) {
  if (index < 0 || static_cast<std::size_t>(index) >= source.model.accessors.size())
    throw broken_accessor(source, what, fmt::format("accessor {} does not exist", index));
  const tinygltf::Accessor& accessor = source.model.accessors[index];
  const int stored = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  if (stored != static_cast<int>(components) || component_bytes(accessor.componentType) == 0)
    throw broken_accessor(source, what, "its accessor has another type than it must have");
  if (accessor.bufferView < 0 && accessor.count > most_without_data) {
    throw broken_accessor(source, what,
                          fmt::format("its accessor says {} elements but has no data for them "
                                      "(at most {} are taken for zeros)",
                                      accessor.count, most_without_data));
  }
  if (accessor.bufferView >= 0)
    open_run(source, accessor.bufferView, accessor.byteOffset, accessor.count,
             components * component_bytes(accessor.componentType), what);
  return accessor;
}

template <typename T>
T load(const unsigned char* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

float component(const unsigned char* p, int type, std::size_t k, bool normalised) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return load<float>(p + 4 * k);
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const float v = load<std::int8_t>(p + k);
      return normalised ? std::max(v / 127.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return normalised ? p[k] / 255.0f : p[k];
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const float v = load<std::int16_t>(p + 2 * k);
      return normalised ? std::max(v / 32767.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      const float v = load<std::uint16_t>(p + 2 * k);
      return normalised ? v / 65535.0f : v;
    }
    default:
      return static_cast<float>(load<std::uint32_t>(p + 4 * k));
  }
}

std::uint32_t index_at(const GltfSource& source, const unsigned char* p, int type,
                       const std::string& what) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return load<std::uint32_t>(p);
    default:
      throw broken_accessor(source, what, "indices must be unsigned integers");
  }
}

/// Gives \p take the number and the place of each element that \p accessor has data for: those of
/// its buffer view, then those that replace some of them. What it is not given is zero.
template <typename Take>
void for_each_element(const GltfSource& source, const tinygltf::Accessor& accessor,
                      std::size_t components, const std::string& what, Take take) {
  const std::size_t element = components * component_bytes(accessor.componentType);
  if (accessor.bufferView >= 0) {
    const Run run =
        open_run(source, accessor.bufferView, accessor.byteOffset, accessor.count, element, what);
    for (std::size_t i = 0; i < accessor.count; ++i) take(i, run.data + i * run.stride);
  }
  if (!accessor.sparse.isSparse) return;
  const auto& places = accessor.sparse.indices;
  const auto& values = accessor.sparse.values;
  if (accessor.sparse.count < 0 || places.byteOffset < 0 || values.byteOffset < 0 ||
      component_bytes(places.componentType) == 0)
    throw broken_accessor(source, what, "the sparse part of its accessor has a wrong number");
  const auto count = static_cast<std::size_t>(accessor.sparse.count);
  const Run place_run =
      open_run(source, places.bufferView, static_cast<std::size_t>(places.byteOffset), count,
               component_bytes(places.componentType), what);
  const Run value_run = open_run(source, values.bufferView,
                                 static_cast<std::size_t>(values.byteOffset), count, element, what);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t place =
        index_at(source, place_run.data + i * place_run.stride, places.componentType, what);
    if (place >= accessor.count) {
      throw broken_accessor(
          source, what,
          fmt::format("its accessor replaces element {} but has only {}", place, accessor.count));
    }
    take(place, value_run.data + i * value_run.stride);
  }
}

}  // namespace

Error broken_scene(const std::string& path, const std::string& what) {
  return Error(Error::Kind::bad_input, "Scene '{}' {}", path, what);
}

double gltf_number(const tinygltf::ExtensionMap& extensions, const char* extension,
                   const char* name, double otherwise) {
  const auto found = extensions.find(extension);
  if (found == extensions.end() || !found->second.Has(name)) return otherwise;
  const tinygltf::Value& value = found->second.Get(name);
  return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

GltfBytes read_view(const GltfSource& source, int index, const std::string& what) {
  const tinygltf::Model& model = source.model;
  if (index < 0 || static_cast<std::size_t>(index) >= model.bufferViews.size())
    throw broken_accessor(source, what, fmt::format("buffer view {} does not exist", index));
  const tinygltf::BufferView& view = model.bufferViews[index];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
    throw broken_accessor(source, what, fmt::format("buffer {} does not exist", view.buffer));
  const std::vector<unsigned char>& bytes = model.buffers[view.buffer].data;
  const std::size_t there = view.byteOffset < bytes.size() ? bytes.size() - view.byteOffset : 0;
  // Some writers count the padding at the end, which others leave out.
  constexpr std::size_t padding = 3;
  if (view.byteLength > there + (there > 0 ? padding : 0)) {
    // A buffer that compressed data are to be unpacked to is none.
    for (const auto& [extension, value] : view.extensions)
      if (bytes.empty() && value.Has("buffer")) throw compressed(source, what, extension);
    throw broken_accessor(
        source, what,
        fmt::format("buffer view {} reaches beyond its buffer {}, which has {} bytes (the file is "
                    "cut short or damaged)",
                    index, view.buffer, bytes.size()));
  }
  return {bytes.data() + std::min(view.byteOffset, bytes.size()), std::min(view.byteLength, there)};
}

Error compressed(const GltfSource& source, const std::string& what, const std::string& extension) {
  return Error(
      Error::Kind::unsupported,
      "Scene '{}': the {} are only there by the glTF extension {}, which is not supported. "
      "Export it without (for Blender: no compression).",
      source.path, what, extension);
}

std::vector<float> read_floats(const GltfSource& source, int index, std::size_t components,
                               const std::string& what) {
  const tinygltf::Accessor& accessor = checked_accessor(source, index, components, what);
  std::vector<float> values(accessor.count * components);
  for_each_element(source, accessor, components, what,
                   [&](std::size_t i, const unsigned char* element) {
                     for (std::size_t k = 0; k < components; ++k) {
                       values[i * components + k] =
                           component(element, accessor.componentType, k, accessor.normalized);
                     }
                   });
  return values;
}

std::vector<std::uint32_t> read_indices(const GltfSource& source, int index,
                                        const std::string& what) {
  const tinygltf::Accessor& accessor = checked_accessor(source, index, 1, what);
  std::vector<std::uint32_t> values(accessor.count);
  for_each_element(source, accessor, 1, what, [&](std::size_t i, const unsigned char* element) {
    values[i] = index_at(source, element, accessor.componentType, what);
  });
  return values;
}

}  // namespace polyhull
