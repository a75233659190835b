// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/texture_hull.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "texture/occlusion_map.h"
#include "texture/visibility.h"

namespace polyhull {
namespace {

void check(const Hull& hull, std::span<const Camera> cameras) {
  if (cameras.size() > 64) {
    throw Error(Error::Kind::unsupported, "A mesh has {} views; texturing handles at most 64.",
                cameras.size());
  }
  if (hull.triangles.size() % 3 != 0) {
    throw Error(Error::Kind::bad_input,
                "A mesh has {} triangle corners, which is not a multiple of three.",
                hull.triangles.size());
  }
  for (const std::uint32_t index : hull.triangles) {
    if (index >= hull.vertices.size()) {
      throw Error(Error::Kind::bad_input, "A mesh has vertex index {} but only {} vertices.", index,
                  hull.vertices.size());
    }
  }
  for (const Vec3f& v : hull.vertices)
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw Error(Error::Kind::bad_input, "A mesh has a vertex that is not finite.");
}

/// Twice the area times the unit normal, per triangle.
std::vector<Vec3> area_normals(const Hull& hull) {
  std::vector<Vec3> normals(hull.triangles.size() / 3);
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const Vec3 a(hull.vertices[hull.triangles[3 * f]]);
    const Vec3 b(hull.vertices[hull.triangles[3 * f + 1]]);
    const Vec3 c(hull.vertices[hull.triangles[3 * f + 2]]);
    normals[f] = glm::cross(b - a, c - a);
  }
  return normals;
}

std::vector<Vec3f> vertex_normals(const Hull& hull, const std::vector<Vec3>& area_normal) {
  std::vector<Vec3> sums(hull.vertices.size(), Vec3(0.0));
  for (std::size_t f = 0; f < area_normal.size(); ++f)
    for (int i = 0; i < 3; ++i) sums[hull.triangles[3 * f + i]] += area_normal[f];
  std::vector<Vec3f> normals(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    const double length = glm::length(sums[v]);
    normals[v] = length > 0.0 ? Vec3f(sums[v] / length) : Vec3f(0.0f, 1.0f, 0.0f);
  }
  return normals;
}

void choose(const Hull& hull, std::span<const Camera> cameras, const std::vector<Vec3>& area_normal,
            const std::vector<float>& seen, Texturing& out) {
  const std::size_t views = cameras.size();
  const std::size_t count = area_normal.size();
  const std::vector<Vec3> centres = relative_centres(hull, cameras);
  out.visible.assign(count, 0);
  out.best.assign(count, -1);
  for (std::size_t f = 0; f < count; ++f) {
    const Vec3 middle = (Vec3(hull.vertices[hull.triangles[3 * f]]) +
                         Vec3(hull.vertices[hull.triangles[3 * f + 1]]) +
                         Vec3(hull.vertices[hull.triangles[3 * f + 2]])) /
                        3.0;
    double best = 0.0;
    for (std::size_t k = 0; k < views; ++k) {
      if (seen[f * views + k] < 0.5f) continue;
      out.visible[f] |= std::uint64_t{1} << k;
      const double cosine = glm::dot(area_normal[f], glm::normalize(centres[k] - middle));
      if (cosine > best) {
        best = cosine;
        out.best[f] = static_cast<std::int8_t>(k);
      }
    }
  }
}

void weigh(const Hull& hull, std::span<const Camera> cameras, const std::vector<Vec3>& area_normal,
           const std::vector<float>& seen, Texturing& out) {
  const std::size_t views = cameras.size();
  const std::vector<Vec3> centres = relative_centres(hull, cameras);
  const std::size_t entries = hull.vertices.size() * views;
  std::vector<float> facing(entries, 0.0f);
  out.weights.assign(entries, 0.0f);
  for (std::size_t f = 0; f < area_normal.size(); ++f) {
    const Vec3 corner(hull.vertices[hull.triangles[3 * f]]);
    for (std::size_t k = 0; k < views; ++k) {
      if (glm::dot(area_normal[f], centres[k] - corner) <= 0.0) continue;
      const auto area = static_cast<float>(glm::length(area_normal[f]));
      for (int i = 0; i < 3; ++i) {
        const std::size_t entry = hull.triangles[3 * f + i] * views + k;
        facing[entry] += area;
        out.weights[entry] += area * seen[f * views + k];
      }
    }
  }
  for (std::size_t v = 0; v < hull.vertices.size(); ++v) {
    for (std::size_t k = 0; k < views; ++k) {
      float& weight = out.weights[v * views + k];
      if (weight == 0.0f) continue;
      weight /= facing[v * views + k];
      if (out.metric == TextureMetric::camera_normal) {
        const Vec3f way = glm::normalize(Vec3f(centres[k] - Vec3(hull.vertices[v])));
        weight *= std::max(0.0f, glm::dot(out.normals[v], way));
      }
    }
  }
}

}  // namespace

Texturing HullTexturer::compute(const Hull& hull, std::span<const Camera> cameras,
                                const TextureSettings& settings) {
  check(hull, cameras);
  Texturing out;
  out.method = settings.method;
  out.metric = settings.metric;
  out.cameras = std::max<std::uint32_t>(settings.cameras, 1);
  out.untextured = settings.untextured;
  if (hull.empty()) return out;

  Stopwatch watch;
  std::vector<float> seen;
  if (settings.occlusion) {
    const std::uint32_t mesh = caster_.add_mesh(hull.vertices, hull.triangles);
    caster_.commit();
    seen = seen_shares(hull, cameras, caster_, true, settings.threads, statistics_.rays);
    caster_.remove_mesh(mesh);
  } else {
    seen = seen_shares(hull, cameras, caster_, false, settings.threads, statistics_.rays);
  }
  statistics_.seconds_visibility = watch.lap();

  const std::vector<Vec3> area_normal = area_normals(hull);
  out.normals = vertex_normals(hull, area_normal);
  choose(hull, cameras, area_normal, seen, out);
  weigh(hull, cameras, area_normal, seen, out);
  statistics_.seconds_weights = watch.lap();

  if (settings.occlusion && settings.method == TextureMethod::blend) {
    out.maps.resize(cameras.size());
    parallel_for(cameras.size(), 1, settings.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        out.maps[k] = draw_occlusion_map(hull, cameras[k], settings.map_size, settings.fade_width);
    });
  }
  statistics_.seconds_maps = watch.lap();
  return out;
}

const Texturing& HullTexturer::texture(const Hull& hull, std::span<const Camera> cameras,
                                       const TextureSettings& settings) {
  statistics_ = {};
  const bool same = made_ && settings == settings_ && hull.origin == hull_.origin &&
                    hull.vertices == hull_.vertices && hull.triangles == hull_.triangles &&
                    triangle_views(hull) == triangle_views(hull_) &&
                    std::equal(cameras.begin(), cameras.end(), cameras_.begin(), cameras_.end());
  statistics_.reused = same;
  if (same) return texturing_;
  made_ = false;
  texturing_ = compute(hull, cameras, settings);
  hull_ = hull;
  cameras_.assign(cameras.begin(), cameras.end());
  settings_ = settings;
  made_ = true;
  return texturing_;
}

Texturing texture_hull(const Hull& hull, std::span<const Camera> cameras,
                       const TextureSettings& settings) {
  return HullTexturer().texture(hull, cameras, settings);
}

}  // namespace polyhull
