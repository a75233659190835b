// SPDX-License-Identifier: LGPL-2.1-or-later
// Borders of light within a cell: LightCache's cells in which a lamp's share differs much from
// corner to corner are divided.
#include <algorithm>
#include <atomic>
#include <optional>

#include "base/thread_pool.h"
#include "raytrace/lamp_share.h"
#include "raytrace/light_cache.h"

namespace polyhull {
namespace {

// Ways to each lamp from a divided cell's nodes, of which there are many: at first, and in penumbrae.
constexpr int first_ways = 8, most_ways = 32;

constexpr float part(std::size_t i) {
  return static_cast<float>(i) / static_cast<float>(border_cells);
}

}  // namespace

/// The value at \p node of a divided cell; false where that lies in a body.
bool LightCache::border_value(const TracedScene& scene, const std::vector<LampShare>& lamps,
                              const SurfaceGrid::Node& node, int side, Float4& value,
                              std::uint64_t& rays) const {
  Float4 straight{}, mirrored{};
  bool faces = false;
  for (const LampShare& lamp : lamps) {
    const std::optional<Vec3f> unoccluded = lamp.unoccluded(node);
    if (!unoccluded) continue;
    const Float4 light = lamp.at(node, false, rays) * to_float4(*unoccluded);
    (lamp.is_mirrored() ? mirrored : straight) += light;
    faces |= !lamp.is_mirrored();
  }
  if (side == 0 && faces && straight[0] + straight[1] + straight[2] == 0.0f &&
      inside_a_body(scene, node))
    return false;
  value = straight + mirrored + interpolate(coarse_, bounced_[side], node.hit);
  return true;
}

void LightCache::refine_borders(const TracedScene& scene, const LightCacheOptions& options,
                                bool back) {
  const int side = back ? 1 : 0;
  std::vector<SurfaceGrid::Block> cells;
  const std::size_t most = options.most_nodes / border_nodes;
  if (options.borders && options.divided)
    fine_.for_blocks(1, [&](const SurfaceGrid::Block& cell) {
      if (options.divided->sides[side][cell.first][3] > 0.0f) cells.push_back(cell);
    });
  else if (options.borders)
    fine_.for_blocks(1, [&](const SurfaceGrid::Block& cell) {
      if (borders_[side][cell.first] != 0 && cells.size() < most) cells.push_back(cell);
    });
  borders_[side] = std::vector<char>();
  const int samples = std::min(options.light_samples, most_ways);
  const std::vector<LampShare> lamps =
      lamps_of(scene, options, std::min(options.first_samples, first_ways), samples, samples);
  std::vector<Float4>& values = all_.sides[side];
  values.resize(fine_.size() + cells.size() * border_nodes);
  std::atomic<std::uint64_t> rays = 0;
  parallel_for(cells.size(), 4, options.threads, [&](std::size_t begin, std::size_t end) {
    std::uint64_t asked = 0;
    for (std::size_t i = begin; i < end && !stopped(); ++i) {
      Float4* out = &values[fine_.size() + i * border_nodes];
      for (std::size_t k = 0; k < border_nodes; ++k) {
        const float x = part(k % (border_cells + 1)), y = part(k / (border_cells + 1));
        SurfaceGrid::Node node = fine_.between(scene.scene(), cells[i], x, y);
        if (back) node.normal = -node.normal;
        if (!border_value(scene, lamps, node, side, out[k], asked))
          out[k] = between(values, cells[i], x, y);
      }
    }
    rays += asked;
  });
  for (std::size_t i = 0; i < cells.size(); ++i)
    values[cells[i].first][3] = static_cast<float>(i + 1);
  rays_ += rays;
}

LightValues LightCache::divided_as(const LightValues& other) const {
  LightValues out = all_values();
  for (std::size_t side = 0; side < out.sides.size(); ++side) {
    std::vector<Float4>& values = out.sides[side];
    const std::vector<Float4>& as = other.sides[side];
    values.resize(as.size());
    if (values.empty()) continue;
    for (std::size_t i = 0; i < fine_.size(); ++i) values[i][3] = as[i][3];
    fine_.for_blocks(1, [&](const SurfaceGrid::Block& cell) {
      if (!(as[cell.first][3] > 0.0f)) return;
      const auto number = static_cast<std::size_t>(as[cell.first][3]) - 1;
      for (std::size_t k = 0; k < border_nodes; ++k) {
        Float4& value = values[fine_.size() + number * border_nodes + k];
        value = between(values, cell, part(k % (border_cells + 1)), part(k / (border_cells + 1)));
        value[3] = 0.0f;
      }
    });
  }
  return out;
}

}  // namespace polyhull
