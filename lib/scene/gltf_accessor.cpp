// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/gltf_accessor.h"

#include <algorithm>
#include <cstring>

#include "base/error.h"

namespace polyhull {
namespace {

Error broken_accessor(const GltfSource& source, const std::string& what, const std::string& why) {
  return Error(Error::Kind::bad_input, "Scene '{}': the {} cannot be read: {}.", source.path, what,
               why);
}

/// A checked accessor: element i starts at data + i * stride.
struct Elements {
  const unsigned char* data;
  std::size_t count;
  std::size_t stride;
  int component_type;
  bool normalised;
};

Elements open_accessor(const GltfSource& source, int index, std::size_t components,
                       const std::string& what) {
  if (index < 0 || static_cast<std::size_t>(index) >= source.model.accessors.size())
    throw broken_accessor(source, what, fmt::format("accessor {} does not exist", index));
  const tinygltf::Accessor& accessor = source.model.accessors[index];
  if (accessor.sparse.isSparse)
    throw broken_accessor(source, what, "sparse accessors are not supported");
  const int stored = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  const int bytes =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  if (stored != static_cast<int>(components) || bytes < 1)
    throw broken_accessor(source, what, "its accessor has another type than it must have");
  const GltfBytes view = read_view(source, accessor.bufferView, what);
  const std::size_t element = components * static_cast<std::size_t>(bytes);
  const std::size_t declared = source.model.bufferViews[accessor.bufferView].byteStride;
  const std::size_t stride = declared ? declared : element;
  if (accessor.count > 0 &&
      (accessor.byteOffset > view.size || stride < element ||
       view.size - accessor.byteOffset < element ||
       (view.size - accessor.byteOffset - element) / stride < accessor.count - 1)) {
    throw broken_accessor(
        source, what, "its accessor reaches beyond its buffer (the file is cut short or damaged)");
  }
  return {view.data + accessor.byteOffset, accessor.count, stride, accessor.componentType,
          accessor.normalized};
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
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
      return static_cast<float>(load<double>(p + 8 * k));
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
  if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset) {
    throw broken_accessor(
        source, what,
        fmt::format("buffer view {} reaches beyond its buffer (the file is cut short or damaged)",
                    index));
  }
  return {bytes.data() + view.byteOffset, view.byteLength};
}

std::vector<float> read_floats(const GltfSource& source, int index, std::size_t components,
                               const std::string& what) {
  const Elements elements = open_accessor(source, index, components, what);
  std::vector<float> values(elements.count * components);
  for (std::size_t i = 0; i < elements.count; ++i) {
    for (std::size_t k = 0; k < components; ++k) {
      values[i * components + k] = component(elements.data + i * elements.stride,
                                             elements.component_type, k, elements.normalised);
    }
  }
  return values;
}

std::vector<std::uint32_t> read_indices(const GltfSource& source, int index,
                                        const std::string& what) {
  const Elements elements = open_accessor(source, index, 1, what);
  std::vector<std::uint32_t> values(elements.count);
  for (std::size_t i = 0; i < elements.count; ++i) {
    const unsigned char* p = elements.data + i * elements.stride;
    switch (elements.component_type) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        values[i] = *p;
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        values[i] = load<std::uint16_t>(p);
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        values[i] = load<std::uint32_t>(p);
        break;
      default:
        throw broken_accessor(source, what, "indices must be unsigned integers");
    }
  }
  return values;
}

}  // namespace polyhull
