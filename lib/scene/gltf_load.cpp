// SPDX-License-Identifier: LGPL-2.1-or-later
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>

#include "base/error.h"
#include "base/plain_text.h"
#include "gltf/accessor.h"
#include "gltf/file.h"
#include "gltf/instances.h"
#include "scene/animation/gltf_animations.h"
#include "scene/gltf_lights.h"
#include "scene/gltf_materials.h"
#include "scene/scene.h"

namespace polyhull {
namespace {

constexpr int deepest_node = 200;                   // a file whose nodes form a ring must end
constexpr float largest_texture_coordinate = 1e6f;  // floats beyond have no fraction to speak of
// Of all meshes, vertices and triangles: some 3 GB with what traces them.
constexpr std::size_t most_charged = 50'000'000;
constexpr std::size_t charged_for_a_mesh = 64;  // what it takes itself, in vertices
constexpr std::size_t characters_charged = 16;  // of its name, as one vertex
constexpr int camera_width = 1280, camera_height = 720;

class Loader {
 public:
  Loader(const tinygltf::Model& model, const std::string& path)
      : model_(model), path_(path), source_{model_, path_} {
    // Others open the scene by its name, perhaps from another folder.
    scene_.name = std::filesystem::absolute(path).lexically_normal().string();
  }

  Scene load() {
    add_materials(source_, scene_, left_out_);
    default_material_ = static_cast<int>(scene_.materials.size());
    scene_.materials.push_back({});
    scene_.materials.back().name = "default";
    add_nodes();
    const auto no_triangles = [](const SceneMesh& mesh) { return mesh.triangles.empty(); };
    if (std::all_of(scene_.meshes.begin(), scene_.meshes.end(), no_triangles))
      throw broken_scene(path_, "has no geometry: there is not one triangle in its nodes" +
                                    (left_out_.empty() ? "." : " but " + left_out() + "."));
    split_emitters(scene_);
    find_area_lights(scene_);
    add_distant_lights();
    scene_.mirrors = find_mirrors(scene_);
    set_exposure();
    if (!model_.animations.empty()) add_animations();
    scene_.left_out = left_out();
    return std::move(scene_);
  }

 private:
  std::string left_out() const {
    std::string list;
    for (const std::string& what : left_out_) list += (list.empty() ? "" : ", ") + what;
    return list;
  }

  /// The default scene; where none is named, the first that has nodes, or the first.
  std::size_t wanted_scene() const {
    if (model_.defaultScene >= 0) return static_cast<std::size_t>(model_.defaultScene);
    const auto found =
        std::find_if(model_.scenes.begin(), model_.scenes.end(),
                     [](const tinygltf::Scene& scene) { return !scene.nodes.empty(); });
    return found == model_.scenes.end() ? 0
                                        : static_cast<std::size_t>(found - model_.scenes.begin());
  }

  void add_nodes() {
    if (model_.scenes.empty()) {
      for (std::size_t i = 0; i < model_.nodes.size(); ++i) roots_.push_back(static_cast<int>(i));
      for (const tinygltf::Node& node : model_.nodes)
        for (const int child : node.children) std::erase(roots_, child);
    } else {
      if (wanted_scene() >= model_.scenes.size())
        throw broken_scene(path_, "names a default scene that does not exist.");
      roots_ = model_.scenes[wanted_scene()].nodes;
    }
    for (const tinygltf::Animation& animation : model_.animations)
      for (const tinygltf::AnimationChannel& channel : animation.channels)
        animated_nodes_.insert(channel.target_node);
    for (const int root : roots_) add_node(root, Mat4(1.0), -1, 0);
  }

  void add_node(int index, const Mat4& parent_to_world, int parent, int depth) {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.nodes.size()) {
      throw broken_scene(path_, fmt::format("refers to node {}, which does not exist.", index));
    }
    if (depth > deepest_node || ++nodes_visited_ > 4 * model_.nodes.size())
      throw broken_scene(path_, "has nodes that contain one another.");
    const tinygltf::Node& node = model_.nodes[index];
    if (is_invisible(node)) return;
    const Mat4 to_world = parent_to_world * local_transform(source_, node);
    const int number = static_cast<int>(scene_.nodes.size());
    scene_.nodes.push_back({name_of(node), parent, to_world});
    note_place(index, number);
    if (node.mesh >= 0) add_mesh(node, to_world);
    if (node.camera >= 0) add_camera(node, to_world);
    if (const auto light = node.extensions.find("KHR_lights_punctual");
        light != node.extensions.end() && light->second.Has("light")) {
      const int which = light->second.Get("light").GetNumberAsInt();
      if (which < 0 || static_cast<std::size_t>(which) >= model_.lights.size()) {
        throw broken_scene(
            path_, fmt::format("has a node '{}' with a light that does not exist.", node.name));
      }
      add_light(model_.lights[which], node, to_world);
    }
    for (const int child : node.children) add_node(child, to_world, number, depth + 1);
  }

  void add_animations() {
    std::vector<Animation> animations = read_animations(source_, animated_places_, left_out_);
    std::vector<bool> moves(scene_.nodes.size()), shows(scene_.nodes.size());
    for (const Animation& animation : animations)
      for (const NodeMotion& motion : animation.motions) moves[motion.node] = true;
    for (std::size_t n = 0; n < moves.size(); ++n)
      if (scene_.nodes[n].parent >= 0 && moves[scene_.nodes[n].parent]) moves[n] = true;
    if (std::any_of(camera_nodes_.begin(), camera_nodes_.end(), [&](int n) { return moves[n]; }))
      left_out_.insert("animations of cameras (they stay where the file has them)");
    // What moves nothing that is seen or lights would be another pose in each frame for nothing.
    for (const SceneMesh& mesh : scene_.meshes) shows[mesh.node] = true;
    for (const Light& light : scene_.lights) shows[light.node] = true;
    for (std::size_t n = shows.size(); n-- > 0;)
      if (shows[n] && scene_.nodes[n].parent >= 0) shows[scene_.nodes[n].parent] = true;
    for (Animation& animation : animations)
      std::erase_if(animation.motions,
                    [&](const NodeMotion& motion) { return !shows[motion.node]; });
    scene_.animations = std::make_shared<const std::vector<Animation>>(std::move(animations));
  }

  /// Where the animations find the node. What has been flattened cannot be brought back.
  void note_place(int index, int number) {
    const bool flat = glm::determinant(Mat3(scene_.nodes.back().to_world)) == 0.0;
    const bool fixed = flat || !model_.nodes[index].matrix.empty();
    if (!fixed) {
      animated_places_.emplace(index, number);
      return;
    }
    if (animated_nodes_.contains(index))
      left_out_.insert(flat ? "animations of nodes that the file scales to nothing"
                            : "animations of nodes that have a matrix");
  }

  /// Its own name, else its mesh's.
  std::string name_of(const tinygltf::Node& node) const {
    const bool has_mesh =
        node.mesh >= 0 && static_cast<std::size_t>(node.mesh) < model_.meshes.size();
    return node.name.empty() && has_mesh ? model_.meshes[node.mesh].name : node.name;
  }

  /// With all that hangs on it.
  static bool is_invisible(const tinygltf::Node& node) {
    const auto found = node.extensions.find("KHR_node_visibility");
    if (found == node.extensions.end() || !found->second.Has("visible")) return false;
    const tinygltf::Value& visible = found->second.Get("visible");
    return visible.IsBool() && !visible.Get<bool>();
  }

  void add_light(const tinygltf::Light& light, const tinygltf::Node& node, const Mat4& to_world) {
    if (light.type == "point" || light.type == "spot" || light.type == "directional")
      lights_.push_back(
          {&light, to_world, node.name, &node.extras, static_cast<int>(scene_.nodes.size()) - 1});
    else
      left_out_.insert("lights of other types than point, spot and directional");
  }

  void add_mesh(const tinygltf::Node& node, const Mat4& to_world) {
    if (static_cast<std::size_t>(node.mesh) >= model_.meshes.size())
      throw broken_scene(
          path_, fmt::format("has a node '{}' with a mesh that does not exist.", node.name));
    const tinygltf::Mesh& mesh = model_.meshes[node.mesh];
    const std::vector<Mat4> instances = instance_transforms(source_, node);
    const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
    if (std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0.0; }))
      left_out_.insert("morphs");
    if (node.skin >= 0) left_out_.insert("skins (their meshes stand as they were modelled)");
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      const std::string name = !node.name.empty() ? node.name : mesh.name;
      const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
      if (mode < TINYGLTF_MODE_TRIANGLES) {
        left_out_.insert("points and lines");
        continue;
      }
      if (!primitive.attributes.contains("POSITION")) {
        left_out_.insert("meshes without positions");
        continue;
      }
      if (primitive.attributes.contains("COLOR_0")) left_out_.insert("vertex colours");
      SceneMesh out = read_primitive(primitive, mode, name);
      out.material = primitive.material >= 0 ? primitive.material : default_material_;
      if (out.material > default_material_)
        throw broken_scene(
            path_, fmt::format("has a mesh '{}' with a material that does not exist.", name));
      apply_texture_transform(source_, primitive.material, out);
      if (out.texture_coordinates.empty() &&
          scene_.materials[out.material].base_colour_texture >= 0)
        left_out_.insert("textures (of meshes without their texture coordinates)");
      out.copies = instances.size();
      charge(out, instances.size() * (charged_for_a_mesh + name.size() / characters_charged +
                                      out.positions.size() + out.triangles.size() / 3));
      for (std::size_t i = 0; i < instances.size(); ++i) {
        SceneMesh instance = i + 1 < instances.size() ? out : std::move(out);
        move_mesh(to_world * instances[i], instance);
        check_finite(instance);
        instance.node = static_cast<int>(scene_.nodes.size()) - 1;
        scene_.meshes.push_back(std::move(instance));
      }
    }
  }

  /// Nodes and instances are meshes each, and a small file can ask for more than memory holds.
  void charge(const SceneMesh& mesh, std::size_t amount) {
    charged_ += amount;
    if (charged_ > most_charged) {
      throw Error(
          Error::Kind::unsupported,
          "Scene '{}' is too large: with the {} instances of mesh '{}' ({} triangles each) its "
          "meshes have more than {} vertices and triangles in all (a mesh or instance counts as {} "
          "more). Export fewer instances, or simpler meshes.",
          path_, mesh.copies, mesh.name, mesh.triangles.size() / 3, most_charged,
          charged_for_a_mesh);
    }
  }

  SceneMesh read_primitive(const tinygltf::Primitive& primitive, int mode,
                           const std::string& name) {
    SceneMesh out;
    out.name = name;
    const auto attribute = [&](const char* semantic) {
      const auto found = primitive.attributes.find(semantic);
      return found == primitive.attributes.end() ? -1 : found->second;
    };
    const std::string of = fmt::format(" of mesh '{}'", name);
    refuse_compressed(primitive, of);
    const std::vector<float> p = read_floats(source_, attribute("POSITION"), 3, "positions" + of);
    for (std::size_t i = 0; i < p.size(); i += 3)
      out.positions.emplace_back(p[i], p[i + 1], p[i + 2]);
    if (attribute("NORMAL") >= 0) {
      const std::vector<float> n = read_floats(source_, attribute("NORMAL"), 3, "normals" + of);
      for (std::size_t i = 0; i < n.size(); i += 3)
        out.normals.emplace_back(n[i], n[i + 1], n[i + 2]);
    }
    const std::string set = fmt::format("TEXCOORD_{}", texture_set(source_, primitive.material));
    if (attribute(set.c_str()) >= 0) {
      const std::vector<float> t =
          read_floats(source_, attribute(set.c_str()), 2, "texture coordinates" + of);
      for (std::size_t i = 0; i < t.size(); i += 2)
        out.texture_coordinates.emplace_back(t[i], t[i + 1]);
    }
    if ((!out.normals.empty() && out.normals.size() != out.positions.size()) ||
        (!out.texture_coordinates.empty() &&
         out.texture_coordinates.size() != out.positions.size()))
      throw broken_scene(path_,
                         fmt::format("has a mesh '{}' whose attributes differ in length.", name));
    std::vector<std::uint32_t> indices;
    if (primitive.indices >= 0)
      indices = read_indices(source_, primitive.indices, "indices" + of);
    else
      for (std::size_t i = 0; i < out.positions.size(); ++i)
        indices.push_back(static_cast<std::uint32_t>(i));
    for (const std::uint32_t index : indices) {
      if (index >= out.positions.size()) {
        throw broken_scene(
            path_, fmt::format("has a mesh '{}' with vertex index {} but only {} vertices.", name,
                               index, out.positions.size()));
      }
    }
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      indices.resize(indices.size() / 3 * 3);
      out.triangles = std::move(indices);
    } else {
      for (std::size_t i = 2; i < indices.size(); ++i) {
        const bool fan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
        const bool odd = !fan && i % 2 == 1;
        const std::uint32_t a = fan ? indices[0] : indices[i - 2], b = indices[i - 1];
        out.triangles.insert(out.triangles.end(), {odd ? b : a, odd ? a : b, indices[i]});
      }
    }
    if (out.normals.empty()) {
      if (out.positions.size() > out.triangles.size())  // more are read than stay
        charge(out, out.positions.size() - out.triangles.size());
      make_flat(out);
    }
    return out;
  }

  /// An accessor without data stands for zeros, but not where an extension has them in its own form.
  void refuse_compressed(const tinygltf::Primitive& primitive, const std::string& of) const {
    const auto without_data = [&](int accessor) {
      return accessor >= 0 && static_cast<std::size_t>(accessor) < model_.accessors.size() &&
             model_.accessors[accessor].bufferView < 0 &&
             !model_.accessors[accessor].sparse.isSparse;
    };
    if (!without_data(primitive.indices) &&
        std::none_of(primitive.attributes.begin(), primitive.attributes.end(),
                     [&](const auto& attribute) { return without_data(attribute.second); }))
      return;
    for (const auto& [extension, value] : primitive.extensions)
      if (value.Has("bufferView")) throw compressed(source_, "vertices" + of, extension);
  }

  /// glTF asks for flat normals where a file has none: each triangle gets vertices of its own.
  static void make_flat(SceneMesh& mesh) {
    SceneMesh flat;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const std::uint32_t index = mesh.triangles[i];
      flat.positions.push_back(mesh.positions[index]);
      if (!mesh.texture_coordinates.empty())
        flat.texture_coordinates.push_back(mesh.texture_coordinates[index]);
    }
    for (std::size_t i = 0; i < flat.positions.size(); i += 3) {
      const Vec3f n = glm::cross(flat.positions[i + 1] - flat.positions[i],
                                 flat.positions[i + 2] - flat.positions[i]);
      flat.normals.insert(flat.normals.end(), 3, n);
    }
    mesh.positions = std::move(flat.positions);
    mesh.texture_coordinates = std::move(flat.texture_coordinates);
    mesh.normals = std::move(flat.normals);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      mesh.triangles[i] = static_cast<std::uint32_t>(i);
  }

  void check_finite(const SceneMesh& mesh) const {
    const auto bad = [](float v) { return !std::isfinite(v); };
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3f& p = mesh.positions[i];
      const Vec3f& n = mesh.normals[i];
      if (bad(p.x) || bad(p.y) || bad(p.z) || bad(n.x) || bad(n.y) || bad(n.z)) {
        throw broken_scene(
            path_, fmt::format("has a mesh '{}' whose vertex {} is not finite (NaN or infinite).",
                               mesh.name, i));
      }
    }
    const auto wild = [](float v) { return !(std::abs(v) <= largest_texture_coordinate); };
    for (const Vec2f& t : mesh.texture_coordinates) {
      if (wild(t.x) || wild(t.y)) {
        throw broken_scene(path_,
                           fmt::format("has a mesh '{}' with texture coordinates that are not "
                                       "finite or that repeat a texture more than a million times.",
                                       mesh.name));
      }
    }
  }

  void add_camera(const tinygltf::Node& node, const Mat4& to_world) {
    if (static_cast<std::size_t>(node.camera) >= model_.cameras.size()) return;
    const tinygltf::Camera& in = model_.cameras[node.camera];
    const double fov = in.perspective.yfov;  // radians
    if (in.type != "perspective" || !(fov > 0.0)) return;
    if (!(fov < std::numbers::pi)) {
      left_out_.insert("cameras whose field of view is 180 degrees or more");
      return;
    }
    const Vec3 eye(to_world[3]);
    const Vec3 forward = -Vec3(to_world[2]);
    Camera camera = look_at(eye, eye + forward, glm::degrees(fov), camera_width, camera_height,
                            Vec3(to_world[1]));
    camera_nodes_.push_back(static_cast<int>(scene_.nodes.size()) - 1);
    camera.name = camera_name(!node.name.empty() ? node.name : in.name, node.camera);
    scene_.cameras.push_back(std::move(camera));
  }

  /// \p name, or one that tells the number of a camera that has none; each once, to be chosen by it.
  std::string camera_name(const std::string& name, int number) {
    const std::string wanted = name.empty() ? fmt::format("camera {}", number) : name;
    std::string unique = wanted;
    int& next = next_of_camera_.try_emplace(wanted, 2).first->second;
    while (!camera_names_.insert(unique).second) unique = fmt::format("{} ({})", wanted, next++);
    return unique;
  }

  void add_distant_lights() {
    const Bounds bounds = scene_bounds(scene_);
    for (const PunctualLight& light : lights_)
      scene_.lights.push_back(light_from_punctual(light, bounds, path_));
  }

  void set_exposure() {
    scene_.exposure = automatic_exposure(scene_);
    const auto take = [&](const tinygltf::Value& extras) {
      if (!extras.IsObject() || !extras.Has("exposure")) return;
      const auto exposure = static_cast<float>(extras.Get("exposure").GetNumberAsDouble());
      if (!std::isfinite(exposure) || exposure <= 0.0f)
        throw broken_scene(path_, "has an exposure in its extras that is not a number above 0.");
      scene_.exposure = exposure;
      scene_.exposure_given = true;
    };
    if (wanted_scene() < model_.scenes.size()) take(model_.scenes[wanted_scene()].extras);
  }

  const tinygltf::Model& model_;
  const std::string& path_;
  GltfSource source_;
  Scene scene_;
  std::set<std::string> left_out_;
  int default_material_ = 0;
  std::vector<int> roots_;
  std::vector<int> camera_nodes_;            // in Scene::nodes
  std::set<int> animated_nodes_;             // of the file
  std::multimap<int, int> animated_places_;  // the file's nodes in Scene::nodes
  std::size_t nodes_visited_ = 0;
  std::size_t charged_ = 0;
  std::set<std::string> camera_names_;
  std::map<std::string, int> next_of_camera_;  // the next number of a name
  std::vector<PunctualLight> lights_;
};

}  // namespace

Scene load_scene(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw Error(Error::Kind::not_found,
                "Scene '{}' does not exist or is not a file. Give the path of a glTF 2.0 file "
                "(.glb or .gltf), or none for the built-in room.",
                path);
  }
  const std::string ending = lower_case(std::filesystem::path(path).extension().string());
  if (ending != ".glb" && ending != ".gltf") {
    throw Error(
        Error::Kind::unsupported,
        "Scene '{}': the name must end in .glb or .gltf, for only glTF 2.0 is read. Import "
        "other kinds (OBJ, PLY, FBX, USD, ...) into Blender and export the scene from there "
        "as glTF.",
        path);
  }
  const tinygltf::Model model = read_gltf(path);
  return Loader(model, path).load();
}

}  // namespace polyhull
