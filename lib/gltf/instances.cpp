// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gltf/instances.h"

#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace polyhull {
namespace {

constexpr std::size_t most_instances = 100'000;  // each becomes a mesh of its own

void check_finite(const GltfSource& source, const Mat4& transform, const std::string& node) {
  for (int i = 0; i < 16; ++i) {
    if (!std::isfinite(transform[i / 4][i % 4])) {
      throw broken_scene(source.path,
                         fmt::format("has a node '{}' with a transform that is not finite.", node));
    }
  }
}

}  // namespace

Mat4 NodeTransform::matrix() const {
  Mat4 result(1.0);
  result[3] = Vec4(translation, 1.0);
  const glm::dquat turn(rotation.w, rotation.x, rotation.y, rotation.z);
  // NaN is no length 0: whoever reads it is to find it.
  if (glm::length(turn) != 0.0) result *= glm::mat4_cast(glm::normalize(turn));
  for (int k = 0; k < 3; ++k) result[k] *= scale[k];
  return result;
}

NodeTransform transform_parts(const tinygltf::Node& node) {
  const std::vector<double>&t = node.translation, &r = node.rotation, &s = node.scale;
  NodeTransform parts;
  if (t.size() == 3) parts.translation = {t[0], t[1], t[2]};
  if (r.size() == 4) parts.rotation = {r[0], r[1], r[2], r[3]};
  if (s.size() == 3) parts.scale = {s[0], s[1], s[2]};
  return parts;
}

Mat4 local_transform(const GltfSource& source, const tinygltf::Node& node) {
  Mat4 local(1.0);
  if (node.matrix.size() == 16) {
    for (int i = 0; i < 16; ++i) local[i / 4][i % 4] = node.matrix[i];
  } else {
    local = transform_parts(node).matrix();
  }
  check_finite(source, local, node.name);
  return local;
}

std::vector<Mat4> instance_transforms(const GltfSource& source, const tinygltf::Node& node) {
  const auto extension = node.extensions.find("EXT_mesh_gpu_instancing");
  if (extension == node.extensions.end() || !extension->second.Has("attributes"))
    return {Mat4(1.0)};
  const tinygltf::Value& attributes = extension->second.Get("attributes");
  std::size_t count = 0;
  const auto read = [&](const char* name, std::size_t components) {
    std::vector<float> values;
    if (!attributes.Has(name)) return values;
    const tinygltf::Value& accessor = attributes.Get(name);
    values = read_floats(source, accessor.IsInt() ? accessor.GetNumberAsInt() : -1, components,
                         fmt::format("instances ({}) of node '{}'", name, node.name));
    const std::size_t found = values.size() / components;
    if (found == 0 || (count > 0 && found != count)) {
      throw broken_scene(source.path,
                         fmt::format("has a node '{}' whose instances' attributes are empty or "
                                     "differ in length.",
                                     node.name));
    }
    count = found;
    return values;
  };
  const std::vector<float> t = read("TRANSLATION", 3), r = read("ROTATION", 4),
                           s = read("SCALE", 3);
  if (count == 0) return {Mat4(1.0)};
  if (count > most_instances) {
    throw Error(
        Error::Kind::unsupported,
        "Scene '{}': the node '{}' has {} instances; at most {} are drawn. Export fewer, or "
        "join them to one mesh.",
        source.path, node.name, count, most_instances);
  }
  std::vector<Mat4> transforms;
  for (std::size_t i = 0; i < count; ++i) {
    NodeTransform parts;
    if (!t.empty()) parts.translation = {t[3 * i], t[3 * i + 1], t[3 * i + 2]};
    if (!r.empty()) parts.rotation = {r[4 * i], r[4 * i + 1], r[4 * i + 2], r[4 * i + 3]};
    if (!s.empty()) parts.scale = {s[3 * i], s[3 * i + 1], s[3 * i + 2]};
    transforms.push_back(parts.matrix());
    check_finite(source, transforms.back(), node.name);
  }
  return transforms;
}

}  // namespace polyhull
