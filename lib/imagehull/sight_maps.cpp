// SPDX-License-Identifier: LGPL-2.1-or-later
#include "imagehull/sight_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/thread_pool.h"
#include "texture/occlusion_map.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

constexpr int tile = ImageHull::lanes;  // texels on a side

/// The directions through the pinhole pixels around texel (0, 0), of length 1 along the camera's axis.
struct TexelRays {
  Vec3f first, x, y;
  TexelRays(const Camera& camera, const OcclusionMap& map)
      : first(camera.ray({map.x, map.y})),
        x(camera.ray({map.x + map.step, map.y}) - camera.ray({map.x, map.y})),
        y(camera.ray({map.x, map.y + map.step}) - camera.ray({map.x, map.y})) {}
  Vec3f at(int i, int j) const {
    return first + static_cast<float>(i) * x + static_cast<float>(j) * y;
  }
};

struct Work {
  ImageHull::Bundle bundle;
  ImageHull::Scratch scratch;
  std::vector<float> inverse;
};

void look(const ImageHull& hull, const ImageHull::Origin& origin, const TexelRays& rays, int left,
          int top, const DepthGrid& grid, Work& work) {
  const int right = std::min(left + tile, grid.width), bottom = std::min(top + tile, grid.height);
  hull.gather(
      origin,
      {rays.at(left, top), rays.at(right, top), rays.at(left, bottom), rays.at(right, bottom)},
      work.bundle);
  if (work.bundle.empty) return;
  float near[ImageHull::lanes];
  std::fill_n(near, ImageHull::lanes, std::numeric_limits<float>::infinity());
  for (int y = top; y < bottom; ++y) {
    ImageHull::Directions directions;
    for (int i = 0; i < tile; ++i) {
      const Vec3f way = rays.at(std::min(left + i, right - 1), y);
      directions.x[i] = way.x;
      directions.y[i] = way.y;
      directions.z[i] = way.z;
    }
    ImageHull::Hits hits;
    hull.enter(origin, work.bundle, directions, near, work.scratch, hits);
    std::copy_n(hits.inverse, right - left,
                grid.inverse + static_cast<std::ptrdiff_t>(y) * grid.stride + left);
  }
}

OcclusionMap sight_map(const ImageHull& hull, const Silhouette& view, Work& work) {
  PictureBounds bounds;
  for (const Vec2f& p : view.rings->points) bounds.add(p.x, p.y, 1.0f);
  OcclusionMap map = lay_out_map(bounds, *view.camera, sight_map_size);
  if (map.width <= 0) return map;
  DepthGrid grid{map.width, map.height, map.width + DepthGrid::padding, nullptr};
  work.inverse.assign(static_cast<std::size_t>(grid.stride) * grid.height, 0.0f);
  grid.inverse = work.inverse.data();
  const ImageHull::Origin origin = hull.from(view.camera->centre());
  const TexelRays rays(*view.camera, map);
  for (int top = 0; top < grid.height; top += tile)
    for (int left = 0; left < grid.width; left += tile)
      look(hull, origin, rays, left, top, grid, work);
  float nearest = 0.0f, farthest = std::numeric_limits<float>::max();
  for (const float inverse : work.inverse)
    if (inverse > 0.0f) {
      nearest = std::max(nearest, inverse);
      farthest = std::min(farthest, inverse);
    }
  if (nearest == 0.0f) return {};
  map.near = 1.0f / nearest;
  map.far = std::max(1.0f / farthest, std::nextafter(map.near, std::numeric_limits<float>::max()));
  finish_map(grid, 1, *view.camera, TextureSettings{}.fade_width, map);
  return map;
}

}  // namespace

std::vector<OcclusionMap> sight_maps(const ImageHull& hull, std::span<const Silhouette> views,
                                     std::span<const std::uint8_t> wanted) {
  std::vector<OcclusionMap> maps(views.size());
  if (hull.empty()) return maps;
  parallel_for(views.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    Work work;
    for (std::size_t k = begin; k < end; ++k)
      if (wanted[k]) maps[k] = sight_map(hull, views[k], work);
  });
  return maps;
}

}  // namespace polyhull
