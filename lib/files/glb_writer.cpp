// SPDX-License-Identifier: LGPL-2.1-or-later
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <sstream>

#include "base/error.h"
#include "files/mesh_files_internal.h"
#include "files/textured_parts.h"
#include "mesh/world.h"
#include "scene/gltf_builder.h"

namespace polyhull {
namespace {

constexpr char unlit[] = "KHR_materials_unlit";

class GlbWriter : GltfBuilder {
 public:
  GlbWriter(const Mesh& mesh, const MeshFileOptions& options) : mesh_(mesh), options_(options) {
    using Value = tinygltf::Value;
    Value::Object extras;
    extras["polyhullUp"] =
        Value(Value::Array{Value(mesh.up.x), Value(mesh.up.y), Value(mesh.up.z)});
    extras["polyhullMetresPerUnit"] = Value(mesh.metres_per_unit);
    model.asset.extras = Value(extras);
  }

  std::string write() {
    tinygltf::Mesh gltf_mesh;
    gltf_mesh.name = "hull";
    if (mesh_.texturing && options_.textured) {
      for (const TexturedPart& part : textured_parts(mesh_))
        gltf_mesh.primitives.push_back(textured_primitive(part));
    } else if (!mesh_.hull.empty()) {
      gltf_mesh.primitives.push_back(
          primitive(mesh_.hull.vertices, mesh_.hull.triangles, plain_material()));
    }
    // A glTF mesh must have a primitive: an empty hull is a node without a mesh.
    tinygltf::Node node;
    node.name = "polyhull";
    const Vec3& origin = mesh_.hull.origin;
    if (origin != Vec3(0.0)) node.translation = {origin.x, origin.y, origin.z};
    if (!gltf_mesh.primitives.empty()) {
      model.meshes.push_back(std::move(gltf_mesh));
      node.mesh = 0;
    }
    model.nodes.push_back(std::move(node));
    model.scenes[0].nodes = {add_root()};
    if (model.buffers[0].data.empty()) model.buffers.clear();
    std::ostringstream out;
    tinygltf::TinyGLTF gltf;
    if (!gltf.WriteGltfSceneToStream(&model, out, false, true))
      throw Error(Error::Kind::io,
                  "A hull of {} triangles could not be put into GLB form: too little memory?",
                  mesh_.hull.triangles.size() / 3);
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
    model.nodes.push_back(std::move(root));
    return 1;
  }

  tinygltf::Primitive primitive(const std::vector<Vec3f>& positions,
                                const std::vector<std::uint32_t>& triangles, int material) {
    tinygltf::Primitive result;
    result.mode = TINYGLTF_MODE_TRIANGLES;
    result.material = material;
    result.attributes["POSITION"] = add_positions(positions);
    result.indices = add_accessor(triangles);
    return result;
  }

  tinygltf::Primitive textured_primitive(const TexturedPart& part) {
    if (part.view < 0) return primitive(part.positions, part.triangles, plain_material());
    tinygltf::Primitive result =
        primitive(part.positions, part.triangles, picture_material(part.view));
    result.attributes["TEXCOORD_0"] = add_accessor(part.coordinates);
    return result;
  }

  int plain_material() {
    const Vec3f colour = mesh_.texturing ? mesh_.texturing->untextured : Vec3f(0.5f);
    tinygltf::Material material;
    material.name = mesh_.texturing ? "unseen" : "hull";
    const auto linear = [](float c) {
      return c <= 0.04045f ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    material.pbrMetallicRoughness.baseColorFactor = {linear(colour.x), linear(colour.y),
                                                     linear(colour.z), 1.0};
    return finish(std::move(material));
  }

  int picture_material(int number) {
    const View& view = mesh_.views[number].view;
    const Picture picture = texture_picture(mesh_, number);
    const std::vector<std::uint8_t> encoded = options_.jpeg_quality > 0
                                                  ? encode_jpeg(picture, options_.jpeg_quality)
                                                  : encode_png(picture);
    const int texture =
        add_texture(encoded, options_.jpeg_quality > 0 ? "image/jpeg" : "image/png");
    model.images.back().name = view.camera;
    model.textures.back().sampler = 0;
    if (model.samplers.empty()) {
      tinygltf::Sampler sampler;
      sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
      sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
      sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
      model.samplers.push_back(sampler);
    }
    tinygltf::Material material;
    material.name = view.camera;
    material.pbrMetallicRoughness.baseColorTexture.index = texture;
    // The pictures already hold the light of the stage.
    material.extensions[unlit] = tinygltf::Value(tinygltf::Value::Object{});
    use(unlit);
    return finish(std::move(material));
  }

  int finish(tinygltf::Material material) {
    material.pbrMetallicRoughness.metallicFactor = 0.0;
    material.pbrMetallicRoughness.roughnessFactor = 1.0;
    return add(model.materials, std::move(material));
  }

  const Mesh& mesh_;
  const MeshFileOptions& options_;
};

}  // namespace

void write_glb(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  write_whole_file(path, GlbWriter(mesh, options).write());
}

}  // namespace polyhull
