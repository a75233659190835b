// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/plan/sights.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "base/thread_pool.h"
#include "studio/cameras/coverage_raster.h"

namespace polyhull {
namespace {

/// A matte and the depths of one camera's picture.
struct Shadow {
  int width = 0, height = 0;
  std::vector<float> coverage, depth;
};

Shadow shadow_of(const StageBody& body, const Camera& camera) {
  Shadow out{camera.width, camera.height, {}, {}};
  out.coverage.resize(static_cast<std::size_t>(out.width) * out.height);
  out.depth.resize(out.coverage.size());
  CoverageRaster::Mesh mesh;
  mesh.positions = body.positions;
  mesh.triangles = body.triangles;
  CoverageRaster().draw(camera, mesh, [&](int y, std::span<const CoveredPixel> pixels) {
    for (const CoveredPixel& pixel : pixels) {
      const std::size_t at = static_cast<std::size_t>(y) * out.width + pixel.x;
      out.coverage[at] = pixel.coverage;
      out.depth[at] = pixel.centre_depth;
    }
  });
  return out;
}

/// Whether the pixel is in the picture with its four neighbours around it.
bool inside(const Shadow& shadow, const Vec2& p) {
  return p.x >= 0.0 && p.y >= 0.0 && p.x < shadow.width - 1 && p.y < shadow.height - 1;
}

/// The coverage between four pixels.
double coverage_at(const Shadow& shadow, const Vec2& p) {
  const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
  const double u = p.x - x, v = p.y - y;
  const float* c = shadow.coverage.data() + static_cast<std::size_t>(y) * shadow.width + x;
  return (1.0 - v) * ((1.0 - u) * c[0] + u * c[1]) +
         v * ((1.0 - u) * c[shadow.width] + u * c[shadow.width + 1]);
}

std::uint8_t empty_of(const Camera& camera, const Shadow& shadow, const SurfacePoint& point) {
  std::uint8_t empty = 0;
  for (std::size_t k = 0; k < probe_heights.size(); ++k) {
    const auto pixel = camera.project(point.at + 1e-3 * probe_heights[k] * point.normal);
    if (pixel && inside(shadow, *pixel) && coverage_at(shadow, *pixel) < 0.5) {
      empty = static_cast<std::uint8_t>(empty | 1u << k);
    }
  }
  return empty;
}

std::uint8_t facing_of(const Camera& camera, const Shadow& shadow, const SurfacePoint& point) {
  const Vec3 to = camera.centre() - point.at;
  const double cosine = glm::dot(point.normal, to) / glm::length(to);
  const auto pixel = camera.project(point.at);
  if (cosine <= 0.0 || !pixel || !inside(shadow, *pixel)) return 0;
  const auto x = static_cast<std::size_t>(std::lround(pixel->x));
  const auto y = static_cast<std::size_t>(std::lround(pixel->y));
  const double seen = shadow.depth[y * static_cast<std::size_t>(shadow.width) + x];
  // Within a pixel the surface's depth changes by as much as the view grazes it.
  const double z = camera.to_camera(point.at).z;
  const double slack = 0.01 + z / camera.K[0][0] / std::max(cosine, 0.1);
  return seen > 0.0 && z <= seen + slack ? static_cast<std::uint8_t>(std::lround(255.0 * cosine))
                                         : 0;
}

/// Millimetres by the probes that are seen to be empty: half way from the last full one to the first
/// empty one.
const std::array<float, 256>& heights() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> out{};
    for (unsigned mask = 0; mask < 256; ++mask) {
      const auto first = static_cast<std::size_t>(std::countr_zero(mask | 0x100u));
      const double full = first > 0 ? probe_heights[first - 1] : 0.0;
      const double empty = first < 8 ? probe_heights[first] : 2.0 * probe_heights.back();
      out[mask] = static_cast<float>(0.5 * (full + empty));
    }
    return out;
  }();
  return table;
}

/// The share of a point's colour that is missing where it is seen at such an angle: all where the
/// view grazes by less than 6 degrees, none from 24 degrees on.
const std::array<float, 256>& misses() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> out{};
    for (int i = 0; i < 256; ++i) {
      out[i] = std::clamp((0.4f - static_cast<float>(i) / 255.0f) / 0.3f, 0.0f, 1.0f);
    }
    return out;
  }();
  return table;
}

}  // namespace

std::vector<SurfacePoint> surface_points(const std::vector<StageBody>& bodies, std::size_t count) {
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<SurfacePoint> points;
  for (std::uint32_t b = 0; b < bodies.size(); ++b) {
    const TriangleSurface surface = bodies[b].surface();
    std::vector<double> areas;
    double sum = 0.0;
    for (const auto& t : surface.triangles) {
      const auto& v = surface.vertices;
      sum += glm::length(glm::cross(v[t[1]] - v[t[0]], v[t[2]] - v[t[0]]));
      areas.push_back(sum);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const double place = (static_cast<double>(i) + unit()) / static_cast<double>(count) * sum;
      const auto found = std::upper_bound(areas.begin(), areas.end() - 1, place);
      const auto& t = surface.triangles[static_cast<std::size_t>(found - areas.begin())];
      double u = unit(), v = unit();
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      const auto mix = [&](const auto& of) {
        return (1.0 - u - v) * Vec3(of[t[0]]) + u * Vec3(of[t[1]]) + v * Vec3(of[t[2]]);
      };
      points.push_back({mix(bodies[b].positions), glm::normalize(mix(bodies[b].normals)), b});
    }
  }
  return points;
}

Sight no_sight(std::size_t points) {
  return {std::vector<std::uint8_t>(points), std::vector<std::uint8_t>(points)};
}

void add(const Sight& other, Sight& sight) {
  for (std::size_t i = 0; i < sight.empty.size(); ++i) {
    sight.empty[i] |= other.empty[i];
    sight.facing[i] = std::max(sight.facing[i], other.facing[i]);
  }
}

std::vector<Sight> sights_of(const std::vector<Camera>& cameras,
                             const std::vector<StageBody>& bodies,
                             const std::vector<SurfacePoint>& points) {
  std::vector<Sight> sights(cameras.size(), no_sight(points.size()));
  parallel_each(cameras.size(), 1, 0, [&](std::size_t c) {
    for (std::uint32_t b = 0; b < bodies.size(); ++b) {
      const Shadow shadow = shadow_of(bodies[b], cameras[c]);
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (points[i].body != b) continue;
        sights[c].empty[i] = empty_of(cameras[c], shadow, points[i]);
        sights[c].facing[i] = facing_of(cameras[c], shadow, points[i]);
      }
    }
  });
  return sights;
}

SightError error_of(const Sight& sight) {
  SightError error;
  const auto count = static_cast<double>(sight.empty.size());
  for (std::size_t i = 0; i < sight.empty.size(); ++i) {
    error.hull += heights()[sight.empty[i]] / count;
    error.unseen += misses()[sight.facing[i]] / count;
  }
  return error;
}

double cost_of(const Sight& a, const Sight& b) {
  const std::array<float, 256>& height = heights();
  const std::array<float, 256>& miss = misses();
  double hull = 0.0, unseen = 0.0;
  for (std::size_t i = 0; i < a.empty.size(); ++i) {
    hull += height[a.empty[i] | b.empty[i]];
    unseen += miss[std::max(a.facing[i], b.facing[i])];
  }
  return (hull + SightError::unseen_mm * unseen) / static_cast<double>(a.empty.size());
}

}  // namespace polyhull
