// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/projection.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "base/rotation.h"
#include "mesh/world.h"

namespace polyhull {
namespace {

constexpr double eye_plane = 1e-3;  // clip w below which a point counts as behind the eye

/// Grows by clip points; asks for its pixels at the end.
struct Extent {
  double low_x = std::numeric_limits<double>::max(), low_y = low_x;
  double high_x = -low_x, high_y = -low_x;
  void add(const Vec4& clip) {
    low_x = std::min(low_x, clip.x / clip.w);
    high_x = std::max(high_x, clip.x / clip.w);
    low_y = std::min(low_y, clip.y / clip.w);
    high_y = std::max(high_y, clip.y / clip.w);
  }
  Rectangle pixels(int width, int height) const {
    if (!(low_x <= high_x) || !(low_y <= high_y)) return {};
    const auto column = [&](double x) { return std::clamp(0.5 * (x + 1.0), -2.0, 3.0) * width; };
    const auto row = [&](double y) { return std::clamp(0.5 * (y + 1.0), -2.0, 3.0) * height; };
    const int x0 = static_cast<int>(std::floor(column(low_x))) - 1;
    const int x1 = static_cast<int>(std::ceil(column(high_x))) + 1;
    const int y0 = static_cast<int>(std::floor(row(low_y))) - 1;
    const int y1 = static_cast<int>(std::ceil(row(high_y))) + 1;
    return intersection({x0, y0, x1 - x0, y1 - y0}, {0, 0, width, height});
  }
};

}  // namespace

Mat4 view_matrix(const Camera& camera) {
  Mat4 view(camera.R);
  view[3] = Vec4(camera.t, 1.0);
  return view;
}

Mat4 clip_from_camera(const Camera& camera, double near, double far) {
  const double w = camera.width, h = camera.height;
  const Mat3& K = camera.K;
  Mat4 clip(0.0);
  clip[0][0] = 2.0 * K[0][0] / w;
  clip[1][0] = 2.0 * K[1][0] / w;
  clip[2][0] = 2.0 * (K[2][0] + 0.5) / w - 1.0;
  clip[1][1] = 2.0 * K[1][1] / h;
  clip[2][1] = 2.0 * (K[2][1] + 0.5) / h - 1.0;
  clip[2][2] = (far + near) / (far - near);
  clip[3][2] = -2.0 * far * near / (far - near);
  clip[2][3] = 1.0;
  return clip;
}

Camera resized(const Camera& camera, int width, int height) {
  Camera out = camera;
  if (camera.width == width && camera.height == height) return out;
  const double sx = static_cast<double>(width) / camera.width;
  const double sy = static_cast<double>(height) / camera.height;
  out.width = width;
  out.height = height;
  out.K[0][0] *= sx;
  out.K[1][0] *= sx;
  out.K[2][0] = (camera.K[2][0] + 0.5) * sx - 0.5;
  out.K[1][1] *= sy;
  out.K[2][1] = (camera.K[2][1] + 0.5) * sy - 0.5;
  return out;
}

PixelRays::PixelRays(const Camera& camera) {
  const Vec3 first = camera.ray({0.0, 0.0});
  origin = Vec3f(first);
  x = Vec3f(camera.ray({1.0, 0.0}) - first);
  y = Vec3f(camera.ray({0.0, 1.0}) - first);
}

namespace {

/// The centre of gravity of a closed mesh's volume, from the tetrahedra that its triangles make
/// with one point; of its vertices where it has no volume. Relative to Hull::origin.
Vec3 centroid(const Hull& hull) {
  const Vec3 apex(hull.vertices[0]);
  Vec3 sum(0.0), vertices(0.0);
  double volume = 0.0, size = 0.0;
  for (std::size_t i = 0; i + 2 < hull.triangles.size(); i += 3) {
    const Vec3 a = Vec3(hull.vertices[hull.triangles[i]]) - apex;
    const Vec3 b = Vec3(hull.vertices[hull.triangles[i + 1]]) - apex;
    const Vec3 c = Vec3(hull.vertices[hull.triangles[i + 2]]) - apex;
    const double six = glm::dot(a, glm::cross(b, c));
    sum += six * (a + b + c) / 4.0;
    volume += six;
    size += std::abs(six);
  }
  for (const Vec3f& v : hull.vertices)
    vertices += Vec3(v) / static_cast<double>(hull.vertices.size());
  return volume > 1e-6 * size ? apex + sum / volume : vertices;
}

/// The pivot in scene metres before the subject is placed; \p base is scene_from_world().
Vec3 pivot_of(const Mesh& mesh, const SubjectPlacement& placement, const Mat4& base) {
  switch (placement.pivot) {
    case Pivot::rig_origin:
      return Vec3(base[3]);
    case Pivot::point:
      return placement.pivot_point;
    case Pivot::centroid:
      return Vec3(base * Vec4(centroid(mesh.hull) + mesh.hull.origin, 1.0));
    case Pivot::box:
      break;
  }
  Vec3 low(std::numeric_limits<double>::max()), high(-low);
  for (const Vec3f& v : mesh.hull.vertices) {
    const Vec3 p(base * Vec4(Vec3(v) + mesh.hull.origin, 1.0));
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return 0.5 * (low + high);
}

}  // namespace

Mat4 place_in_scene(const Mesh& mesh, const SubjectPlacement& placement) {
  const Mat4 base = scene_from_world(mesh.up, mesh.metres_per_unit);
  if (mesh.hull.vertices.empty()) return base;
  const Vec3 pivot = pivot_of(mesh, placement, base);
  Mat4 m = glm::translate(Mat4(1.0), pivot + placement.translate) * rotation_of(placement.rotate);
  m = glm::scale(m, Vec3(placement.scale));
  return glm::translate(m, -pivot) * base;
}

PixelRays reflected(const PixelRays& rays, const Vec3f& normal) {
  PixelRays out;
  out.x = glm::reflect(rays.x, normal);
  out.y = glm::reflect(rays.y, normal);
  out.origin = glm::reflect(rays.origin, normal);
  return out;
}

Rectangle screen_rectangle(std::span<const Vec3> points, const Mat4& clip_from_scene, int width,
                           int height) {
  std::vector<Vec4> clip;
  for (const Vec3& p : points) clip.push_back(clip_from_scene * Vec4(p, 1.0));
  Extent extent;
  for (const Vec4& a : clip) {
    if (a.w < eye_plane) continue;
    extent.add(a);
    for (const Vec4& b : clip)
      if (b.w < eye_plane) extent.add(glm::mix(a, b, (a.w - eye_plane) / (a.w - b.w)));
  }
  return extent.pixels(width, height);
}

Rectangle screen_rectangle(std::span<const Vec3f> points, const Mat4& clip_from_scene, int width,
                           int height) {
  Extent extent;
  bool in_front = false, behind = false;
  for (const Vec3f& p : points) {
    const Vec4 clip = clip_from_scene * Vec4(Vec3(p), 1.0);
    if (clip.w < eye_plane) {
      behind = true;
    } else {
      in_front = true;
      extent.add(clip);
    }
  }
  if (in_front && behind) return {0, 0, width, height};
  return extent.pixels(width, height);
}

Rectangle intersection(const Rectangle& a, const Rectangle& b) {
  const int x0 = std::max(a.x, b.x), x1 = std::min(a.x + a.width, b.x + b.width);
  const int y0 = std::max(a.y, b.y), y1 = std::min(a.y + a.height, b.y + b.height);
  return x1 > x0 && y1 > y0 ? Rectangle{x0, y0, x1 - x0, y1 - y0} : Rectangle{};
}

Rectangle bounding(const Rectangle& a, const Rectangle& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  const int x0 = std::min(a.x, b.x), x1 = std::max(a.x + a.width, b.x + b.width);
  const int y0 = std::min(a.y, b.y), y1 = std::max(a.y + a.height, b.y + b.height);
  return {x0, y0, x1 - x0, y1 - y0};
}

Bounds bounds_of(std::span<const Vec3f> points) {
  if (points.empty()) return {};
  Vec3f low = points.front(), high = low;
  for (const Vec3f& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return {Vec3(low), Vec3(high)};
}

std::vector<Vec3> corners(const Bounds& bounds) {
  std::vector<Vec3> out;
  for (int i = 0; i < 8; ++i) {
    out.emplace_back(i & 1 ? bounds.max.x : bounds.min.x, i & 2 ? bounds.max.y : bounds.min.y,
                     i & 4 ? bounds.max.z : bounds.min.z);
  }
  return out;
}

}  // namespace polyhull
