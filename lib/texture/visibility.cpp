// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/visibility.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull {
namespace {

// Below this cosine a triangle counts as edge-on: its picture has no width to sample.
constexpr double edge_on = 1e-3;

/// How many points a triangle's size in the picture deserves. Small ones are seen or hidden whole.
int point_count(const Camera& camera, double depth, double longest_edge, double area,
                double cosine) {
  const double scale = camera.K[0][0] / std::max(depth, 1e-12);
  const double edge_pixels = longest_edge * scale;
  const double area_pixels = area * cosine * scale * scale;
  return static_cast<int>(std::clamp(1.0 + edge_pixels / 16.0 + area_pixels / 64.0, 1.0, 32.0));
}

/// Whether the camera's frame holds the picture of the point.
bool in_frame(const Camera& camera, const Vec3& point) {
  const std::optional<Vec2> pixel = camera.project(point);
  return pixel && pixel->x >= -0.5 && pixel->y >= -0.5 && pixel->x <= camera.width - 0.5 &&
         pixel->y <= camera.height - 0.5;
}

/// A triangle that rays were cast for.
struct Asked {
  std::size_t index = 0;
  std::uint32_t rays = 0;    // from its points inside the frame
  std::uint32_t points = 0;  // in all
};

double longest_edge(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  return std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
}

float extent(const Hull& hull) {
  Vec3f low = hull.vertices.front();
  Vec3f high = low;
  for (const Vec3f& v : hull.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  return glm::distance(low, high);
}

}  // namespace

std::vector<Vec3> relative_centres(const Hull& hull, std::span<const Camera> cameras) {
  std::vector<Vec3> centres;
  for (const Camera& camera : cameras) centres.push_back(camera.centre() - hull.origin);
  return centres;
}

std::vector<std::int32_t> triangle_views(const Hull& hull) {
  const std::size_t count = hull.triangles.size() / 3;
  std::vector<std::int32_t> views(count, -1);
  for (const HullFace& face : hull.faces) {
    const std::size_t end = std::min<std::size_t>(
        static_cast<std::size_t>(face.first_triangle) + face.triangle_count, count);
    for (std::size_t f = face.first_triangle; f < end; ++f) views[f] = face.view;
  }
  return views;
}

void spread_points(const Vec3f& a, const Vec3f& b, const Vec3f& c, int count,
                   std::vector<Vec3f>& points) {
  points.clear();
  // The R2 sequence (Roberts 2018), folded into the triangle; its first point is the centroid.
  double u = 1.0 / 3.0;
  double v = 1.0 / 3.0;
  for (int i = 0; i < count; ++i) {
    const bool folded = u + v > 1.0;
    const auto s = static_cast<float>(folded ? 1.0 - u : u);
    const auto t = static_cast<float>(folded ? 1.0 - v : v);
    points.push_back(a + s * (b - a) + t * (c - a));
    u = std::fmod(u + 0.7548776662466927, 1.0);
    v = std::fmod(v + 0.5698402909980532, 1.0);
  }
}

std::vector<float> seen_shares(const Hull& hull, std::span<const Camera> cameras,
                               const RayCaster& caster, bool occlusion, int threads,
                               std::uint64_t& rays) {
  const std::size_t count = hull.triangles.size() / 3;
  const std::size_t views = cameras.size();
  std::vector<float> seen(count * views, 0.0f);
  if (count == 0) return seen;
  const std::vector<Vec3> centres = relative_centres(hull, cameras);
  const std::vector<std::int32_t> own = triangle_views(hull);
  const float offset = 1e-5f * extent(hull);
  std::atomic<std::uint64_t> cast{0};

  // One list of rays per view and piece of the hull: neighbours in it go similar ways.
  constexpr std::size_t grain = 512;
  const std::size_t pieces = (count + grain - 1) / grain;
  parallel_for(pieces * views, 1, threads, [&](std::size_t begin, std::size_t end) {
    std::vector<Vec3f> points;
    std::vector<Ray> list;
    std::vector<std::uint8_t> blocked;
    std::vector<Asked> asked;
    for (std::size_t job = begin; job < end; ++job) {
      const std::size_t k = job % views;
      const std::size_t first = job / views * grain;
      list.clear();
      asked.clear();
      for (std::size_t f = first; f < std::min(first + grain, count); ++f) {
        if (own[f] == static_cast<std::int32_t>(k)) continue;
        const Vec3f& a = hull.vertices[hull.triangles[3 * f]];
        const Vec3f& b = hull.vertices[hull.triangles[3 * f + 1]];
        const Vec3f& c = hull.vertices[hull.triangles[3 * f + 2]];
        const Vec3 cross = glm::cross(Vec3(b) - Vec3(a), Vec3(c) - Vec3(a));
        const double twice_area = glm::length(cross);
        if (twice_area == 0.0) continue;
        const Vec3 normal = cross / twice_area;
        const Vec3 middle = (Vec3(a) + Vec3(b) + Vec3(c)) / 3.0;
        const Vec3 way = centres[k] - middle;
        const double cosine = glm::dot(normal, way) / glm::length(way);
        const double depth = cameras[k].to_camera(middle + hull.origin).z;
        if (!(cosine > edge_on) || !(depth > 0.0)) continue;
        if (!occlusion) {
          seen[f * views + k] = in_frame(cameras[k], middle + hull.origin) ? 1.0f : 0.0f;
          continue;
        }
        const int wanted =
            point_count(cameras[k], depth, longest_edge(a, b, c), 0.5 * twice_area, cosine);
        spread_points(a, b, c, wanted, points);
        std::uint32_t inside = 0;
        for (const Vec3f& point : points) {
          if (!in_frame(cameras[k], Vec3(point) + hull.origin)) continue;
          const Vec3f origin = point + offset * Vec3f(normal);
          list.push_back({origin, 0.0f, Vec3f(centres[k]) - origin, 1.0f});
          ++inside;
        }
        asked.push_back({f, inside, static_cast<std::uint32_t>(wanted)});
      }
      blocked.assign(list.size(), 0);
      caster.occluded(list, blocked);
      cast += list.size();
      std::size_t next = 0;
      for (const Asked& triangle : asked) {
        std::uint32_t free = 0;
        for (std::uint32_t i = 0; i < triangle.rays; ++i) free += blocked[next++] ? 0 : 1;
        seen[triangle.index * views + k] =
            static_cast<float>(free) / static_cast<float>(triangle.points);
      }
    }
  });
  rays = cast;
  return seen;
}

}  // namespace polyhull
