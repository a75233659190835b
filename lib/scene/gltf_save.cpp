// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "gltf/builder.h"
#include "scene/scene.h"

namespace polyhull {
namespace {

using tinygltf::Value;

class Writer : GltfBuilder {
 public:
  explicit Writer(const Scene& scene) : scene_(scene) {
    // Without lights what was not set says nothing, and would be kept where light is assumed.
    if (!scene.exposure_given && scene.lights.empty() && scene.exposure == 1.0f) return;
    Value::Object extras;
    extras["exposure"] = Value(static_cast<double>(scene.exposure));
    model.scenes[0].extras = Value(extras);
  }

  tinygltf::Model write() {
    for (const SharedPicture& picture : scene_.textures)
      add_texture(encode_png(*picture), "image/png");
    for (const Material& material : scene_.materials) add_material(material);
    for (const SceneMesh& mesh : scene_.meshes) add_mesh(mesh);
    for (const Light& light : scene_.lights)
      if (light.mesh < 0) add_light(light);
    for (const Camera& camera : scene_.cameras) add_camera(camera);
    return std::move(model);
  }

 private:
  int add_node(tinygltf::Node node) {
    const int index = add(model.nodes, std::move(node));
    model.scenes[0].nodes.push_back(index);
    return index;
  }

  void add_material(const Material& in) {
    tinygltf::Material out;
    out.name = in.name;
    out.doubleSided = in.double_sided;
    auto& pbr = out.pbrMetallicRoughness;
    pbr.baseColorFactor = {in.base_colour.x, in.base_colour.y, in.base_colour.z, 1.0};
    pbr.metallicFactor = in.metallic;
    pbr.roughnessFactor = in.roughness;
    pbr.baseColorTexture.index = in.base_colour_texture;
    if (in.ior != 1.5f) {
      use("KHR_materials_ior");
      out.extensions["KHR_materials_ior"] =
          Value(Value::Object{{"ior", Value(static_cast<double>(in.ior))}});
    }
    const float strength = std::max({in.emission.x, in.emission.y, in.emission.z, 1.0f});
    out.emissiveFactor = {in.emission.x / strength, in.emission.y / strength,
                          in.emission.z / strength};
    if (strength > 1.0f) {
      use("KHR_materials_emissive_strength");
      out.extensions["KHR_materials_emissive_strength"] =
          Value(Value::Object{{"emissiveStrength", Value(static_cast<double>(strength))}});
    }
    model.materials.push_back(std::move(out));
  }

  void add_mesh(const SceneMesh& in) {
    if (in.triangles.empty()) return;
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = in.material;
    primitive.attributes["POSITION"] = add_positions(in.positions);
    primitive.attributes["NORMAL"] = add_accessor(in.normals);
    if (!in.texture_coordinates.empty())
      primitive.attributes["TEXCOORD_0"] = add_accessor(in.texture_coordinates);
    primitive.indices = add_accessor(in.triangles);
    tinygltf::Mesh mesh;
    mesh.name = in.name;
    mesh.primitives.push_back(std::move(primitive));
    tinygltf::Node node;
    node.name = in.name;
    node.mesh = add(model.meshes, std::move(mesh));
    add_node(std::move(node));
  }

  /// A light that no mesh shows: a point, an area as a point with its size in the extras, or a spot.
  void add_light(const Light& in) {
    use("KHR_lights_punctual");
    tinygltf::Light out;
    out.name = in.name;
    out.type = in.is_spot() ? "spot" : "point";
    out.spot.innerConeAngle = in.inner_cone;
    out.spot.outerConeAngle = in.outer_cone;
    tinygltf::Node node;
    node.name = in.name;
    Vec3f power = in.radiance;
    Vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    if (in.is_area()) {
      const double width = 2.0 * glm::length(in.v), height = 2.0 * glm::length(in.u);
      y = glm::normalize(Vec3(in.u));
      z = -glm::normalize(glm::cross(Vec3(in.u), Vec3(in.v)));
      x = glm::cross(y, z);
      power *= static_cast<float>(width * height);
      out.extras = Value(Value::Object{{"size", Value(Value::Array{Value(width), Value(height)})}});
    }
    node.matrix = {x.x, x.y, x.z, 0, y.x,         y.y,         y.z,         0,
                   z.x, z.y, z.z, 0, in.centre.x, in.centre.y, in.centre.z, 1};
    const float intensity = std::max({power.x, power.y, power.z});
    out.intensity = intensity;
    if (intensity > 0.0f) power /= intensity;
    out.color = {power.x, power.y, power.z};
    node.extensions["KHR_lights_punctual"] =
        Value(Value::Object{{"light", Value(add(model.lights, std::move(out)))}});
    add_node(std::move(node));
  }

  void add_camera(const Camera& in) {
    tinygltf::Camera out;
    out.name = in.name;
    out.type = "perspective";
    out.perspective.yfov = 2.0 * std::atan(0.5 * in.height / in.K[1][1]);
    out.perspective.aspectRatio = static_cast<double>(in.width) / in.height;
    out.perspective.znear = 0.01;
    tinygltf::Node node;
    node.name = in.name;
    node.camera = add(model.cameras, std::move(out));
    const Mat3 axes = glm::transpose(in.R);
    const Vec3 x = axes[0], y = -axes[1], z = -axes[2], c = -(axes * in.t);
    node.matrix = {x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, c.x, c.y, c.z, 1};
    add_node(std::move(node));
  }

  const Scene& scene_;
};

}  // namespace

void save_scene(const Scene& scene, const std::string& path) {
  tinygltf::Model model = Writer(scene).write();
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToFile(&model, path, true, true, false, true))
    throw Error(Error::Kind::io,
                "Scene '{}' could not be written; check that the folder exists, may be written and "
                "has space.",
                path);
}

}  // namespace polyhull
