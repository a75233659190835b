// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/hull_distance.h"

#include "base/thread_pool.h"

namespace polyhull::refine {

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

void HullDistance::fill(const Grid& grid, float least, std::vector<float>& values,
                        int threads) const {
  constexpr int block = 4;
  values.assign(grid.size(), least);
  const auto slabs = static_cast<std::size_t>((grid.nz + block - 1) / block);
  const float reach = grid.cell * 0.5f * static_cast<float>(block - 1) * 1.7321f;
  const auto do_block = [&](int x0, int y0, int z0) {
    const Vec3f middle =
        grid.position(x0, y0, z0) + 0.5f * static_cast<float>(block - 1) * grid.cell;
    // Far away a map's distance over the depth changes faster than the place: some slack.
    if (rough(middle, least - 1.2f * reach) < least - 1.2f * reach) return;
    for (int z = z0; z < std::min(z0 + block, grid.nz); ++z)
      for (int y = y0; y < std::min(y0 + block, grid.ny); ++y)
        for (int x = x0; x < std::min(x0 + block, grid.nx); ++x)
          values[grid.node(x, y, z)] = std::max(least, rough(grid.position(x, y, z), least));
  };
  parallel_for(slabs, 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
      for (int y = 0; y < grid.ny; y += block)
        for (int x = 0; x < grid.nx; x += block) do_block(x, y, static_cast<int>(s) * block);
  });
}

}  // namespace polyhull::refine
