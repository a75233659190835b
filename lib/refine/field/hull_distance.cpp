// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/hull_distance.h"

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
  for (const MapView& view : views_) Loops::best().inside(view, points, out);
}

namespace {

/// The first nodes, along x, of blocks of a line of them, and what they are looked at with.
struct NearBlocks {
  std::vector<int> first;
  std::vector<float> places, found;

  /// Keeps of blocks of \p size nodes a side, from row (y, z) on, those that may have a node with at
  /// least \p least.
  void keep_near(const HullRows& hull, const Grid& grid, int size, int y, int z, float least) {
    const float half = 0.5f * static_cast<float>(size - 1);
    // Far away a map's distance over the depth changes faster than the place: some slack.
    const float far = least - 1.2f * grid.cell * half * 1.7321f;
    look(hull, grid, static_cast<float>(y) + half, static_cast<float>(z) + half, half);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < first.size(); ++i)
      if (found[i] >= far) first[kept++] = first[i];
    first.resize(kept);
  }
  /// Finds H at the nodes, \p shift further along x, of row (y, z).
  void look(const HullRows& hull, const Grid& grid, float y, float z, float shift) {
    places.clear();
    for (const int x : first) places.push_back(static_cast<float>(x) + shift);
    found.resize(places.size());
    hull.find(grid, y, z, places, found.data());
  }
  /// Blocks of half the \p size of \p blocks.
  void halve(const NearBlocks& blocks, int size, int nx) {
    first.clear();
    for (const int from : blocks.first)
      for (int x = from; x < std::min(nx, from + size); x += size / 2) first.push_back(x);
  }
};

}  // namespace

void HullDistance::fill(const Grid& grid, float least, std::vector<float>& values,
                        std::vector<Extent>& rows, int threads) const {
  constexpr int block = 4;
  values.resize(grid.size());
  rows.resize(static_cast<std::size_t>(grid.ny) * grid.nz);
  const HullRows hull(*this, HullRows::By::rough);
  const auto fill_row = [&](int y, int z, NearBlocks& nodes) {
    float* row = values.data() + grid.node(0, y, z);
    std::fill_n(row, grid.nx, least);
    Extent& extent = rows[static_cast<std::size_t>(z) * grid.ny + y];
    extent = {};
    if (nodes.first.empty()) return;
    extent = {nodes.first.front(), nodes.first.back() + 1};
    nodes.look(hull, grid, static_cast<float>(y), static_cast<float>(z), 0.0f);
    for (std::size_t i = 0; i < nodes.first.size(); ++i)
      row[nodes.first[i]] = std::clamp(nodes.found[i], least, deepest);
  };
  const auto fill_line = [&](int y0, int z0, NearBlocks(&of)[3]) {
    of[0].first.clear();
    for (int x = 0; x < grid.nx; x += block) of[0].first.push_back(x);
    of[0].keep_near(hull, grid, block, y0, z0, least);
    for (int z1 = z0; z1 < std::min(z0 + block, grid.nz); z1 += 2)
      for (int y1 = y0; y1 < std::min(y0 + block, grid.ny); y1 += 2) {
        of[1].halve(of[0], block, grid.nx);
        of[1].keep_near(hull, grid, block / 2, y1, z1, least);
        of[2].halve(of[1], block / 2, grid.nx);
        for (int z = z1; z < std::min(z1 + 2, grid.nz); ++z)
          for (int y = y1; y < std::min(y1 + 2, grid.ny); ++y) fill_row(y, z, of[2]);
      }
  };
  const int lines = (grid.ny + block - 1) / block;
  const auto count = static_cast<std::size_t>(lines) * ((grid.nz + block - 1) / block);
  parallel_for(count, 8, threads, [&](std::size_t begin, std::size_t end) {
    NearBlocks of[3];  // of four nodes a side, of two, and nodes
    for (std::size_t l = begin; l < end; ++l)
      fill_line(static_cast<int>(l) % lines * block, static_cast<int>(l) / lines * block, of);
  });
}

}  // namespace polyhull::refine
