// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/mesh_rules.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/error.h"
#include "rig/rig.h"
#include "wire/flow_payload.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

namespace polyhull {
namespace {

constexpr std::size_t most_textured_views = 64;
constexpr float most_gain = 16.0f;

bool finite(std::span<const float> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](float x) { return std::isfinite(x); });
}

bool finite(std::span<const Vec3f> vectors) {
  return vectors.empty() || finite({&vectors.front().x, 3 * vectors.size()});
}

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Whether `ends` never falls and its last is `total`.
bool partitions(std::span<const std::uint32_t> ends, std::size_t total) {
  return std::is_sorted(ends.begin(), ends.end()) && (ends.empty() ? 0 : ends.back()) == total;
}

bool below(std::span<const std::uint32_t> indices, std::size_t limit) {
  return std::all_of(indices.begin(), indices.end(),
                     [limit](std::uint32_t index) { return index < limit; });
}

void validate_hull(const Mesh& mesh) {
  const Hull& hull = mesh.hull;
  if (!finite(hull.origin) || !finite(hull.vertices))
    refuse_mesh("a vertex or the origin is not finite");
  if (hull.triangles.size() % 3 != 0)
    refuse_mesh("the triangles' indices are no multiple of three");
  if (!below(hull.triangles, hull.vertices.size()))
    refuse_mesh("a triangle's index is out of range");
  if (!below(hull.loop_vertices, hull.vertices.size()))
    refuse_mesh("a loop's index is out of range");
  if (!partitions(hull.loop_ends, hull.loop_vertices.size()) ||
      !partitions(hull.face_loop_ends, hull.loop_ends.size()))
    refuse_mesh("the loops' ends contradict each other");
  if (!hull.face_loop_ends.empty() && hull.face_loop_ends.size() != hull.faces.size())
    refuse_mesh("there must be loops for every face or for none");
  if (!hull.normals.empty() && hull.normals.size() != hull.vertices.size())
    refuse_mesh("there must be normals for every vertex or for none");
  for (const Vec3f& normal : hull.normals) {
    const float square = glm::dot(normal, normal);
    if (!(square > 0.98f && square < 1.02f)) refuse_mesh("a normal is not of unit length");
  }
  const std::size_t triangles = hull.triangles.size() / 3;
  for (const HullFace& face : hull.faces) {
    if (face.view < -1 || face.view >= static_cast<std::int64_t>(mesh.views.size()))
      refuse_mesh("a face belongs to a view that is not there");
    // A camera's frame carves, too, where the hull is told to keep what it does not see: four edges.
    const std::size_t edges =
        face.view < 0 ? 6 : mesh.views[face.view].view.contours.points.size() + 4;
    const bool planeless = face.view < 0 && face.edge == HullFace::no_edge;
    if (face.edge >= edges && !planeless)
      refuse_mesh("a face belongs to a contour edge that is not there");
    if (face.first_triangle > triangles || face.triangle_count > triangles - face.first_triangle)
      refuse_mesh("a face's triangles are out of range");
  }
}

void validate_map(const OcclusionMap& map) {
  constexpr int largest_side = 32768;
  if (map.width < 0 || map.height < 0 || map.width > largest_side || map.height > largest_side)
    refuse_mesh("a depth map's size is out of range");
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  if (map.depth.size() != texels || map.fade.size() != texels)
    refuse_mesh("a depth map's size contradicts its contents");
  if (!std::isfinite(map.x) || !std::isfinite(map.y) || !std::isfinite(map.step) ||
      !(map.step > 0.0f) || !std::isfinite(map.near) || !std::isfinite(map.far))
    refuse_mesh("a depth map's place is not finite");
}

void validate_texturing(const Mesh& mesh) {
  const Texturing& texturing = *mesh.texturing;
  const std::size_t triangles = mesh.hull.triangles.size() / 3;
  const std::size_t vertices = mesh.hull.vertices.size();
  const std::size_t views = mesh.views.size();
  if (views > most_textured_views) refuse_mesh("a textured mesh may have at most 64 views");
  if (texturing.method != TextureMethod::direct && texturing.method != TextureMethod::blend)
    refuse_mesh("unknown texture method");
  if (texturing.metric != TextureMetric::camera_normal &&
      texturing.metric != TextureMetric::viewing_angle &&
      texturing.metric != TextureMetric::lumigraph)
    refuse_mesh("unknown texture metric");
  if (texturing.visible.size() != triangles || texturing.best.size() != triangles ||
      texturing.weights.size() != vertices * views || texturing.normals.size() != vertices)
    refuse_mesh("the texturing does not fit the numbers of triangles, vertices and views");
  if (!finite(texturing.weights) || !finite(texturing.normals) ||
      !finite({&texturing.untextured.x, 3}))
    refuse_mesh("the texturing has a number that is not finite");
  if (!texturing.fill.empty() && texturing.fill.size() != vertices)
    refuse_mesh("there must be a fill colour for every vertex or for none");
  if (!texturing.gains.empty() && texturing.gains.size() != views)
    refuse_mesh("there must be a gain for every view or for none");
  for (const Vec3f& gain : texturing.gains)
    for (int c = 0; c < 3; ++c)
      if (!(gain[c] > 0.0f && gain[c] <= most_gain))
        refuse_mesh("a view's gain is not above 0 and at most 16");
  if (!texturing.maps.empty() && texturing.maps.size() != views)
    refuse_mesh("there must be a depth map for every view or for none");
  for (const OcclusionMap& map : texturing.maps) validate_map(map);
  if (const std::string fault = flows_fault(texturing); !fault.empty()) refuse_mesh(fault);
  for (const std::uint64_t mask : texturing.visible)
    if (views < most_textured_views && (mask >> views) != 0)
      refuse_mesh("a triangle is seen by a view that is not there");
  for (const std::int8_t best : texturing.best)
    if (best < -1 || best >= static_cast<int>(views))
      refuse_mesh("a triangle is coloured by a view that is not there");
}

// Whoever shows, counts or writes by a camera's name would take one for the other.
void check_names(const std::vector<MeshView>& views) {
  std::vector<std::string_view> names;
  for (const MeshView& view : views) names.push_back(view.view.camera);
  std::sort(names.begin(), names.end());
  const auto twice = std::adjacent_find(names.begin(), names.end());
  if (twice != names.end())
    refuse_mesh(
        fmt::format("two of its views are of camera '{}'; each camera may have one view", *twice));
}

}  // namespace

void refuse_mesh(const std::string& what) {
  throw Error(Error::Kind::bad_input, "Not a usable mesh: {}.", what);
}

void validate_mesh(const Mesh& mesh) {
  if (!finite(mesh.up) || !(glm::length(mesh.up) > 0.0)) refuse_mesh("up is no direction");
  if (!std::isfinite(mesh.metres_per_unit) || !(mesh.metres_per_unit > 0.0))
    refuse_mesh("the length of its unit is not positive");
  if (!(mesh.opacity >= 0.0f && mesh.opacity <= 1.0f)) refuse_mesh("its opacity is not 0 to 1");
  for (const MeshView& view : mesh.views) {
    if (view.calibration.name != view.view.camera || view.calibration.width != view.view.width ||
        view.calibration.height != view.view.height)
      refuse_mesh(fmt::format("view '{}' has another camera's name or size", view.view.camera));
    validate_view(view.view);
    validate_camera(view.calibration, fmt::format("mesh: camera '{}'", view.calibration.name));
  }
  check_names(mesh.views);
  validate_hull(mesh);
  if (mesh.texturing) validate_texturing(mesh);
}

}  // namespace polyhull
