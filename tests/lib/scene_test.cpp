// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/error.h"
#include "base/parse_json.h"
#include "builtin/room.h"
#include "builtin/shapes.h"
#include "scene/announcement.h"
#include "scene/timed_announcement.h"
#include "scene_file.h"

namespace polyhull {
namespace {

using nlohmann::json;

TEST(Room, IsWhatItsHeaderSays) {
  const Scene room = room_scene();
  const Bounds bounds = scene_bounds(room);
  EXPECT_NEAR(bounds.max.y - bounds.min.y, 3.0, 0.2);
  EXPECT_GT(bounds.max.x - bounds.min.x, 5.5);
  ASSERT_EQ(room.lights.size(), 1u);
  EXPECT_TRUE(room.lights[0].is_area());
  EXPECT_LT(glm::cross(room.lights[0].u, room.lights[0].v).y, 0.0f) << "shines downwards";
  ASSERT_GE(room.lights[0].mesh, 0);
  EXPECT_EQ(room.materials[room.meshes[room.lights[0].mesh].material].emission,
            room.lights[0].radiance);
  ASSERT_EQ(room.mirrors.size(), 1u);
  EXPECT_NEAR(room.mirrors[0].normal.y, 1.0f, 1e-6f);
  EXPECT_NEAR(room.mirrors[0].offset, 0.0f, 1e-6f);
  EXPECT_EQ(room.mirrors[0].outline.size(), 4u);
  std::size_t triangles = 0;
  for (const SceneMesh& mesh : room.meshes) {
    triangles += mesh.triangles.size() / 3;
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size()) << mesh.name;
    ASSERT_EQ(mesh.texture_coordinates.size(), mesh.positions.size()) << mesh.name;
    for (const Vec3f& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-4f) << mesh.name;
    // Shading normals and winding agree.
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
      const Vec3f p0 = mesh.positions[mesh.triangles[i]],
                  p1 = mesh.positions[mesh.triangles[i + 1]],
                  p2 = mesh.positions[mesh.triangles[i + 2]];
      const Vec3f n = mesh.normals[mesh.triangles[i]] + mesh.normals[mesh.triangles[i + 1]] +
                      mesh.normals[mesh.triangles[i + 2]];
      if (mesh.name != "leaves") {
        ASSERT_GT(glm::dot(glm::cross(p1 - p0, p2 - p0), n), 0.0f) << mesh.name << " " << i / 3;
      }
    }
    // Nothing stands where the subject moves.
    if (mesh.name.starts_with("floor") || mesh.name.starts_with("ceiling") ||
        mesh.name.starts_with("wall") || mesh.name.starts_with("lamp") || mesh.name == "skirting") {
      continue;
    }
    for (const Vec3f& p : mesh.positions) {
      ASSERT_GT(std::hypot(p.x, p.z), 0.8f) << mesh.name;
    }
  }
  EXPECT_GT(triangles, 2000u);
  EXPECT_LT(triangles, 50000u);
}

TEST_F(SceneFile, WhatIsSavedIsReadBack) {
  Scene room = room_scene();
  Light point;
  point.name = "bulb";
  point.centre = {1, 2, 3};
  point.radiance = {5, 4, 3};
  room.lights.push_back(point);
  Light panel;
  panel.name = "panel";
  panel.centre = {-1, 2, 0.5};
  panel.u = {0.3f, 0.1f, 0.2f};
  panel.v = glm::normalize(glm::cross(panel.u, Vec3f(1, 2, 3))) * 0.25f;
  panel.radiance = {7, 8, 9};
  room.lights.push_back(panel);
  Light spot = panel;
  spot.name = "spot";
  spot.inner_cone = 0.25f;
  spot.outer_cone = 0.5f;
  room.lights.push_back(spot);
  const std::string path = folder_.file("room.glb");
  save_scene(room, path);
  const Scene read = load_scene(path);
  ASSERT_EQ(read.meshes.size(), room.meshes.size());
  for (std::size_t i = 0; i < room.meshes.size(); ++i) {
    EXPECT_EQ(read.meshes[i].name, room.meshes[i].name);
    EXPECT_EQ(read.meshes[i].positions, room.meshes[i].positions);
    EXPECT_EQ(read.meshes[i].triangles, room.meshes[i].triangles);
    EXPECT_EQ(read.meshes[i].texture_coordinates, room.meshes[i].texture_coordinates);
    const Material& a = read.materials[read.meshes[i].material];
    const Material& b = room.materials[room.meshes[i].material];
    EXPECT_EQ(a.name, b.name);
    EXPECT_LT(glm::length(a.base_colour - b.base_colour), 1e-6f);
    EXPECT_LT(glm::length(a.emission - b.emission), 1e-5f);
    EXPECT_FLOAT_EQ(a.ior, b.ior);
    EXPECT_FLOAT_EQ(a.roughness, b.roughness);
    ASSERT_EQ(a.base_colour_texture < 0, b.base_colour_texture < 0);
    if (a.base_colour_texture >= 0) {
      EXPECT_EQ(read.textures[a.base_colour_texture]->pixels,
                room.textures[b.base_colour_texture]->pixels);
    }
  }
  ASSERT_EQ(read.lights.size(), 4u);
  const auto same = [](const Light& a, const Light& b) {
    EXPECT_LT(glm::length(a.centre - b.centre), 1e-5f) << a.name;
    EXPECT_LT(glm::length(glm::cross(a.u, a.v) - glm::cross(b.u, b.v)), 1e-5f) << a.name;
    EXPECT_LT(glm::length(a.radiance - b.radiance), 1e-4f) << a.name;
    EXPECT_EQ(a.is_area(), b.is_area());
    EXPECT_EQ(a.inner_cone, b.inner_cone) << a.name;
    EXPECT_EQ(a.outer_cone, b.outer_cone) << a.name;
  };
  for (const Light& light : read.lights) {
    for (const Light& other : room.lights) {
      if (light.name == other.name) same(light, other);
    }
  }
  EXPECT_EQ(read.lights[0].mesh, room.lights[0].mesh);
  EXPECT_FLOAT_EQ(read.exposure, room.exposure);
  ASSERT_EQ(read.cameras.size(), 1u);
  EXPECT_LT(glm::length(read.cameras[0].t - room.cameras[0].t), 1e-9);
  EXPECT_NEAR(read.cameras[0].K[1][1], room.cameras[0].K[1][1], 1e-6);
  ASSERT_EQ(read.mirrors.size(), 1u);
}

TEST_F(SceneFile, NodeTransformsAreApplied) {
  json root = triangle_file();
  // parent: move by (10, 0, 0); child: scale by -2 along x (mirrors the winding), turn 90 degrees
  // about z
  const double s = std::sqrt(0.5);
  root["nodes"] = json::array({{{"translation", {10, 0, 0}}, {"children", {1}}},
                               {{"mesh", 0}, {"rotation", {0, 0, s, s}}, {"scale", {-2, 1, 1}}}});
  const Scene scene = load_scene(write(root));
  ASSERT_EQ(scene.meshes.size(), 1u);
  const SceneMesh& mesh = scene.meshes[0];
  // x -> -2x along x, turned to y; y turned to -x
  const Vec3f expected[] = {{10, 0, 0}, {10, -2, 0}, {9, 0, 0}};
  for (const Vec3f& e : expected) {
    bool found = false;
    for (const Vec3f& p : mesh.positions) found |= glm::length(p - e) < 1e-5f;
    EXPECT_TRUE(found) << e.x << " " << e.y << " " << e.z;
  }
  const Vec3f p0 = mesh.positions[mesh.triangles[0]], p1 = mesh.positions[mesh.triangles[1]],
              p2 = mesh.positions[mesh.triangles[2]];
  EXPECT_GT(glm::dot(glm::cross(p1 - p0, p2 - p0), mesh.normals[mesh.triangles[0]]), 0.0f);
  EXPECT_GT(mesh.normals[0].z, 0.99f) << "a mirrored mesh keeps its outside";
}

TEST_F(SceneFile, LightsOfTheExtension) {
  json root = triangle_file();
  root["extensionsUsed"] = {"KHR_lights_punctual"};
  root["extensions"]["KHR_lights_punctual"]["lights"] =
      json::array({{{"type", "point"}, {"intensity", 30.0}, {"color", {1, 0.5, 0}}},
                   {{"type", "point"}, {"intensity", 30.0}, {"extras", {{"size", {0.5, 2.0}}}}},
                   {{"type", "directional"}, {"intensity", 4.0}},
                   {{"type", "spot"},
                    {"intensity", 8.0},
                    {"spot", {{"innerConeAngle", 0.3}, {"outerConeAngle", 0.5}}}},
                   {{"type", "spot"}, {"spot", json::object()}}});
  for (int i = 0; i < 5; ++i) {
    root["scenes"][0]["nodes"].push_back(i + 1);
    root["nodes"].push_back({{"translation", {0, 3, 0}},
                             {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},  // -z to -y
                             {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
  }
  const Scene scene = load_scene(write(root));
  ASSERT_EQ(scene.lights.size(), 5u);
  EXPECT_FALSE(scene.lights[0].is_area());
  EXPECT_FLOAT_EQ(scene.lights[0].radiance.y, 15.0f);
  EXPECT_TRUE(scene.lights[1].is_area());
  const Vec3f direction = glm::normalize(glm::cross(scene.lights[1].u, scene.lights[1].v));
  EXPECT_NEAR(direction.y, -1.0f, 1e-5f);
  EXPECT_FLOAT_EQ(scene.lights[1].radiance.x, 30.0f);
  const Light& sun = scene.lights[2];
  EXPECT_GT(sun.centre.y, 50.0f);
  // The irradiance on a surface that faces the sun is the light's intensity.
  const float distance = glm::length(sun.centre);
  const float area = 4.0f * glm::length(glm::cross(sun.u, sun.v));
  EXPECT_NEAR(sun.radiance.x * area / (distance * distance), 4.0f, 0.1f);
  const Light& spot = scene.lights[3];
  EXPECT_TRUE(spot.is_spot());
  EXPECT_FLOAT_EQ(spot.radiance.x * 4.0f * glm::length(glm::cross(spot.u, spot.v)), 8.0f);
  EXPECT_LT(glm::cross(spot.u, spot.v).y, 0.0f);
  EXPECT_EQ(spot.inner_cone, 0.3f);
  EXPECT_EQ(spot.outer_cone, 0.5f);
  EXPECT_EQ(scene.lights[4].inner_cone, 0.0f);
  EXPECT_FLOAT_EQ(scene.lights[4].outer_cone, static_cast<float>(std::numbers::pi / 4));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(scene.lights[i].is_spot());
  const auto cone = [&](double inner, double outer) {
    json with = root;
    json& light = with["extensions"]["KHR_lights_punctual"]["lights"][3];
    light["spot"] = {{"innerConeAngle", inner}, {"outerConeAngle", outer}};
    return write(with);
  };
  for (const auto& [inner, outer] :
       {std::pair{-0.1, 0.5}, {0.6, 0.5}, {0.0, 0.0}, {0.0, 1.6}, {0.3, -0.5}, {0.0, 1e300}})
    EXPECT_TRUE(contains(failure(cone(inner, outer)), "the cone of light"))
        << inner << " " << outer;
  EXPECT_EQ(load_scene(cone(0.5, 0.5)).lights[3].inner_cone, 0.5f) << "a hard border";
  EXPECT_TRUE(load_scene(cone(0.0, 1.570796327)).lights[3].is_spot()) << "rounded up";
}

TEST_F(SceneFile, EmissiveQuadsBecomeLightsEachOfItsOwn) {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[1].emission = {3, 2, 1};
  scene.meshes.push_back(parallelogram("floor", 0, {0, 0, 0}, {0, 0, 4}, {4, 0, 0}));
  SceneMesh lamps = parallelogram("lamps", 1, {0, 2, 0}, {1, 0, 0}, {0, 0, 1});
  append(lamps, parallelogram("lamps", 1, {2, 2, 0}, {1, 0, 0}, {0, 0, 1}));
  scene.meshes.push_back(lamps);
  const std::string path = folder_.file("lamps.glb");
  save_scene(scene, path);
  const Scene read = load_scene(path);
  ASSERT_EQ(read.lights.size(), 2u);
  for (const Light& light : read.lights) {
    EXPECT_LT(glm::cross(light.u, light.v).y, 0.0f);
    EXPECT_FLOAT_EQ(light.centre.y, 2.0f);
    EXPECT_FLOAT_EQ(4.0f * glm::length(glm::cross(light.u, light.v)), 1.0f);
  }
}

TEST(SetLight, MovesTheMeshThatShowsIt) {
  Scene room = room_scene();
  Light light = room.lights[0];
  light.centre += Vec3f(0.5f, -0.2f, 0.1f);
  light.u *= 0.5f;
  light.radiance *= 2.0f;
  set_light(room, 0, light);
  const SceneMesh& mesh = room.meshes[room.lights[0].mesh];
  Vec3f mean(0.0f);
  for (const Vec3f& p : mesh.positions) {
    mean += p / 4.0f;
    EXPECT_NEAR(std::abs(p.x - light.centre.x), glm::length(light.u), 1e-5f);
  }
  EXPECT_LT(glm::length(mean - light.centre), 1e-5f);
  EXPECT_EQ(room.materials[mesh.material].emission, light.radiance);
  EXPECT_THROW(set_light(room, 1, light), Error);
}

TEST(LookAt, SeesItsTargetInTheMiddle) {
  const Camera camera = look_at({1, 2, 3}, {0, 1, 0}, 60.0, 640, 480);
  const Vec3 x = camera.to_camera({0, 1, 0});
  EXPECT_NEAR(x.x, 0.0, 1e-12);
  EXPECT_NEAR(x.y, 0.0, 1e-12);
  EXPECT_GT(x.z, 0.0);
  EXPECT_LT(camera.to_camera({0, 1.1, 0}).y, 0.0) << "up is up";
  EXPECT_NEAR(glm::determinant(camera.R), 1.0, 1e-12);
  // The upper edge of the picture is 30 degrees above the axis.
  EXPECT_NEAR(std::atan((camera.K[2][1] + 0.5) / camera.K[1][1]), std::numbers::pi / 6, 1e-12);
  EXPECT_THROW(look_at({1, 2, 3}, {1, 2, 3}, 60, 64, 48), Error);
  EXPECT_THROW(look_at({1, 2, 3}, {0, 0, 0}, 180, 64, 48), Error);
  EXPECT_THROW(look_at({NAN, 2, 3}, {0, 0, 0}, 60, 64, 48), Error);
}

TEST(LookAt, StraightDownHasMinusZUpwards) {
  for (const double height : {2.0, -2.0}) {
    const Camera camera = look_at({1, height, 3}, {1, 0, 3}, 60.0, 64, 48);
    EXPECT_NEAR(glm::determinant(camera.R), 1.0, 1e-12);
    EXPECT_NEAR(glm::length(camera.to_camera({1, 0, 3}) - Vec3(0, 0, 2)), 0.0, 1e-12);
    EXPECT_LT(camera.to_camera({1, 0, 2.9}).y, 0.0) << "-z is up";
    EXPECT_EQ(camera.to_camera({1.1, 0, 3}).x > 0.0, height > 0.0) << "x is right from above";
  }
  // Next to it the height of the view still tells which way is up.
  EXPECT_LT(look_at({1, 2, 3 - 1e-6}, {1, 0, 3}, 60.0, 64, 48).to_camera({1, 0, 3.1}).y, 0.0);
}

TEST(Mirrors, AreFoundByPlaneAndCurvedOnesLeftOut) {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[1].roughness = 0.0f;
  scene.meshes.push_back(box("mirror box", 1, Vec3f(-1.0f), Vec3f(1.0f)));
  scene.meshes.push_back(sphere("chrome", 1, {0, 5, 0}, 1.0f, 16));
  scene.meshes.push_back(box("dull", 0, Vec3f(-4.0f), Vec3f(-3.0f)));
  const std::vector<Mirror> mirrors = find_mirrors(scene);
  ASSERT_EQ(mirrors.size(), 6u);
  for (const Mirror& mirror : mirrors) {
    EXPECT_EQ(mirror.meshes, std::vector<int>{0});
    EXPECT_EQ(mirror.outline.size(), 4u);
    EXPECT_NEAR(mirror.offset, 1.0f, 1e-6f);
    for (const Vec3f& p : mirror.outline) EXPECT_NEAR(glm::dot(p, mirror.normal), 1.0f, 1e-6f);
  }
}

TEST(Mirrors, OfSeveralMeshesAreOneWhereTheyMirrorAlike) {
  Scene scene;
  scene.materials.resize(4);
  for (Material& material : scene.materials) material.roughness = 0.0f;
  scene.materials[1].base_colour = Vec3f(0.1f);  // a dark stone, as polished
  scene.materials[2].ior = 2.0f;
  scene.materials[3].metallic = 1.0f;
  const auto tile = [&](int material, float x, float height) {
    scene.meshes.push_back(parallelogram("tile", material, {x, height, 0}, {1, 0, 0}, {0, 0, -1}));
  };
  tile(0, 0, 0);
  tile(1, 1, 0);
  tile(2, 2, 0);
  tile(0, 3, 0);
  tile(3, 4, 0);
  tile(0, 5, 0.01f);
  const std::vector<Mirror> mirrors = scene.mirrors = find_mirrors(scene);
  ASSERT_EQ(mirrors.size(), 4u);
  EXPECT_EQ(mirrors[0].meshes, (std::vector<int>{0, 1, 3}));
  for (const Vec3f& corner : mirrors[0].outline) EXPECT_EQ(std::abs(corner.x - 2.0f), 2.0f);
  const int wanted[] = {0, 0, 1, 0, 2, 3};
  for (std::size_t m = 0; m < 6; ++m)
    EXPECT_EQ(mirrors_of_triangles(scene, m), std::vector<int>(2, wanted[m])) << m;
}

TEST_F(SceneFile, BadFilesAreRefusedWithReasons) {
  EXPECT_TRUE(contains(failure("/nowhere/room.glb"), "does not exist"));
  std::ofstream(folder_ / "room.ply") << "ply";
  EXPECT_TRUE(contains(failure(folder_.file("room.ply")), "into Blender and export"));
  std::ofstream(folder_ / "text.glb") << "this is not a glTF file";
  EXPECT_TRUE(contains(failure(folder_.file("text.glb")), "not a readable glTF"));
  std::ofstream(folder_ / "text.gltf") << "{ \"asset\": ";
  EXPECT_TRUE(contains(failure(folder_.file("text.gltf")), "not a readable glTF"));
  const std::string deep =
      "{\"asset\":{\"version\":\"2.0\",\"extras\":" + std::string(1000000, '[') +
      std::string(1000000, ']') + "}}  ";
  std::ofstream(folder_ / "deep.gltf") << deep;
  EXPECT_TRUE(contains(failure(folder_.file("deep.gltf")), "more than 64 brackets"));
  std::string head("glTF\2\0\0\0????????JSON", 20);
  for (int i = 0; i < 4; ++i) {
    head[8 + i] = static_cast<char>((deep.size() + 20) >> 8 * i);
    head[12 + i] = static_cast<char>(deep.size() >> 8 * i);
  }
  std::ofstream(folder_ / "deep.glb") << head << deep;
  EXPECT_TRUE(contains(failure(folder_.file("deep.glb")), "more than 64 brackets"));
  // Brackets in a text are none.
  EXPECT_EQ(json_depth(R"({"a": "[[[[\"[[[\\", "b": [1, {}]})"), 3u);
  std::ofstream(folder_ / "mesh.obj") << "v 0 0 0";
  EXPECT_TRUE(contains(failure(folder_.file("mesh.obj")), ".glb or .gltf"));

  json root = triangle_file();
  root["nodes"][0].erase("mesh");
  EXPECT_TRUE(contains(failure(write(root)), "no geometry"));

  root = triangle_file();
  root["materials"] = json::array(
      {{{"name", "brick"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}});
  root["textures"] = json::array({{{"source", 0}}});
  root["images"] = json::array({{{"uri", "brick.png"}}});
  root["meshes"][0]["primitives"][0]["material"] = 0;
  const std::string missing = failure(write(root));
  EXPECT_TRUE(contains(missing, "brick.png") && contains(missing, "missing")) << missing;
  std::ofstream(folder_ / "brick.png") << "not a picture";
  const std::string broken = failure(write(root));
  EXPECT_TRUE(contains(broken, "brick.png") && contains(broken, "not a readable")) << broken;

  root = triangle_file();
  root["accessors"][0]["count"] = 300;
  EXPECT_TRUE(contains(failure(write(root)), "beyond its buffer"));
  root = triangle_file();
  root["accessors"][0]["byteOffset"] = 1u << 30;
  EXPECT_TRUE(contains(failure(write(root)), "beyond its buffer"));
  root = triangle_file();
  root["nodes"][0]["children"] = {0};
  EXPECT_TRUE(contains(failure(write(root)), "contain one another"));
  root = triangle_file();
  root["nodes"][0]["mesh"] = 7;
  EXPECT_FALSE(failure(write(root)).empty());
  root = triangle_file();
  root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  EXPECT_TRUE(contains(failure(write(root)), "KHR_draco_mesh_compression"));
  root = triangle_file();
  root["meshes"][0]["primitives"][0]["attributes"] = {{"NORMAL", 0}};
  EXPECT_TRUE(contains(failure(write(root)),
                       "not one triangle in its nodes but meshes without positions."));

  root = triangle_file();
  const float bad[] = {0, 0, 0, 1, NAN, 0, 0, 1, 0};
  std::ofstream(folder_ / "data.bin", std::ios::binary)
      .write(reinterpret_cast<const char*>(bad), sizeof bad);
  EXPECT_TRUE(contains(failure(write(root)), "not finite"));
}

// The ray tracer's look-up takes whole repetitions off by way of an int.
TEST_F(SceneFile, RefusesWildTextureCoordinates) {
  Scene scene;
  scene.materials.resize(1);
  scene.materials[0].base_colour_texture = 0;
  scene.textures.push_back(Picture{2, 2, 4, std::vector<std::uint8_t>(16, 200)});
  scene.meshes.push_back(box("box", 0, Vec3f(0.0f), Vec3f(1.0f)));
  SceneMesh& mesh = scene.meshes[0];
  const std::string path = folder_.file("wild.glb");
  mesh.texture_coordinates.assign(mesh.positions.size(), Vec2f(-1000.0f, 1000.0f));
  save_scene(scene, path);
  EXPECT_EQ(failure(path), "");
  for (const float wild : {3e9f, -1e30f, INFINITY}) {
    mesh.texture_coordinates.back().y = wild;
    save_scene(scene, path);
    EXPECT_TRUE(contains(failure(path), "texture coordinates")) << wild;
  }
}

TEST_F(SceneFile, AFileCutShortNeverCrashes) {
  Scene scene;
  scene.materials.resize(1);
  scene.materials[0].base_colour_texture = 0;
  scene.textures.push_back(Picture{2, 2, 4, std::vector<std::uint8_t>(16, 200)});
  scene.meshes.push_back(box("box", 0, Vec3f(0.0f), Vec3f(1.0f)));
  const std::string path = folder_.file("whole.glb");
  save_scene(scene, path);
  EXPECT_NO_THROW(load_scene(path));
  std::ifstream in(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::string cut = folder_.file("cut.glb");
  for (std::size_t size = 0; size < bytes.size(); size += 37) {
    std::ofstream(cut, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), static_cast<std::streamsize>(size));
    EXPECT_THROW(load_scene(cut), Error) << size;
  }
}

TEST(Announcement, SurvivesJson) {
  Announcement announcement;
  announcement.viewport = look_at({1, 2, 3}, {0, 1, 0}, 50, 1280, 720);
  announcement.scene = "builtin:room";
  announcement.lights = room_scene().lights;
  announcement.exposure = 0.75f;
  EXPECT_FALSE(contains(announcement_to_json(announcement), "cone")) << "as before there was one";
  EXPECT_FALSE(contains(announcement_to_json(announcement), "sky"));
  announcement.lights.push_back(announcement.lights[0]);
  announcement.lights[1].inner_cone = 0.2f;
  announcement.lights[1].outer_cone = 0.45f;
  announcement.sky = {0.3f, 0.4f, 0.5f};
  announcement.undimmed = announcement.lights;
  announcement.undimmed[1].radiance *= 2.0f;
  announcement.undimmed_sky = {0.6f, 0.8f, 1.0f};
  announcement.ambient = {0.1f, 0.2f, 0.3f};
  announcement.aperture = 0.0175;
  announcement.focus_distance = 2.25;
  announcement.viewport.distortion = {-0.2, 0.05, 0.001, 0.002, 0.01};
  const Announcement read = parse_announcement(announcement_to_json(announcement));
  EXPECT_EQ(read.viewport.K, announcement.viewport.K);
  EXPECT_EQ(read.viewport.R, announcement.viewport.R);
  EXPECT_EQ(read.viewport.t, announcement.viewport.t);
  EXPECT_EQ(read.viewport.width, 1280);
  EXPECT_EQ(read.scene, announcement.scene);
  EXPECT_EQ(read.lights, announcement.lights);
  EXPECT_EQ(read.exposure, announcement.exposure);
  EXPECT_EQ(read.ambient, announcement.ambient);
  EXPECT_EQ(read.sky, announcement.sky);
  EXPECT_EQ(read.undimmed, announcement.undimmed);
  EXPECT_EQ(read.undimmed_sky, announcement.undimmed_sky);
  EXPECT_EQ(read.aperture, announcement.aperture);
  EXPECT_EQ(read.focus_distance, announcement.focus_distance);
  EXPECT_EQ(read.viewport.distortion, announcement.viewport.distortion);
}

TEST(Announcement, RefusesWhatIsNone) {
  EXPECT_THROW(parse_announcement(""), Error);
  EXPECT_THROW(parse_announcement("[]"), Error);
  EXPECT_THROW(parse_announcement("{\"format\":\"polyhull-announcement\",\"version\":2}"), Error);
  EXPECT_THROW(parse_announcement("{\"format\":" + std::string(1000000, '[') +
                                  std::string(1000000, ']') + "}"),
               Error);
  EXPECT_THROW(parse_announcement("{\"format\":\"polyhull-announcement\",\"version\":1}"), Error);
  json root = json::parse(announcement_to_json({look_at({1, 2, 3}, {0, 1, 0}, 50, 64, 48)}));
  for (const char* name : {"viewport", "scene", "lights", "exposure", "ambient"}) {
    json without = root;
    without.erase(name);
    EXPECT_THROW(parse_announcement(without.dump()), Error) << name;
    json wrong = root;
    wrong[name] = "7";
    if (std::strcmp(name, "scene") != 0) {
      EXPECT_THROW(parse_announcement(wrong.dump()), Error) << name;
    }
  }
  for (const char* name : {"aperture", "focus-distance"}) {
    json wrong = root;
    for (const json& value : {json(-0.1), json("7"), json(nullptr), json::array()}) {
      wrong[name] = value;
      EXPECT_THROW(parse_announcement(wrong.dump()), Error) << name << value;
    }
    wrong[name] = 0.0;
    EXPECT_NO_THROW(parse_announcement(wrong.dump()));
  }
  for (const auto& [pointer, value] : std::vector<std::pair<const char*, json>>{
           {"/viewport/K/0", 0.0},
           {"/viewport/R/0", 1.5},
           {"/viewport/width", 0},
           {"/viewport/width", 1e300},
           {"/viewport/height", 40000},
           {"/viewport/distortion", {1, 2, 3}},
           {"/viewport/distortion", "no"},
           {"/viewport/t/1", 1e200},
           {"/viewport/K/0", 1e-29},
           {"/viewport/K/0", 1e-3},
           {"/viewport/K/1", 1e20},
           {"/viewport/K/2", 1e20},
           {"/viewport/K/3", 1e20},
           {"/viewport/K/5", -1e20},
           {"/viewport/K/6", 1e-3},
           {"/viewport/K/7", 1},
           {"/viewport/K/8", 0},
           {"/exposure", -1e-3},
           {"/exposure", 1e10},
           {"/ambient/0", -1e-3},
           {"/ambient/2", 1e20},
           {"/sky", {0, -1e-3, 0}},
           {"/sky", {0, 0, 1e20}},
           {"/sky", 1},
           {"/viewport/name", std::string(4097, 'x')},
           {"/scene", std::string(4097, 'x')},
           {"/scene", 7},
           {"/lights", json::array({1})},
           {"/lights", std::vector<json>(1025, json::object())}}) {
    json wrong = root;
    wrong[json::json_pointer(pointer)] = value;
    EXPECT_THROW(parse_announcement(wrong.dump()), Error) << pointer;
  }
  Announcement lit{look_at({1, 2, 3}, {0, 1, 0}, 50, 64, 48)};
  lit.lights.resize(1);
  root = json::parse(announcement_to_json(lit));
  root["lights"][0]["name"] = std::string(4096, 'x');
  EXPECT_NO_THROW(parse_announcement(root.dump()));
  root["lights"][0]["name"] = std::string(4097, 'x');
  EXPECT_THROW(parse_announcement(root.dump()), Error);
  root["lights"][0]["name"] = "lamp";
  for (const json& cone : {json(0.5), json({0.5}), json({-0.1, 0.5}), json({0.6, 0.5}),
                           json({0.0, 1.6}), json({0.0, "wide"})}) {
    json wrong = root;
    wrong["lights"][0]["cone"] = cone;
    EXPECT_THROW(parse_announcement(wrong.dump()), Error) << cone;
  }
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, double>>{{"/lights/0/centre/0", -1e10},
                                                   {"/lights/0/u/1", 1e20},
                                                   {"/lights/0/v/2", 1e20},
                                                   {"/lights/0/radiance/0", -1e-3}}) {
    json wrong = root;
    wrong[json::json_pointer(pointer)] = value;
    EXPECT_THROW(parse_announcement(wrong.dump()), Error) << pointer;
  }
  for (const json& mesh : {json(-2), json(0.5), json(1e72), json(-1e72), json(1ll << 31), json("1"),
                           json(18446744073709551615ull), json(nullptr)}) {
    root["lights"][0]["mesh"] = mesh;
    EXPECT_THROW(parse_announcement(root.dump()), Error) << mesh;
  }
}

TEST(TimedAnnouncement, TellsItsTimes) {
  json root = json::parse(announcement_to_json({look_at({1, 2, 3}, {0, 1, 0}, 50, 64, 48)}));
  EXPECT_FALSE(parse_timed_announcement(root.dump()).stream_time_ns);
  root["stream_time_ns"] = 40000000;
  root["unix_time_ns"] = 1700000000000000000;
  root["timecode"] = "10:00:00:00";
  root["timecode_rate"] = {25, 1};
  const TimedAnnouncement timed = parse_timed_announcement(root.dump());
  EXPECT_EQ(timed.stream_time_ns, 40000000);
  EXPECT_EQ(timed.unix_time_ns, 1700000000000000000);
  EXPECT_EQ(timed.timecode, "10:00:00:00");
  EXPECT_EQ(timed.timecode_numerator, 25);
  EXPECT_EQ(timed.announcement.viewport.width, 64);
  for (const auto& [name, value] :
       std::vector<std::pair<const char*, json>>{{"stream_time_ns", 1.5},
                                                 {"stream_time_ns", -1},
                                                 {"stream_time_ns", "0"},
                                                 {"unix_time_ns", 9223372036854775807},
                                                 {"unix_time_ns", 18446744073709551615u},
                                                 {"timecode", 7},
                                                 {"timecode_rate", json::array({25})},
                                                 {"timecode_rate", json::array({0, 1})},
                                                 {"timecode_rate", json::array({25, 1.5})},
                                                 {"timecode_rate", "25"}}) {
    json wrong = root;
    wrong[name] = value;
    EXPECT_THROW(parse_timed_announcement(wrong.dump()), Error) << name << value;
  }
}

TEST(AnnouncementHistory, FindsWhatHolds) {
  AnnouncementHistory history(100);
  EXPECT_EQ(history.at(5), nullptr);
  for (const std::int64_t time : {95, 10, 5}) history.add(time, {});
  EXPECT_EQ(history.at(94), nullptr);
  EXPECT_EQ(history.at(99)->time, 95);
  EXPECT_EQ(history.at(4)->time, 95);  // the day after
  EXPECT_EQ(history.at(7)->time, 5);
  EXPECT_EQ(history.at(12)->time, 10);
  EXPECT_TRUE(history.reaches(97));
  EXPECT_FALSE(history.reaches(11));
  EXPECT_EQ(history.last_after(97), 8);
  Announcement other;
  other.exposure = 3.0f;
  history.add(10, other);
  EXPECT_EQ(history.size(), 3u);
  EXPECT_EQ(history.at(10)->announcement.exposure, 3.0f);
  for (std::int64_t time = 0; time < 3000; ++time) history.add(time % 2000 + 1000, {});
  EXPECT_EQ(history.size(), AnnouncementHistory::most);
}

// Whatever a sender says, it fills no more than what is kept together.
TEST(AnnouncementHistory, IsBounded) {
  AnnouncementHistory history, small;
  for (std::int64_t time = 0; time <= 512; ++time) small.add(time, {});
  EXPECT_FALSE(small.is_crowded(0));
  EXPECT_TRUE(small.is_crowded(-1));
  small.add(513, {});
  EXPECT_TRUE(small.is_crowded(0));
  EXPECT_FALSE(small.is_crowded(1));
  Announcement large;
  large.lights.resize(1024);
  for (Light& light : large.lights) light.name.assign(1000, 'x');
  std::int64_t time = 0;
  for (; !history.is_crowded(0); ++time) history.add(time, large);
  EXPECT_GT(history.size(), 10u);
  EXPECT_NEAR(static_cast<double>(history.bytes()), 0.5 * AnnouncementHistory::most_bytes, 3e6);
  for (; time < 200; ++time) {
    history.add(time, large);
    history.add(time, large);  // in the place of the one before
    EXPECT_LE(history.bytes(), AnnouncementHistory::most_bytes);
    EXPECT_NE(history.at(time), nullptr);
  }
  history.begin_again(0, 0);
  EXPECT_EQ(history.size(), 0u);
  EXPECT_EQ(history.bytes(), 0u);
}

constexpr std::int64_t second = 1'000'000'000, day = 86400 * second;

// One message of another time, forged or wrong, does not stand for those that are to come.
TEST(AnnouncementHistory, IsNotReachedByOneFarAway) {
  AnnouncementHistory history(day);
  history.add(10 * second, {});
  history.add(5000 * second, {});
  EXPECT_FALSE(history.reaches(11 * second));
  history.add(11 * second, {});
  EXPECT_TRUE(history.reaches(11 * second));
  EXPECT_FALSE(history.reaches(12 * second));
  // Two, or the last of a few: they only change now and then.
  history.add(20 * second, {});
  history.add(30 * second, {});
  EXPECT_TRUE(history.reaches(12 * second));
}

// Each time what is asked for jumps back, messages have done so before or will afterwards.
TEST(AnnouncementHistory, BeginsAgain) {
  for (const bool messages_first : {false, true}) {
    AnnouncementHistory history(day);
    std::uint64_t run = 0;
    for (int loop = 0; loop < 4; ++loop) {
      const float mark = static_cast<float>(loop);
      const auto add = [&](std::int64_t time) {
        Announcement announcement;
        announcement.exposure = mark;
        history.add(time * second, announcement);
      };
      if (messages_first) add(0);
      if (loop > 0) history.begin_again(0, run);
      if (!messages_first) add(0);
      for (int time = 1; time < 10; ++time) {
        EXPECT_FALSE(history.reaches(time * second)) << loop << " " << time;
        add(time);
        EXPECT_TRUE(history.reaches(time * second));
        EXPECT_EQ(history.at(time * second)->announcement.exposure, mark);
        run = history.at(time * second)->run;
        if (time == 5) add(5000);  // forged
      }
    }
  }
}

}  // namespace
}  // namespace polyhull
