// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gltf/instances.h"

#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace polyhull {
namespace {

constexpr std::size_t most_instances = 100'000;  // each becomes a mesh of its own

/// \p q as glTF has it: x, y, z, w.
Mat4 transform(const Vec3& translation, const Vec4& q, const Vec3& scale) {
  Mat4 result(1.0);
  result[3] = Vec4(translation, 1.0);
  const glm::dquat rotation(q.w, q.x, q.y, q.z);
  // NaN is no length 0: it is to be found below.
  if (glm::length(rotation) != 0.0) result *= glm::mat4_cast(glm::normalize(rotation));
  for (int k = 0; k < 3; ++k) result[k] *= scale[k];
  return result;
}

void check_finite(const GltfSource& source, const Mat4& transform, const std::string& node) {
  for (int i = 0; i < 16; ++i) {
    if (!std::isfinite(transform[i / 4][i % 4])) {
      throw broken_scene(source.path,
                         fmt::format("has a node '{}' with a transform that is not finite.", node));
    }
  }
}

}  // namespace

Mat4 local_transform(const GltfSource& source, const tinygltf::Node& node) {
  Mat4 local(1.0);
  if (node.matrix.size() == 16) {
    for (int i = 0; i < 16; ++i) local[i / 4][i % 4] = node.matrix[i];
  } else {
    const std::vector<double>&t = node.translation, &r = node.rotation, &s = node.scale;
    local = transform(t.size() == 3 ? Vec3(t[0], t[1], t[2]) : Vec3(0.0),
                      r.size() == 4 ? Vec4(r[0], r[1], r[2], r[3]) : Vec4(0.0),
                      s.size() == 3 ? Vec3(s[0], s[1], s[2]) : Vec3(1.0));
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
    transforms.push_back(
        transform(t.empty() ? Vec3(0.0) : Vec3(t[3 * i], t[3 * i + 1], t[3 * i + 2]),
                  r.empty() ? Vec4(0.0) : Vec4(r[4 * i], r[4 * i + 1], r[4 * i + 2], r[4 * i + 3]),
                  s.empty() ? Vec3(1.0) : Vec3(s[3 * i], s[3 * i + 1], s[3 * i + 2])));
    check_finite(source, transforms.back(), node.name);
  }
  return transforms;
}

}  // namespace polyhull
