// SPDX-License-Identifier: LGPL-2.1-or-later
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <sstream>

#include "base/error.h"
#include "files/glb_animation.h"
#include "files/mesh_files_internal.h"
#include "files/textured_parts.h"
#include "gltf/builder.h"
#include "mesh/world.h"

namespace polyhull {
namespace {

constexpr char unlit[] = "KHR_materials_unlit";

class GlbWriter : GltfBuilder {
 public:
  explicit GlbWriter(const MeshFileOptions& options) : options_(options) {}

  std::size_t size() const { return model.buffers[0].data.size(); }
  bool empty() const { return hulls_.empty(); }

  /// Adds the node of a hull; all have the world of the first.
  void add_hull(const Mesh& mesh) {
    if (hulls_.empty()) {
      up_ = mesh.up;
      metres_per_unit_ = mesh.metres_per_unit;
    }
    tinygltf::Mesh gltf_mesh;
    gltf_mesh.name = "hull";
    if (mesh.texturing && options_.textured) {
      for (const TexturedPart& part : textured_parts(mesh))
        gltf_mesh.primitives.push_back(textured_primitive(mesh, part));
    } else if (!mesh.hull.empty()) {
      gltf_mesh.primitives.push_back(primitive(mesh.hull.vertices, mesh.hull.normals,
                                               mesh.hull.triangles, plain_material(mesh)));
    }
    // A glTF mesh must have a primitive: an empty hull is a node without a mesh.
    tinygltf::Node node;
    node.name = "polyhull";
    const Vec3& origin = mesh.hull.origin;
    if (origin != Vec3(0.0)) node.translation = {origin.x, origin.y, origin.z};
    if (!gltf_mesh.primitives.empty()) {
      node.mesh = add(model.meshes, std::move(gltf_mesh));
    }
    hulls_.push_back(add(model.nodes, std::move(node)));
  }

  /// Shows each hull from its time of \p seconds, which rise, until the next.
  void animate(const std::vector<float>& seconds) {
    tinygltf::Animation animation;
    animation.name = "take";
    for (std::size_t i = 0; i < hulls_.size() && hulls_.size() > 1; ++i) {
      std::vector<float> times;
      std::vector<Vec3f> sizes;
      const auto show = [&](float time, float size) {
        times.push_back(time);
        sizes.emplace_back(size);
      };
      if (i > 0) show(seconds.front(), 0);
      show(seconds[i], 1);
      if (i + 1 < hulls_.size()) show(seconds[i + 1], 0);
      // What plays no animation shows the first.
      if (i > 0) model.nodes[hulls_[i]].scale = {0, 0, 0};
      tinygltf::AnimationSampler sampler;
      sampler.input = add_accessor(times);
      model.accessors[sampler.input].minValues = {times.front()};
      model.accessors[sampler.input].maxValues = {times.back()};
      sampler.output = add_accessor(sizes, 0);
      sampler.interpolation = "STEP";
      tinygltf::AnimationChannel channel;
      channel.sampler = add(animation.samplers, std::move(sampler));
      channel.target_node = hulls_[i];
      channel.target_path = "scale";
      animation.channels.push_back(std::move(channel));
    }
    if (!animation.channels.empty()) model.animations.push_back(std::move(animation));
  }

  std::string write() {
    using Value = tinygltf::Value;
    Value::Object extras;
    extras["polyhullUp"] = Value(Value::Array{Value(up_.x), Value(up_.y), Value(up_.z)});
    extras["polyhullMetresPerUnit"] = Value(metres_per_unit_);
    model.asset.extras = Value(extras);
    model.scenes[0].nodes = roots();
    if (model.buffers[0].data.empty()) model.buffers.clear();
    std::ostringstream out;
    tinygltf::TinyGLTF gltf;
    if (!gltf.WriteGltfSceneToStream(&model, out, false, true))
      throw Error(Error::Kind::io,
                  "A hull of {} bytes could not be put into GLB form: too little memory?", size());
    return out.str();
  }

 private:
  /// The node that takes the rig's world to glTF's, which is metres with y up; where the rig's is
  /// the same, the hulls' own nodes.
  std::vector<int> roots() {
    const Mat4 turn = scene_from_world(up_, 1.0);
    const double scale = metres_per_unit_;
    if (turn == Mat4(1.0) && scale == 1.0) return hulls_;
    tinygltf::Node root;
    root.name = "rig";
    const glm::dquat q = glm::normalize(glm::quat_cast(Mat3(turn)));
    if (turn != Mat4(1.0)) root.rotation = {q.x, q.y, q.z, q.w};
    if (scale != 1.0) root.scale = {scale, scale, scale};
    root.children = hulls_;
    return {add(model.nodes, std::move(root))};
  }

  tinygltf::Primitive primitive(const std::vector<Vec3f>& positions,
                                const std::vector<Vec3f>& normals,
                                const std::vector<std::uint32_t>& triangles, int material) {
    tinygltf::Primitive result;
    result.mode = TINYGLTF_MODE_TRIANGLES;
    result.material = material;
    result.attributes["POSITION"] = add_positions(positions);
    // A polyhedron has none: readers then draw its faces flat.
    if (!normals.empty()) result.attributes["NORMAL"] = add_accessor(normals);
    result.indices = add_accessor(triangles);
    return result;
  }

  tinygltf::Primitive textured_primitive(const Mesh& mesh, const TexturedPart& part) {
    const int material = part.view < 0 ? plain_material(mesh) : picture_material(mesh, part.view);
    tinygltf::Primitive result = primitive(part.positions, part.normals, part.triangles, material);
    if (part.view < 0) return result;
    result.attributes["TEXCOORD_0"] = add_accessor(part.coordinates);
    return result;
  }

  int plain_material(const Mesh& mesh) {
    const Vec3f colour = mesh.texturing ? mesh.texturing->untextured : Vec3f(0.5f);
    tinygltf::Material material;
    material.name = mesh.texturing ? "unseen" : "hull";
    const auto linear = [](float c) {
      return c <= 0.04045f ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    material.pbrMetallicRoughness.baseColorFactor = {linear(colour.x), linear(colour.y),
                                                     linear(colour.z), 1.0};
    return finish(std::move(material));
  }

  int picture_material(const Mesh& mesh, int number) {
    const View& view = mesh.views[number].view;
    const Picture picture = texture_picture(mesh, number);
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

  MeshFileOptions options_;
  std::vector<int> hulls_;  // their nodes
  Vec3 up_{0, 1, 0};
  double metres_per_unit_ = 1.0;
};

}  // namespace

void write_glb(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  GlbWriter writer(options);
  writer.add_hull(mesh);
  write_whole_file(path, writer.write());
}

struct GlbAnimation::State {
  explicit State(const MeshFileOptions& options) : writer(options) {}
  GlbWriter writer;
  std::vector<float> seconds;
};

GlbAnimation::GlbAnimation(const MeshFileOptions& options)
    : state_(std::make_unique<State>(options)) {}
GlbAnimation::~GlbAnimation() = default;

void GlbAnimation::add(const Mesh& mesh, double seconds) {
  const auto time = static_cast<float>(seconds);
  if (!state_->seconds.empty() && !(time > state_->seconds.back()))
    throw Error(Error::Kind::bad_input,
                "The mesh at {} s cannot follow the one at {} s in an animation.", seconds,
                state_->seconds.back());
  state_->writer.add_hull(mesh);
  state_->seconds.push_back(time);
  // What a GLB's lengths can say, with room for its JSON.
  if (state_->writer.size() > std::size_t{3'900} << 20)
    throw Error(Error::Kind::unsupported,
                "{} meshes are more than one GLB file holds (4 GiB); write a part of them, every "
                "second one, or a file each.",
                state_->seconds.size());
}

void GlbAnimation::write(const std::string& path) {
  if (state_->writer.empty())
    throw Error(Error::Kind::bad_input, "'{}' was not written: there is no mesh.", path);
  state_->writer.animate(state_->seconds);
  write_whole_file(path, state_->writer.write());
}

}  // namespace polyhull
