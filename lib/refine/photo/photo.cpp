// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/photo/photo.h"

#include <algorithm>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// Agreement where too few cameras see a vertex, or nothing is to be seen there.
constexpr float unknown = -2.0f;
/// How much an unknown vertex insists on staying, one whose colours agree as it is, and one beside a
/// rim.
constexpr float indifferent = 0.1f, content = 1.0f, firm = 2.0f;

/// Of the vertices around one that wants a depth, the share that must want one, too; and how far
/// around, in averages over neighbours.
constexpr float fewest = 0.5f;
constexpr int widely = 10;

/// How far before its place and beyond its new depth a vertex says by how much f is lowered, and in
/// which steps.
constexpr float beyond = 1.0f, way_step = 0.25f;
/// By how much that is smoothed, cells.
constexpr float blurred = 0.5f;

}  // namespace

void PhotoCarver::find_neighbours(const CellSurface& surface) {
  const std::size_t count = surface.points.size();
  first_neighbour_.assign(count + 1, 0);
  // Closed and oriented: each edge runs once either way.
  for (const std::uint32_t v : surface.triangles) ++first_neighbour_[v + 1];
  for (std::size_t v = 0; v < count; ++v) first_neighbour_[v + 1] += first_neighbour_[v];
  neighbours_.resize(surface.triangles.size());
  std::vector<std::uint32_t> at(first_neighbour_.begin(), first_neighbour_.end() - 1);
  for (std::size_t i = 0; i < surface.triangles.size(); i += 3)
    for (std::size_t k = 0; k < 3; ++k)
      neighbours_[at[surface.triangles[i + k]]++] = surface.triangles[i + (k + 1) % 3];
}

/// Three times: of each depth's agreements the mean of a vertex and its neighbours, so far as known.
void PhotoCarver::average(std::size_t depths, int threads) {
  const std::size_t count = first_neighbour_.size() - 1;
  for (int times = 0; times < 3; ++times) {
    averaged_.resize(agreement_.size());
    parallel_each(count, 512, threads, [&](std::size_t v) {
      for (std::size_t d = 0; d < depths; ++d) {
        float sum = 0.0f, weight = 0.0f;
        const auto add = [&](std::size_t u, float w) {
          const float value = agreement_[u * depths + d];
          if (value == unknown) return;
          sum += w * value;
          weight += w;
        };
        add(v, 2.0f);
        for (std::uint32_t i = first_neighbour_[v]; i < first_neighbour_[v + 1]; ++i)
          add(neighbours_[i], 1.0f);
        averaged_[v * depths + d] = weight > 2.5f ? sum / weight : unknown;
      }
    });
    agreement_.swap(averaged_);
  }
}

void PhotoCarver::choose(const Level& fine, const CellSurface& surface,
                         const PhotoSettings& settings) {
  const auto depths = static_cast<std::size_t>(settings.steps) + 1;
  const std::size_t count = surface.points.size();
  wanted_.assign(count, 0.0f);
  weight_.assign(count, indifferent);
  for (std::size_t v = 0; v < count; ++v) {
    const float* agreement = agreement_.data() + v * depths;
    if (agreement[0] == unknown) continue;
    std::size_t best = 0;
    float before = 0.0f;  // f along the way: beyond the middle of the body there is no depth
    for (std::size_t d = 1; d < depths; ++d) {
      const Vec3f point =
          surface.points[v] - static_cast<float>(d) * settings.step * surface.normals[v];
      const float f = sample(fine.grid, fine.values.data(), point);
      if (f < before) break;
      before = f;
      if (agreement[d] > agreement[best]) best = d;
    }
    const float gain = agreement[best] - agreement[0];
    if (best == 0 || gain < settings.better || agreement[best] < settings.least) {
      weight_[v] = std::max(indifferent, content * agreement[0]);
      continue;
    }
    float at = static_cast<float>(best);
    if (best + 1 < depths && agreement[best + 1] > unknown) {  // the parabola's top
      const float a = agreement[best - 1], b = agreement[best], c = agreement[best + 1];
      const float bend = a - 2.0f * b + c;
      if (bend < 0.0f && a > unknown) at += std::clamp(0.5f * (a - c) / bend, -0.5f, 0.5f);
    }
    wanted_[v] = settings.step * at;
    weight_[v] = std::min(4.0f * gain, 1.0f);
  }
}

/// Depths around which most do not want one are chance: a hollow is wanted by all that lie over it.
void PhotoCarver::drop_lonely(int threads) {
  const std::size_t count = wanted_.size();
  depth_.resize(count);
  smoothed_.resize(count);
  for (std::size_t v = 0; v < count; ++v) depth_[v] = wanted_[v] > 0.0f ? 1.0f : 0.0f;
  for (int i = 0; i < widely; ++i) {
    parallel_each(count, 1024, threads, [&](std::size_t v) {
      float sum = depth_[v], number = 1.0f;
      for (std::uint32_t k = first_neighbour_[v]; k < first_neighbour_[v + 1]; ++k) {
        sum += depth_[neighbours_[k]];
        number += 1.0f;
      }
      smoothed_[v] = sum / number;
    });
    depth_.swap(smoothed_);
  }
  for (std::size_t v = 0; v < count; ++v)
    if (wanted_[v] > 0.0f && depth_[v] < fewest) {
      wanted_[v] = 0.0f;
      weight_[v] = indifferent;
    }
}

/// Next to a rim the surface is where the silhouette says.
void PhotoCarver::hold(const Grid& grid, const CellSurface& surface, std::span<const Vec3f> rims) {
  std::vector<bool> held(grid.size());
  int x = 0, y = 0, z = 0;
  const auto find_node = [&](const Vec3f& point) {
    const Vec3f at = (point - grid.low) / grid.cell + 0.5f;
    x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    return x > 0 && y > 0 && z > 0 && x + 1 < grid.nx && y + 1 < grid.ny && z + 1 < grid.nz;
  };
  for (const Vec3f& rim : rims)
    for (int k = 0; k < 27 && find_node(rim); ++k)
      held[grid.node(x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1)] = true;
  for (std::size_t v = 0; v < surface.points.size(); ++v)
    if (find_node(surface.points[v]) && held[grid.node(x, y, z)]) {
      wanted_[v] = 0.0f;
      weight_[v] = firm;
    }
}

/// Towards the least of sum w (d - wanted)^2 + 2 sum over edges (difference of d)^2, by Jacobi's
/// steps.
void PhotoCarver::smooth(int times, int threads) {
  const std::size_t count = wanted_.size();
  depth_ = wanted_;
  smoothed_.resize(count);
  for (int i = 0; i < times; ++i) {
    parallel_each(count, 1024, threads, [&](std::size_t v) {
      float sum = weight_[v] * wanted_[v], weight = weight_[v];
      for (std::uint32_t k = first_neighbour_[v]; k < first_neighbour_[v + 1]; ++k) {
        sum += 0.5f * depth_[neighbours_[k]];
        weight += 0.5f;
      }
      smoothed_[v] = sum / weight;
    });
    depth_.swap(smoothed_);
  }
}

/// Every vertex says along its way by how much f is to be lowered: by f where its new place is. A
/// node does the mean of what is said around it, smoothed.
void PhotoCarver::lower(Level& fine, const CellSurface& surface, int threads) {
  const Grid& grid = fine.grid;
  std::vector<float> sums(grid.size()), weights(grid.size());
  const auto splat = [&](const Vec3f& point, float value) {
    const Vec3f at = (point - grid.low) / grid.cell;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    if (x < 1 || y < 1 || z < 1 || x + 2 >= grid.nx || y + 2 >= grid.ny || z + 2 >= grid.nz) return;
    for (int k = -1; k <= 2; ++k)
      for (int j = -1; j <= 2; ++j)
        for (int i = -1; i <= 2; ++i) {
          const Vec3f off = Vec3f(x + i, y + j, z + k) - at;
          const float w = 1.0f - glm::dot(off, off) / 2.25f;
          if (w <= 0.0f) continue;
          const std::size_t node = grid.node(x + i, y + j, z + k);
          sums[node] += w * w * value;
          weights[node] += w * w;
        }
  };
  for (std::size_t v = 0; v < depth_.size(); ++v) {
    const Vec3f& normal = surface.normals[v];
    const float depth = depth_[v];
    float value =
        depth > 0.0f
            ? std::max(sample(grid, fine.values.data(), surface.points[v] - depth * normal), 0.0f)
            : 0.0f;
    for (float way = -beyond; way < depth + beyond; way += way_step)
      splat(surface.points[v] - way * normal, value);
  }
  for (std::size_t node = 0; node < grid.size(); ++node)
    if (weights[node] > 0.0f) sums[node] /= weights[node];
  blur(grid, sums, blurred, flow_memory_, threads);
  for (std::size_t node = 0; node < grid.size(); ++node)
    if (fine.values[node] > 0.0f) fine.values[node] -= sums[node];
}

bool PhotoCarver::carve(Level& fine, const CellSurface& surface, std::span<const Vec3f> rims,
                        const PhotoSettings& settings, int threads) {
  if (surface.points.empty()) return false;
  parallel_each(looks_.size(), 1, threads, [&](std::size_t k) { draw_depths(surface, looks_[k]); });
  const auto depths = static_cast<std::size_t>(settings.steps) + 1;
  agreement_.assign(surface.points.size() * depths, unknown);
  parallel_each(surface.points.size(), 64, threads, [&](std::size_t v) {
    find_agreement(surface, static_cast<std::uint32_t>(v), settings,
                   agreement_.data() + v * depths);
  });
  find_neighbours(surface);
  average(depths, threads);
  choose(fine, surface, settings);
  drop_lonely(threads);
  hold(fine.grid, surface, rims);
  if (std::all_of(wanted_.begin(), wanted_.end(), [](float depth) { return depth == 0.0f; }))
    return false;
  smooth(settings.smoothings, threads);
  lower(fine, surface, threads);
  return true;
}

}  // namespace polyhull::refine
