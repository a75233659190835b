// SPDX-License-Identifier: LGPL-2.1-or-later
#include <cmath>
#include <cstring>
#include <glm/gtc/quaternion.hpp>
#include <sstream>

#include "base/error.h"
#include "files/mesh_files_internal.h"
#include "files/textured_parts.h"
#include "mesh/world.h"

// tinygltf's picture decoding is not needed: encoded pictures are embedded as they are.
#include <tiny_gltf.h>

namespace polyhull {
namespace {

constexpr char unlit[] = "KHR_materials_unlit";

class GlbWriter {
 public:
  GlbWriter(const Mesh& mesh, const MeshFileOptions& options) : mesh_(mesh), options_(options) {
    model_.asset.version = "2.0";
    model_.asset.generator = "polyhull";
    using Value = tinygltf::Value;
    Value::Object extras;
    extras["polyhullUp"] =
        Value(Value::Array{Value(mesh.up.x), Value(mesh.up.y), Value(mesh.up.z)});
    extras["polyhullMetresPerUnit"] = Value(mesh.metres_per_unit);
    model_.asset.extras = Value(extras);
    model_.buffers.emplace_back();
    model_.scenes.emplace_back();
    model_.defaultScene = 0;
  }

  std::string write() {
    tinygltf::Mesh gltf_mesh;
    gltf_mesh.name = "hull";
    if (mesh_.texturing && options_.textured) {
      for (const TexturedPart& part : textured_parts(mesh_))
        gltf_mesh.primitives.push_back(textured_primitive(part));
    } else if (!mesh_.hull.empty()) {
      gltf_mesh.primitives.push_back(
          primitive(mesh_.hull.vertices, mesh_.hull.triangles, grey_material()));
    }
    // A glTF mesh must have a primitive: an empty hull is a node without a mesh.
    tinygltf::Node node;
    node.name = "polyhull";
    const Vec3& origin = mesh_.hull.origin;
    if (origin != Vec3(0.0)) node.translation = {origin.x, origin.y, origin.z};
    if (!gltf_mesh.primitives.empty()) {
      model_.meshes.push_back(std::move(gltf_mesh));
      node.mesh = 0;
    }
    model_.nodes.push_back(std::move(node));
    model_.scenes[0].nodes = {add_root()};
    if (model_.buffers[0].data.empty()) model_.buffers.clear();
    std::ostringstream out;
    tinygltf::TinyGLTF gltf;
    if (!gltf.WriteGltfSceneToStream(&model_, out, false, true))
      throw Error(Error::Kind::io, "the mesh could not be put into GLB form");
    return out.str();
  }

 private:
  /// The node that takes the rig's world to glTF's, which is metres with y up; where the rig's is
  /// the same, the hull's own node.
  int add_root() {
    const Mat4 turn = scene_from_world(mesh_.up, 1.0);
    const double scale = mesh_.metres_per_unit;
    if (turn == Mat4(1.0) && scale == 1.0) return 0;
    tinygltf::Node root;
    root.name = "rig";
    const glm::dquat q = glm::normalize(glm::quat_cast(Mat3(turn)));
    if (turn != Mat4(1.0)) root.rotation = {q.x, q.y, q.z, q.w};
    if (scale != 1.0) root.scale = {scale, scale, scale};
    root.children = {0};
    model_.nodes.push_back(std::move(root));
    return 1;
  }

  int add_view(const void* data, std::size_t size, int target) {
    std::vector<unsigned char>& bytes = model_.buffers[0].data;
    bytes.resize((bytes.size() + 3) / 4 * 4);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = bytes.size();
    view.byteLength = size;
    view.target = target;
    const auto* begin = static_cast<const unsigned char*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
    model_.bufferViews.push_back(view);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  int add_accessor(int view, std::size_t count, int component, int type) {
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.count = count;
    accessor.componentType = component;
    accessor.type = type;
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  tinygltf::Primitive primitive(const std::vector<Vec3f>& positions,
                                const std::vector<std::uint32_t>& triangles, int material) {
    tinygltf::Primitive result;
    result.mode = TINYGLTF_MODE_TRIANGLES;
    result.material = material;
    const int position = add_accessor(
        add_view(positions.data(), positions.size() * sizeof(Vec3f), TINYGLTF_TARGET_ARRAY_BUFFER),
        positions.size(), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
    Vec3f low(INFINITY), high(-INFINITY);
    for (const Vec3f& p : positions) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    model_.accessors[position].minValues = {low.x, low.y, low.z};
    model_.accessors[position].maxValues = {high.x, high.y, high.z};
    result.attributes["POSITION"] = position;
    result.indices =
        add_accessor(add_view(triangles.data(), triangles.size() * sizeof(std::uint32_t),
                              TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
                     triangles.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR);
    return result;
  }

  tinygltf::Primitive textured_primitive(const TexturedPart& part) {
    if (part.view < 0) return primitive(part.positions, part.triangles, grey_material());
    tinygltf::Primitive result =
        primitive(part.positions, part.triangles, picture_material(mesh_.views[part.view].view));
    result.attributes["TEXCOORD_0"] =
        add_accessor(add_view(part.coordinates.data(), part.coordinates.size() * sizeof(Vec2f),
                              TINYGLTF_TARGET_ARRAY_BUFFER),
                     part.coordinates.size(), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC2);
    return result;
  }

  int grey_material() {
    const Vec3f grey = mesh_.texturing ? mesh_.texturing->untextured : Vec3f(0.5f);
    tinygltf::Material material;
    material.name = mesh_.texturing ? "unseen" : "hull";
    const auto linear = [](float c) {
      return c <= 0.04045f ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    material.pbrMetallicRoughness.baseColorFactor = {linear(grey.x), linear(grey.y), linear(grey.z),
                                                     1.0};
    return finish(std::move(material));
  }

  int picture_material(const View& view) {
    const Picture picture = texture_picture(view);
    const std::vector<std::uint8_t> encoded = options_.jpeg_quality > 0
                                                  ? encode_jpeg(picture, options_.jpeg_quality)
                                                  : encode_png(picture);
    tinygltf::Image image;
    image.name = view.camera;
    image.mimeType = options_.jpeg_quality > 0 ? "image/jpeg" : "image/png";
    image.bufferView = add_view(encoded.data(), encoded.size(), 0);
    model_.images.push_back(std::move(image));
    if (model_.samplers.empty()) {
      tinygltf::Sampler sampler;
      sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
      sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
      sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
      model_.samplers.push_back(sampler);
    }
    tinygltf::Texture texture;
    texture.sampler = 0;
    texture.source = static_cast<int>(model_.images.size()) - 1;
    model_.textures.push_back(texture);
    tinygltf::Material material;
    material.name = view.camera;
    material.pbrMetallicRoughness.baseColorTexture.index =
        static_cast<int>(model_.textures.size()) - 1;
    // The pictures already hold the light of the stage.
    material.extensions[unlit] = tinygltf::Value(tinygltf::Value::Object{});
    if (model_.extensionsUsed.empty()) model_.extensionsUsed.push_back(unlit);
    return finish(std::move(material));
  }

  int finish(tinygltf::Material material) {
    material.pbrMetallicRoughness.metallicFactor = 0.0;
    material.pbrMetallicRoughness.roughnessFactor = 1.0;
    model_.materials.push_back(std::move(material));
    return static_cast<int>(model_.materials.size()) - 1;
  }

  const Mesh& mesh_;
  const MeshFileOptions& options_;
  tinygltf::Model model_;
};

}  // namespace

void write_glb(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  write_whole_file(path, GlbWriter(mesh, options).write());
}

}  // namespace polyhull
