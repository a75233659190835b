// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/view_renderer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "view/view_rays.h"

namespace polyhull {
namespace {

constexpr int tile = 16;
constexpr std::size_t edge_rays = 8;

/// Eight places in a pixel, each alone in its row and column of an 8 x 8 board.
constexpr std::array<Vec2f, edge_rays> places = {
    Vec2f{0.0625f, 0.3125f}, {0.1875f, 0.8125f}, {0.3125f, 0.0625f}, {0.4375f, 0.5625f},
    {0.5625f, 0.9375f},      {0.6875f, 0.1875f}, {0.8125f, 0.6875f}, {0.9375f, 0.4375f}};

}  // namespace

void render_view(const TracedScene& scene, const LightCache& light, const Camera& camera,
                 const ViewOptions& options, std::span<Vec3f> picture, ViewStatistics* statistics) {
  const ViewRays view(scene, light, camera, options);
  const int width = camera.width, height = camera.height;
  std::vector<std::array<std::uint8_t, 4>> seen(picture.size());  // sRGB, for comparing neighbours
  const int columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
  std::atomic<std::uint64_t> rays = 0;
  parallel_for(static_cast<std::size_t>(columns) * rows, 4, options.threads,
               [&](std::size_t begin, std::size_t end) {
                 RayWork work;
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
  parallel_each(static_cast<std::size_t>(height), 8, options.threads, [&](std::size_t y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      bool edge = false;
      const auto compare = [&](std::size_t j) {
        for (int k = 0; k < 3; ++k) edge |= std::abs(seen[i][k] - seen[j][k]) > contrast;
      };
      if (x > 0) compare(i - 1);
      if (x + 1 < width) compare(i + 1);
      if (y > 0) compare(i - width);
      if (y + 1 < static_cast<std::size_t>(height)) compare(i + width);
      if (edge) edges[y].push_back(static_cast<std::uint32_t>(i));
    }
  });
  std::vector<std::uint32_t> wanted;
  for (const auto& row : edges) wanted.insert(wanted.end(), row.begin(), row.end());
  constexpr std::size_t pixels = ray_batch / edge_rays;
  parallel_for((wanted.size() + pixels - 1) / pixels, 4, options.threads,
               [&](std::size_t begin, std::size_t end) {
                 RayWork work;
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
