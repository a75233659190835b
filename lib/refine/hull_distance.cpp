// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/hull_distance.h"

#include <algorithm>

#include "base/thread_pool.h"

namespace polyhull::refine {

PictureBox ContactView::box_of(const Vec3f& low, const Vec3f& high) const {
  PictureBox box{Vec2f(1e30f), Vec2f(-1e30f)};
  for (int k = 0; k < 8; ++k) {
    const Vec3f at =
        project({k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z});
    if (!(at.z > 0.1f)) return {};
    box.low = glm::min(box.low, Vec2f(at));
    box.high = glm::max(box.high, Vec2f(at));
  }
  return box;
}

float HullDistance::from_bounds(const Vec3f& point) const {
  const Vec3f above = point - low, below = high - point;
  return std::min({above.x, above.y, above.z, below.x, below.y, below.z});
}

float HullDistance::rough(const Vec3f& point, float enough) const {
  float least = from_bounds(point);
  for (const ContactView& view : views) {
    const Vec3f at = view.project(point);
    if (!(at.z > 0.0f)) return -1e3f;
    least = std::min(least, view.coarse.at(at.x, at.y, view.beyond) * at.z / view.focal);
    if (least < enough) break;
  }
  return least;
}

float HullDistance::exact(const Vec3f& point, float enough) const {
  float least = from_bounds(point);
  for (const ContactView& view : views) {
    const Vec3f at = view.project(point);
    if (!(at.z > 0.0f)) return -1e3f;
    least = std::min(least, view.fine.at(at.x, at.y, view.beyond) * at.z / view.focal);
    if (least < enough) break;
  }
  return least;
}

MapView ContactView::look(const SilhouetteMap& map) const {
  static constexpr float nothing[4] = {};
  MapView view;
  std::copy_n(&pixel[0][0], 12, &view.pixel[0][0]);
  view.by_focal = 1.0f / focal;
  view.beyond = beyond;
  view.left = map.left;
  view.top = map.top;
  view.by_texel = 1.0f / map.texel;
  view.last_x = static_cast<float>(std::max(0, map.width - 1));
  view.last_y = static_cast<float>(std::max(0, map.height - 1));
  view.most_x = std::max(0, map.width - 2);
  view.most_y = std::max(0, map.height - 2);
  view.stride = map.width;
  view.distance = map.distance.empty() ? nothing : map.distance.data();
  return view;
}

HullRows::HullRows(const HullDistance& hull, By by) : hull_(hull) {
  for (const ContactView& view : hull.views)
    views_.push_back(view.look(by == By::rough ? view.coarse : view.fine));
}

void HullRows::find(const Grid& grid, float y, float z, std::span<const float> x,
                    float* out) const {
  const Vec3f begin = grid.low + grid.cell * Vec3f(0.0f, y, z);
  const RowPoints points{
      {begin.x, begin.y, begin.z}, grid.cell, x.data(), static_cast<int>(x.size())};
  const Vec3f low = hull_.low, high = hull_.high;
  const float across = std::min(std::min(begin.y - low.y, high.y - begin.y),
                                std::min(begin.z - low.z, high.z - begin.z));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const float at = begin.x + grid.cell * x[i];
    out[i] = std::min(across, std::min(at - low.x, high.x - at));
  }
  for (const MapView& view : views_) loops().inside(view, points, out);
}

void HullDistance::fill(const Grid& grid, float least, std::vector<float>& values,
                        std::vector<Extent>& rows, int threads) const {
  constexpr int block = 4;
  constexpr float half = 0.5f * static_cast<float>(block - 1);
  values.resize(grid.size());
  rows.resize(static_cast<std::size_t>(grid.ny) * grid.nz);
  // Far away a map's distance over the depth changes faster than the place: some slack.
  const float far = least - 1.2f * grid.cell * half * 1.7321f;
  const int blocks = (grid.nx + block - 1) / block, lines = (grid.ny + block - 1) / block;
  const HullRows hull(*this, HullRows::By::rough);
  const auto fill_line = [&](int y0, int z0) {
    // Of a line of blocks along x: first what the middles say, then the nodes of those near enough.
    std::vector<float> x(static_cast<std::size_t>(blocks)), found(grid.row());
    for (int b = 0; b < blocks; ++b) x[b] = static_cast<float>(block * b) + half;
    hull.find(grid, static_cast<float>(y0) + half, static_cast<float>(z0) + half, x, found.data());
    x.clear();
    for (int b = 0; b < blocks; ++b)
      for (int i = block * b; found[b] >= far && i < std::min(grid.nx, block * (b + 1)); ++i)
        x.push_back(static_cast<float>(i));
    for (int z = z0; z < std::min(z0 + block, grid.nz); ++z)
      for (int y = y0; y < std::min(y0 + block, grid.ny); ++y) {
        float* row = values.data() + grid.node(0, y, z);
        std::fill_n(row, grid.nx, least);
        Extent& extent = rows[static_cast<std::size_t>(z) * grid.ny + y];
        extent = {};
        if (x.empty()) continue;
        extent = {static_cast<int>(x.front()), static_cast<int>(x.back()) + 1};
        hull.find(grid, static_cast<float>(y), static_cast<float>(z), x, found.data());
        for (std::size_t i = 0; i < x.size(); ++i)
          row[static_cast<int>(x[i])] = std::clamp(found[i], least, deepest);
      }
  };
  const auto count = static_cast<std::size_t>(lines) * ((grid.nz + block - 1) / block);
  parallel_for(count, 8, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l)
      fill_line(static_cast<int>(l) % lines * block, static_cast<int>(l) / lines * block);
  });
}

}  // namespace polyhull::refine
