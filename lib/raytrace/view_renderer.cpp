// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/view_renderer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr float least_throughput = 1.0f / 1024.0f;
constexpr std::size_t batch = 256;  // rays shaded together: a tile of 16 x 16, or 32 pixels' edges
constexpr int tile = 16;
constexpr std::size_t edge_rays = 8;

/// Eight places in a pixel, each alone in its row and column of an 8 x 8 board.
constexpr std::array<Vec2f, edge_rays> places = {
    Vec2f{0.0625f, 0.3125f}, {0.1875f, 0.8125f}, {0.3125f, 0.0625f}, {0.4375f, 0.5625f},
    {0.5625f, 0.9375f},      {0.6875f, 0.1875f}, {0.8125f, 0.6875f}, {0.9375f, 0.4375f}};

/// A ray on its way, and how it changes to the next pixels. After a planar mirror the origin is the
/// mirrored eye, so that distances along it stay distances from the eye.
struct Way {
  Ray ray;
  Vec3f dx, dy;
  Vec3f throughput;
  std::uint32_t slot;  // whose value it adds to
};

struct Work {
  std::array<Way, batch> ways;
  std::array<Ray, batch> rays;
  std::array<RayHit, batch> hits;
  std::array<Vec3f, batch> values;
};

class View {
 public:
  View(const TracedScene& scene, const LightCache& light, const Camera& camera,
       const ViewOptions& options)
      : scene_(scene), light_(light), camera_(camera), options_(options) {
    exposure_ = scene.scene().exposure;
    eye_ = Vec3f(camera.centre());
    distorted_ = camera.has_distortion();
    // Pinhole rays are linear in the pixel.
    corner_ = Vec3f(camera.ray({0.0, 0.0}));
    step_x_ = Vec3f(camera.ray({1.0, 0.0}) - camera.ray({0.0, 0.0}));
    step_y_ = Vec3f(camera.ray({0.0, 1.0}) - camera.ray({0.0, 0.0}));
  }

  Way way(float x, float y, std::uint32_t slot) const {
    Way out;
    if (distorted_) {
      const Vec2 ideal = camera_.undistort({x, y});
      x = static_cast<float>(ideal.x);
      y = static_cast<float>(ideal.y);
    }
    out.ray.origin = eye_;
    out.ray.direction = corner_ + x * step_x_ + y * step_y_;
    out.dx = step_x_;
    out.dy = step_y_;
    out.throughput = Vec3f(1.0f);
    out.slot = slot;
    return out;
  }

  /// Follows the first \p count ways of \p work to their ends; values gets the picture values.
  /// Returns the number of rays.
  std::uint64_t follow(Work& work, std::size_t count) const {
    std::fill_n(work.values.begin(), count, Vec3f(0.0f));
    std::uint64_t rays = 0;
    for (int depth = 0; count > 0; ++depth) {
      for (std::size_t i = 0; i < count; ++i) work.rays[i] = work.ways[i].ray;
      scene_.caster().intersect(std::span(work.rays).first(count),
                                std::span(work.hits).first(count));
      rays += count;
      std::size_t onward = 0;
      for (std::size_t i = 0; i < count; ++i) {
        // Mirror ways are written in front of those still to read.
        Way next;
        if (shade(work.ways[i], work.hits[i], work.values[work.ways[i].slot], next) &&
            depth < options_.mirror_depth)
          work.ways[onward++] = next;
      }
      count = onward;
    }
    return rays;
  }

 private:
  /// Adds what a way sees to \p value; true if a mirror sends it on to \p next.
  bool shade(const Way& way, const RayHit& hit, Vec3f& value, Way& next) const {
    if (!hit.hit()) return false;
    if (scene_.is_subject(hit)) {
      value += way.throughput * scene_.subject_colour(hit, glm::normalize(way.ray.direction));
      return false;
    }
    const Surface surface = scene_.plain_surface(way.ray, hit);
    if (surface.emission != Vec3f(0.0f))
      value += way.throughput * glm::min(exposure_ * surface.emission, Vec3f(1.0f));
    const bool mirror = surface.material->is_mirror();
    Vec3f f(0.0f), diffuse(1.0f);
    if (mirror) {
      const float cosine =
          -glm::dot(surface.normal, way.ray.direction) / glm::length(way.ray.direction);
      f = fresnel(surface.material->f0(), cosine);
      diffuse = (Vec3f(1.0f) - f) * (1.0f - surface.material->metallic);
    }
    if (diffuse != Vec3f(0.0f)) {
      const Vec3f colour =
          scene_.base_colour(hit, way.ray.origin, way.ray.direction, way.dx, way.dy);
      value += way.throughput * diffuse * colour * light_.irradiance(hit, surface.back) *
               (exposure_ / pi);
    }
    if (!mirror) return false;
    next.throughput = way.throughput * f;
    if (std::max({next.throughput.x, next.throughput.y, next.throughput.z}) < least_throughput)
      return false;
    const Vec3f n = surface.normal;
    next.slot = way.slot;
    next.ray.direction = glm::reflect(way.ray.direction, n);
    next.ray.origin = surface.point - hit.distance * next.ray.direction;
    next.ray.near = hit.distance + scene_.epsilon() / glm::length(next.ray.direction);
    next.ray.far = std::numeric_limits<float>::infinity();
    next.dx = glm::reflect(way.dx, n);
    next.dy = glm::reflect(way.dy, n);
    return true;
  }

  const TracedScene& scene_;
  const LightCache& light_;
  const Camera& camera_;
  const ViewOptions& options_;
  float exposure_;
  Vec3f eye_;
  bool distorted_;
  Vec3f corner_, step_x_, step_y_;
};

}  // namespace

void render_view(const TracedScene& scene, const LightCache& light, const Camera& camera,
                 const ViewOptions& options, std::span<Vec3f> picture, ViewStatistics* statistics) {
  const View view(scene, light, camera, options);
  const int width = camera.width, height = camera.height;
  std::vector<std::array<std::uint8_t, 4>> seen(picture.size());  // sRGB, for comparing neighbours
  const int columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
  std::atomic<std::uint64_t> rays = 0;
  parallel_for(static_cast<std::size_t>(columns) * rows, 4, options.threads,
               [&](std::size_t begin, std::size_t end) {
                 Work work;
                 std::uint64_t asked = 0;
                 for (std::size_t t = begin; t < end; ++t) {
                   const int x0 = static_cast<int>(t % columns) * tile;
                   const int y0 = static_cast<int>(t / columns) * tile;
                   const int x1 = std::min(x0 + tile, width), y1 = std::min(y0 + tile, height);
                   std::uint32_t count = 0;
                   for (int y = y0; y < y1; ++y)
                     for (int x = x0; x < x1; ++x, ++count)
                       work.ways[count] =
                           view.way(static_cast<float>(x), static_cast<float>(y), count);
                   asked += view.follow(work, count);
                   count = 0;
                   for (int y = y0; y < y1; ++y) {
                     for (int x = x0; x < x1; ++x) {
                       const std::size_t i = static_cast<std::size_t>(y) * width + x;
                       picture[i] = work.values[count++];
                       for (int k = 0; k < 3; ++k) seen[i][k] = linear_to_srgb(picture[i][k]);
                     }
                   }
                 }
                 rays += asked;
               });

  // Edges are found in the finished first picture only, so the order of work does not matter.
  const int contrast = static_cast<int>(std::lround(255.0f * options.contrast));
  std::vector<std::vector<std::uint32_t>> edges(height);
  parallel_for(static_cast<std::size_t>(height), 8, options.threads,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t y = begin; y < end; ++y) {
                   for (int x = 0; x < width; ++x) {
                     const std::size_t i = y * width + x;
                     bool edge = false;
                     const auto compare = [&](std::size_t j) {
                       for (int k = 0; k < 3; ++k)
                         edge |= std::abs(seen[i][k] - seen[j][k]) > contrast;
                     };
                     if (x > 0) compare(i - 1);
                     if (x + 1 < width) compare(i + 1);
                     if (y > 0) compare(i - width);
                     if (y + 1 < static_cast<std::size_t>(height)) compare(i + width);
                     if (edge) edges[y].push_back(static_cast<std::uint32_t>(i));
                   }
                 }
               });
  std::vector<std::uint32_t> wanted;
  for (const auto& row : edges) wanted.insert(wanted.end(), row.begin(), row.end());
  constexpr std::size_t pixels = batch / edge_rays;
  parallel_for((wanted.size() + pixels - 1) / pixels, 4, options.threads,
               [&](std::size_t begin, std::size_t end) {
                 Work work;
                 std::uint64_t asked = 0;
                 for (std::size_t b = begin; b < end; ++b) {
                   const std::size_t first = b * pixels;
                   const std::size_t last = std::min(first + pixels, wanted.size());
                   std::uint32_t count = 0;
                   for (std::size_t i = first; i < last; ++i) {
                     const auto x = static_cast<float>(wanted[i] % width);
                     const auto y = static_cast<float>(wanted[i] / width);
                     for (const Vec2f& place : places) {
                       work.ways[count] = view.way(x + place.x - 0.5f, y + place.y - 0.5f, count);
                       ++count;
                     }
                   }
                   asked += view.follow(work, count);
                   for (std::size_t i = first; i < last; ++i) {
                     Vec3f sum(0.0f);
                     for (std::size_t k = 0; k < edge_rays; ++k)
                       sum += work.values[(i - first) * edge_rays + k];
                     picture[wanted[i]] = sum / static_cast<float>(edge_rays);
                   }
                 }
                 rays += asked;
               });
  if (statistics) *statistics = {rays, wanted.size()};
}

}  // namespace polyhull
