// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <utility>

#include "builtin/room.h"
#include "builtin/shapes.h"

namespace polyhull {
namespace {

// Metres; the doorway is in the room's wall -x, the corridor behind it.
constexpr float thick = 0.1f;                           // of the wall with the doorway
constexpr float door_left = -0.5f, door_right = 0.42f;  // along z
constexpr float door_top = 2.06f;
constexpr float far_end = -5.2f, corridor_top = 2.5f;  // of the corridor, along x and y
constexpr float corridor_left = -1.7f, corridor_right = 1.6f;

class Apartment {
 public:
  explicit Apartment(Scene room) : scene_(std::move(room)) {}

  Scene build() {
    scene_.name = "builtin:apartment";
    doorway();
    corridor();
    corridor_lamp();
    wall_mirror();
    name_nodes();
    scene_.mirrors = find_mirrors(scene_);
    return std::move(scene_);
  }

 private:
  int material(const char* name, const Vec3f& colour) {
    Material material;
    material.name = name;
    material.base_colour = colour;
    scene_.materials.push_back(std::move(material));
    return static_cast<int>(scene_.materials.size()) - 1;
  }

  /// The room's first mesh called \p name; what stands in its stead keeps all indices.
  SceneMesh& mesh(const char* name) {
    return *std::find_if(scene_.meshes.begin(), scene_.meshes.end(),
                         [&](const SceneMesh& mesh) { return mesh.name == name; });
  }

  void doorway() {
    SceneMesh& wall = mesh("wall -x");
    const int plaster = wall.material;
    const Vec3f up(0, room_height, 0);
    wall = parallelogram("wall -x", plaster, {-room_half, 0, room_half},
                         {0, 0, door_right - room_half}, up);
    append(wall, parallelogram("wall -x", plaster, {-room_half, 0, door_left},
                               {0, 0, -room_half - door_left}, up));
    append(wall, parallelogram("wall -x", plaster, {-room_half, door_top, door_right},
                               {0, 0, door_left - door_right}, {0, room_height - door_top, 0}));

    SceneMesh& skirting = mesh("skirting");
    const int white = skirting.material;
    const float h = 0.11f, d = 0.018f;
    skirting = box("skirting", white, {-room_half, 0, -room_half}, {room_half, h, -room_half + d});
    append(skirting,
           box("skirting", white, {-room_half, 0, room_half - d}, {room_half, h, room_half}));
    append(skirting, box("skirting", white, {room_half - d, 0, -room_half + d},
                         {room_half, h, room_half - d}));
    const float jamb = 0.07f;
    append(skirting, box("skirting", white, {-room_half, 0, -room_half + d},
                         {-room_half + d, h, door_left - jamb}));
    append(skirting, box("skirting", white, {-room_half, 0, door_right + jamb},
                         {-room_half + d, h, room_half - d}));

    const float x0 = -room_half - thick - 0.01f, x1 = -room_half + 0.02f;
    SceneMesh frame =
        box("door frame", white, {x0, 0, door_left - jamb}, {x1, door_top + jamb, door_left});
    append(frame,
           box("door frame", white, {x0, 0, door_right}, {x1, door_top + jamb, door_right + jamb}));
    append(frame,
           box("door frame", white, {x0, door_top, door_left}, {x1, door_top + jamb, door_right}));
    mesh("tapestry rod") = std::move(frame);

    const int oak = material("door", {0.30f, 0.165f, 0.075f});
    const int brass = material("door handle", {0.46f, 0.33f, 0.12f});
    const float gap = 0.004f, leaf = -room_half - 0.055f;
    SceneMesh& door = mesh("tapestry");
    door = box("door", oak, {leaf, gap, door_left + gap},
               {leaf + 0.04f, door_top - gap, door_right - gap});
    SceneMesh handle = sphere("door", brass, {leaf + 0.075f, 1.02f, door_right - 0.09f}, 0.03f, 24);
    append(handle, sphere("door", brass, {leaf - 0.035f, 1.02f, door_right - 0.09f}, 0.03f, 24));
    scene_.meshes.push_back(std::move(handle));
  }

  void corridor() {
    const int boards = material("corridor floor", {0.34f, 0.21f, 0.12f});
    const int wash = material("corridor wall", {0.66f, 0.62f, 0.52f});
    const float x = -room_half - thick, length = x - far_end,
                width = corridor_right - corridor_left;
    const Vec3f up(0, corridor_top, 0), along(-length, 0, 0);
    scene_.meshes.push_back(parallelogram("corridor floor", boards, {far_end, 0, corridor_right},
                                          {length + thick, 0, 0}, {0, 0, -width}));
    SceneMesh walls =
        parallelogram("corridor wall", wash, {far_end, 0, corridor_right}, {0, 0, -width}, up);
    append(walls,
           parallelogram("corridor wall", wash, {far_end, 0, corridor_left}, {length, 0, 0}, up));
    append(walls, parallelogram("corridor wall", wash, {x, 0, corridor_right}, along, up));
    append(walls, parallelogram("corridor wall", wash, {x, 0, corridor_left},
                                {0, 0, door_left - corridor_left}, up));
    append(walls, parallelogram("corridor wall", wash, {x, 0, door_right},
                                {0, 0, corridor_right - door_right}, up));
    append(walls, parallelogram("corridor wall", wash, {x, door_top, door_left},
                                {0, 0, door_right - door_left}, {0, corridor_top - door_top, 0}));
    append(walls, parallelogram("corridor wall", wash, {far_end, corridor_top, corridor_left},
                                {length, 0, 0}, {0, 0, width}));
    scene_.meshes.push_back(std::move(walls));
  }

  void corridor_lamp() {
    Light light;
    light.name = "corridor lamp";
    light.centre = {-4.3f, corridor_top - 0.02f, -0.05f};
    light.u = {0.3f, 0, 0};
    light.v = {0, 0, 0.3f};  // cross(u, v) = -y: it shines downwards
    light.radiance = {16.0f, 11.5f, 6.5f};
    const int glow = material("corridor lamp", Vec3f(0.8f));
    scene_.materials[static_cast<std::size_t>(glow)].emission = light.radiance;
    light.mesh = static_cast<int>(scene_.meshes.size());
    scene_.meshes.push_back(parallelogram("corridor lamp", glow, light.centre - light.u - light.v,
                                          2.0f * light.u, 2.0f * light.v));
    scene_.lights.push_back(std::move(light));
  }

  /// A tall glass where the painting hung, and its frame.
  void wall_mirror() {
    const int silver = material("mirror", Vec3f(0.9f));
    scene_.materials.back().roughness = 0.0f;
    scene_.materials.back().metallic = 1.0f;
    const Vec3f low(-1.55f, 0.35f, -room_half), across(1.7f, 0, 0), up(0, 1.8f, 0);
    mesh("painting") = parallelogram("mirror", silver, low + Vec3f(0, 0, 0.03f), across, up);
    SceneMesh& frame = mesh("picture frame");
    frame = picture_frame("mirror frame", frame.material, low, across, up, {0, 0, 0.055f}, 0.06f);
  }

  /// Meshes of one name are one node; the door's turns in its hinges.
  void name_nodes() {
    for (SceneMesh& mesh : scene_.meshes) {
      const auto same = std::find_if(scene_.nodes.begin(), scene_.nodes.end(),
                                     [&](const SceneNode& node) { return node.name == mesh.name; });
      mesh.node = static_cast<int>(same - scene_.nodes.begin());
      if (same == scene_.nodes.end()) scene_.nodes.push_back({mesh.name, -1, Mat4(1.0)});
      if (mesh.name == "door")
        scene_.nodes[static_cast<std::size_t>(mesh.node)].to_world =
            glm::translate(Mat4(1.0), Vec3{-room_half - thick, 0, door_left});
    }
    for (Light& light : scene_.lights)
      light.node = scene_.meshes[static_cast<std::size_t>(light.mesh)].node;
  }

  Scene scene_;
};

}  // namespace

Scene apartment_scene(const std::filesystem::path& folder) {
  return Apartment(room_scene(folder)).build();
}

}  // namespace polyhull
