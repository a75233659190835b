// SPDX-License-Identifier: LGPL-2.1-or-later
// A small view and mesh with something in every member.
#pragma once

#include <numeric>

#include "builtin/default_rig.h"
#include "mesh/mesh.h"

namespace polyhull::examples {

inline std::vector<std::uint8_t> pixels(std::size_t size, int seed) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + seed);
  return bytes;
}

/// A view of 64x48 with a region of 20x10 whose rows are 84 bytes apart; borrows \p block, which
/// needs 84 * 9 + 80 bytes.
inline View view(const std::string& camera, std::span<const std::uint8_t> block) {
  View view;
  view.camera = camera;
  view.trigger = 41;
  view.capture_time = 123456789012345;
  view.clock = CaptureClock::ptp;
  view.timecode = 86399960000000;
  view.width = 64;
  view.height = 48;
  view.roi = {30, 20, 20, 10};
  view.contours.points = {{30.5f, 20.25f}, {31, 29}, {49, 29},   {48, 21},
                          {40, 24},        {44, 24}, {42, 26.5f}};
  view.contours.ends = {4, 7};
  view.format = PixelFormat::rgba;
  view.stride = 84;
  view.pixels = block.subspan(0, 84 * 9 + 80);
  return view;
}

/// A tetrahedron seen by two cameras, textured.
inline Mesh mesh(std::span<const std::uint8_t> block_a, std::span<const std::uint8_t> block_b) {
  Mesh mesh;
  mesh.trigger = 41;
  mesh.capture_time = 123456789012345;
  mesh.up = Vec3(0, 0, -1);
  mesh.metres_per_unit = 0.001;
  mesh.hull.origin = Vec3(1e9, -2, 3);
  mesh.hull.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.hull.triangles = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  mesh.hull.faces = {{0, 0, 0, 1}, {0, 6, 1, 1}, {1, 3, 2, 1}, {-1, 5, 3, 1}};
  mesh.hull.loop_vertices = mesh.hull.triangles;
  mesh.hull.loop_ends = {3, 6, 9, 12};
  mesh.hull.face_loop_ends = {1, 2, 3, 4};
  mesh.hull.normals = {{-0.6f, 0, -0.8f}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Rig rig = default_rig();
  for (int i = 0; i < 2; ++i) {
    MeshView mesh_view;
    mesh_view.calibration = rig.cameras[i];
    mesh_view.calibration.width = 64;
    mesh_view.calibration.height = 48;
    mesh_view.view = view(rig.cameras[i].name, i == 0 ? block_a : block_b);
    mesh.views.push_back(mesh_view);
  }
  mesh.views[1].calibration.distortion = {-0.3, 0.1, 1e-3, 1e-4, 0.02};
  mesh.views[1].calibration.colour = from_rows({1.1, 0.1, -0.1, 0.0, 0.9, 0.05, -0.2, 0.1, 1.3});
  Texturing texturing;
  texturing.method = TextureMethod::direct;
  texturing.metric = TextureMetric::viewing_angle;
  texturing.cameras = 1;
  texturing.untextured = Vec3f(0.25f, 0.5f, 0.75f);
  texturing.visible = {1, 2, 3, 0};
  texturing.best = {0, 1, 1, -1};
  texturing.weights = {0, 0.5f, 1, 0.25f, 0.125f, 1, 0, 0};
  texturing.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  texturing.fill = {0xff030201u, 0xff807f81u, 0xffffffffu, 0xff000000u};
  texturing.gains = {{0.5f, 1.0f, 2.0f}, {1.25f, 16.0f, 0.8f}};
  texturing.maps.resize(2);
  texturing.maps[0] = {
      -3.5f, 2.0f, 4.0f, 3, 2, 1.5f, 4.5f, {0, 1, 2, 65535, 4, 65534}, {9, 8, 7, 6, 5, 255}};
  texturing.flows = {{0, 1, 2, 1, {1, -2, 127, -128}}};
  mesh.texturing = texturing;
  return mesh;
}

}  // namespace polyhull::examples
