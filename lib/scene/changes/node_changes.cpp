// SPDX-License-Identifier: LGPL-2.1-or-later
// Nodes as animations and people move them.
#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"
#include "base/rotation.h"
#include "scene/animation/animation.h"
#include "scene/changes/light_places.h"
#include "scene/changes/named_parts.h"
#include "scene/changes/scene_changes.h"

namespace polyhull {
namespace {

constexpr float farthest = 1e6f;  // metres

/// What becomes of a node and all below it.
struct Pose {
  Mat4 moved{1.0};  // from where the file has it, scene coordinates
  bool visible = true;
};

void name_nodes(Scene& scene) {
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    scene.meshes[m].node = static_cast<int>(m);
    scene.nodes.push_back({scene.meshes[m].name, -1, Mat4(1.0)});
  }
  for (Light& light : scene.lights)
    if (light.mesh >= 0) light.node = light.mesh;
}

/// By node of the scene where the animation has brought it from where the file has it; parents come before
/// their children.
std::vector<Mat4> animated(const Animation& animation, double time,
                           const std::vector<SceneNode>& nodes) {
  std::vector<const NodeMotion*> motions(nodes.size(), nullptr);
  for (const NodeMotion& motion : animation.motions)
    motions[static_cast<std::size_t>(motion.node)] = &motion;
  std::vector<Mat4> moved(nodes.size(), Mat4(1.0));
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const auto parent = static_cast<std::size_t>(std::max(nodes[n].parent, 0));
    const bool root = nodes[n].parent < 0;
    if (!root) moved[n] = moved[parent];
    if (!motions[n]) continue;
    const Mat4 now = motions[n]->at(time).matrix();
    if (now == motions[n]->rest.matrix()) continue;
    const Mat4 above = root ? Mat4(1.0) : nodes[parent].to_world;
    moved[n] = moved[n] * above * now * glm::inverse(nodes[n].to_world);
  }
  return moved;
}

/// Of each node, \p animated before the changes.
std::vector<Pose> poses_of(const std::vector<NodeChange>& changes,
                           const std::vector<SceneNode>& nodes, const std::vector<Mat4>& animated) {
  std::vector<Pose> poses(nodes.size());  // of the changes alone
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    Pose& pose = poses[n];
    if (nodes[n].parent >= 0) pose = poses[static_cast<std::size_t>(nodes[n].parent)];
    Vec3 move(0.0);
    Mat3 turned(1.0);
    bool visible = true;
    for (const NodeChange& change : changes) {
      if (change.node != nodes[n].name || change.node.empty()) continue;
      move += Vec3(change.move);
      turned = static_cast<double>(change.scale) * Mat3(rotation_of(change.turn)) * turned;
      visible = change.visible.value_or(visible);
    }
    pose.visible = pose.visible && visible;
    if (move == Vec3(0.0) && turned == Mat3(1.0)) continue;
    // In single precision, as it always was.
    const Vec3 origin(Vec3f(Vec3(animated[n] * nodes[n].to_world[3])));
    pose.moved = pose.moved * glm::translate(Mat4(1.0), origin + move) * Mat4(turned);
    pose.moved = glm::translate(pose.moved, -origin);
  }
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (animated[n] != Mat4(1.0)) poses[n].moved = poses[n].moved * animated[n];
  return poses;
}

/// A lamp that a mesh shows grows with it; another one keeps its power. A sun keeps its distance. What is
/// flattened gives no light.
void move_light(const Mat4& moved, const Bounds& bounds, Light& light) {
  Mat3 turned(moved);
  const double determinant = glm::determinant(turned);
  if (determinant == 0.0) {
    light.radiance = Vec3f(0.0f);
    return;
  }
  if (is_sun(light, bounds)) {
    turned /= std::cbrt(std::abs(determinant));
    light.centre = around(turned, bounds, light.centre);
  } else {
    light.centre = Vec3f(moved * Vec4(Vec3(light.centre), 1.0));
  }
  const float area = glm::length(glm::cross(light.u, light.v));
  light.u = Vec3f(turned * Vec3(light.u));
  light.v = Vec3f(turned * Vec3(light.v));
  // A mirror image is left-handed: with u and v exchanged it shines to the right side again.
  if (determinant < 0.0) std::swap(light.u, light.v);
  const float now = glm::length(glm::cross(light.u, light.v));
  if (light.mesh < 0 && area > 0.0f && now > 0.0f) light.radiance *= area / now;
  hold(light);
}

/// Throws Error where \p scene is no longer to be drawn.
void check_reach(const Scene& scene) {
  const auto within = [](const Vec3f& p) {
    return glm::all(glm::lessThanEqual(glm::abs(p), Vec3f(farthest)));
  };
  const auto whole = [&](const Vec3f& direction) { return glm::dot(direction, direction) < 2.0f; };
  for (const SceneMesh& mesh : scene.meshes)
    if (!std::all_of(mesh.positions.begin(), mesh.positions.end(), within) ||
        !std::all_of(mesh.normals.begin(), mesh.normals.end(), whole))
      throw Error(
          Error::Kind::bad_input,
          "The nodes of the scene '{}' are moved or scaled so that '{}' reaches beyond 1e6 m or "
          "shrinks to nothing; expected smaller changes.",
          scene.name, mesh.name);
}

/// Takes the meshes of nodes that are not visible out, and the light from their lights.
void hide(const std::vector<Pose>& poses, Scene& scene) {
  const auto is_hidden = [&](int node) {
    return node >= 0 && !poses[static_cast<std::size_t>(node)].visible;
  };
  std::vector<int> number(scene.meshes.size(), -1);
  std::vector<SceneMesh> left;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    if (is_hidden(scene.meshes[m].node)) continue;
    number[m] = static_cast<int>(left.size());
    left.push_back(std::move(scene.meshes[m]));
  }
  scene.meshes = std::move(left);
  for (Light& light : scene.lights) {
    if (light.mesh >= 0) light.mesh = number[static_cast<std::size_t>(light.mesh)];
    if (is_hidden(light.node)) light.radiance = Vec3f(0.0f);
  }
}

/// Which of the nodes that are named are not there.
std::string missing_nodes(const std::vector<NodeChange>& changes, const Scene& scene) {
  std::string missing;
  std::vector<std::string> there;
  for (const SceneNode& node : scene.nodes)
    if (!node.name.empty()) there.push_back(node.name);
  for (const NodeChange& change : changes)
    if (std::find(there.begin(), there.end(), change.node) == there.end())
      add_missing(missing, change.node);
  return missing.empty() ? "" : missing_words(scene.name, "node", missing, there, false);
}

const Animation& animation_of(const Scene& scene, int number) {
  const std::size_t count = scene.animations ? scene.animations->size() : 0;
  if (static_cast<std::size_t>(number) > count)
    throw Error(Error::Kind::bad_input, "The scene '{}' has no animation {}; it has {}.",
                scene.name, number, count);
  return (*scene.animations)[static_cast<std::size_t>(number) - 1];
}

}  // namespace

std::string pose_scene(const ScenePose& pose, Scene& scene) {
  const std::vector<NodeChange> changes = parse_node_changes(pose.nodes);
  if (changes.empty() && pose.animation <= 0) return {};
  if (scene.nodes.empty()) name_nodes(scene);
  const std::vector<Mat4> moved =
      pose.animation > 0
          ? animated(animation_of(scene, pose.animation), pose.animation_time, scene.nodes)
          : std::vector<Mat4>(scene.nodes.size(), Mat4(1.0));
  const std::vector<Pose> poses = poses_of(changes, scene.nodes, moved);
  const auto moved_by = [&](int node) -> const Mat4* {
    if (node < 0) return nullptr;
    const Mat4& by = poses[static_cast<std::size_t>(node)].moved;
    return by == Mat4(1.0) ? nullptr : &by;
  };
  const Bounds bounds = scene_bounds(scene);
  for (SceneMesh& mesh : scene.meshes)
    if (const Mat4* by = moved_by(mesh.node)) move_mesh(*by, mesh);
  for (Light& light : scene.lights)
    if (const Mat4* by = moved_by(light.node)) move_light(*by, bounds, light);
  hide(poses, scene);
  scene.mirrors = find_mirrors(scene);
  check_reach(scene);
  scene_bounds(scene);  // throws where nothing is left
  return missing_nodes(changes, scene);
}

}  // namespace polyhull
