// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/pieces/components.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/thread_pool.h"
#include "refine/field/frame.h"

namespace polyhull::refine {
namespace {

/// How near a rim is to the nodes of what it touches, cells: they are half a cell apart, and of what
/// is thin (thin_parts.h) only those at its middle are inside.
constexpr float touching = 0.75f;
/// So many rays, half a cell apart, have to need a component: what fewer do is noise of the outline.
constexpr int least_rays = 2;

/// All levels' components, the largest ones first.
struct Components {
  std::vector<LevelRuns> levels;
  std::vector<Box> boxes;  ///< around each one's nodes

  Components(std::span<const Level> fine, std::vector<LevelRuns> runs) : levels(std::move(runs)) {
    std::uint32_t count = 0;
    for (LevelRuns& level : levels) {
      for (Run& run : level.runs) run.component += count;
      count += level.components;
    }
    std::vector<std::size_t> nodes(count, 0);
    each_run([&](const Run& run) {
      nodes[run.component] += static_cast<std::size_t>(run.end - run.begin);
    });
    std::vector<std::uint32_t> order(count), rank(count);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](auto a, auto b) { return nodes[a] > nodes[b]; });
    for (std::uint32_t i = 0; i < count; ++i) rank[order[i]] = i;
    each_run([&](Run& run) { run.component = rank[run.component]; });
    boxes.resize(count, {Vec3f(1e30f), Vec3f(-1e30f)});
    for (std::size_t p = 0; p < levels.size(); ++p) find_boxes(fine[p].grid, levels[p]);
  }

 private:
  template <typename Body>
  void each_run(const Body& body) {
    for (LevelRuns& level : levels)
      for (Run& run : level.runs) body(run);
  }
  void find_boxes(const Grid& grid, const LevelRuns& level) {
    for (std::size_t r = 0; r + 1 < level.first.size(); ++r)
      for (const Run& run : level.row(r)) {
        const int y = static_cast<int>(r) % grid.ny, z = static_cast<int>(r) / grid.ny;
        Box& box = boxes[run.component];
        box.low = glm::min(box.low, grid.position(run.begin, y, z));
        box.high = glm::max(box.high, grid.position(run.end - 1, y, z));
      }
  }
};

/// Adds to \p found which components have nodes within \p reach nodes of \p at.
void look_around(const LevelRuns& level, const Grid& grid, const Vec3f& at, float reach,
                 std::vector<std::uint32_t>& found) {
  const auto low = [&](float x) { return std::max(0, static_cast<int>(std::ceil(x - reach))); };
  const auto high = [&](float x, int count) {
    return std::min(count - 1, static_cast<int>(std::floor(x + reach)));
  };
  for (int z = low(at.z); z <= high(at.z, grid.nz); ++z)
    for (int y = low(at.y); y <= high(at.y, grid.ny); ++y) {
      const float dy = at.y - static_cast<float>(y), dz = at.z - static_cast<float>(z);
      const float rest = reach * reach - dy * dy - dz * dz;
      if (rest < 0.0f) continue;
      const float dx = std::sqrt(rest);
      for (const Run& run : level.row(static_cast<std::size_t>(z) * grid.ny + y))
        if (static_cast<float>(run.begin) <= at.x + dx &&
            static_cast<float>(run.end - 1) >= at.x - dx &&
            std::find(found.begin(), found.end(), run.component) == found.end())
          found.push_back(run.component);
    }
}

/// Which component a ray touches, and which it passes nearby.
struct Touched {
  std::uint32_t at_rim = 0;
  std::vector<std::uint32_t> nearby;
};

/// The largest component that the rim touches; 0, too, where it touches none.
std::uint32_t component_at_rim(const ContactRay& ray, std::span<const Level> fine,
                               const Components& components) {
  const Vec3f rim = ray.rim();
  if (std::none_of(components.boxes.begin() + 1, components.boxes.end(), [&](const Box& box) {
        return glm::all(glm::lessThan(glm::abs(2.0f * rim - box.low - box.high),
                                      box.high - box.low + 2.0f * touching));
      }))
    return 0;
  const Grid& grid = fine[ray.part].grid;
  std::vector<std::uint32_t> found;
  look_around(components.levels[ray.part], grid, (rim - grid.low) / grid.cell, touching / grid.cell,
              found);
  return found.empty() ? 0 : *std::min_element(found.begin(), found.end());
}

/// How many components are asked for.
enum class Wanted { any, all };

/// The components within \p unsure of \p ray, anywhere along it but nearer than \p apart to its rim:
/// where silhouettes contradict each other it need not pass the body within the hull.
std::vector<std::uint32_t> components_near(const ContactRay& ray, std::span<const Level> fine,
                                           std::span<const LevelRuns> runs, float unsure,
                                           Wanted wanted, float apart = 0.0f) {
  std::vector<std::uint32_t> found;
  const float length = glm::length(ray.direction);
  for (std::size_t p = 0; p < fine.size(); ++p) {
    const Grid& grid = fine[p].grid;
    float from = 0.0f, to = 0.0f;
    if (!clip(ray, grid, from, to)) continue;
    const float step = 0.5f * grid.cell / length;
    const int count = static_cast<int>((to - from) / step);
    for (int i = 0; i <= count; ++i) {
      const float at = from + step * static_cast<float>(i);
      if (std::abs(at - ray.depth) * length < apart) continue;
      look_around(runs[p], grid, (ray.point(at) - grid.low) / grid.cell, unsure / grid.cell, found);
      if (wanted == Wanted::any && !found.empty()) return found;
    }
  }
  return found;
}

/// \p ray as far \p inwards of its outline.
ContactRay inside(ContactRay ray, float inwards) {
  ray.origin -= inwards * ray.normal;
  return ray;
}

/// Whether component \p c, of \p level, covers what is \p inwards of \p ray's outline: whether the ray
/// moved by so much passes through it. An outline need not be exact to a pixel, and a line of the
/// silhouette that is no wider shows nothing: behind it the hull ends, and so does f.
bool covers(const Components& components, std::uint32_t c, const Level& level,
            const LevelRuns& runs, const ContactRay& ray) {
  const Grid& grid = level.grid;
  Grid around = grid;  // of the component's box, and a node more
  const Box& box = components.boxes[c];
  const Vec3f size = (box.high - box.low) / grid.cell;
  around.low = box.low - grid.cell;
  around.nx = static_cast<int>(size.x + 0.5f) + 3;
  around.ny = static_cast<int>(size.y + 0.5f) + 3;
  around.nz = static_cast<int>(size.z + 0.5f) + 3;
  float from = 0.0f, to = 0.0f;
  if (!clip(ray, around, from, to)) return false;
  const float step = 0.1f * grid.cell / glm::length(ray.direction);
  std::vector<std::uint32_t> found;
  for (int i = 0; from + step * static_cast<float>(i) <= to; ++i) {
    const Vec3f point = ray.point(from + step * static_cast<float>(i));
    if (sample(grid, level.values.data(), point) <= 0.0f) continue;
    found.clear();
    look_around(runs, grid, (point - grid.low) / grid.cell, 1.0f, found);
    if (std::find(found.begin(), found.end(), c) != found.end()) return true;
  }
  return false;
}

}  // namespace

std::size_t drop_unneeded_components(std::span<Level> fine, std::vector<LevelRuns> runs,
                                     const ContactRays& rays, float unsure, float inwards,
                                     int threads) {
  std::uint32_t count = 0;
  for (const LevelRuns& level : runs) count += level.components;
  if (count < 2) return 0;
  const Components components(fine, std::move(runs));
  std::vector<Touched> touched(rays.rays.size());
  parallel_each(touched.size(), 64, threads, [&](std::size_t i) {
    touched[i].at_rim = component_at_rim(rays.rays[i], fine, components);
    if (touched[i].at_rim > 0)
      touched[i].nearby = components_near(inside(rays.rays[i], inwards), fine, components.levels,
                                          unsure, Wanted::all);
  });
  std::vector<bool> needed(count, false);
  needed[0] = true;
  const auto needs = [&](std::size_t i, std::uint32_t c) {
    const Touched& ray = touched[i];
    const std::uint32_t part = rays.rays[i].part;
    return ray.at_rim == c &&
           std::none_of(ray.nearby.begin(), ray.nearby.end(),
                        [&](std::uint32_t other) { return needed[other]; }) &&
           covers(components, c, fine[part], components.levels[part],
                  inside(rays.rays[i], inwards));
  };
  const auto is_enough_needed = [&](std::uint32_t c) {
    int needing = 0;
    for (std::size_t i = 0; i < touched.size() && needing < least_rays; ++i) needing += needs(i, c);
    return needing == least_rays;
  };
  // Once more, since smaller ones may have turned out to be enough.
  for (int round = 0; round < 2; ++round)
    for (std::uint32_t c = 1; c < count; ++c) {
      needed[c] = false;
      needed[c] = is_enough_needed(c);
    }
  // What was enough for another may have gone after it.
  for (bool restored = true; restored;) {
    restored = false;
    for (std::uint32_t c = 1; c < count; ++c)
      if (!needed[c] && is_enough_needed(c)) needed[c] = restored = true;
  }
  for (std::size_t p = 0; p < fine.size(); ++p)
    for (std::size_t r = 0; r < fine[p].rows.size(); ++r)
      for (const Run& run : components.levels[p].row(r)) {
        if (needed[run.component]) continue;
        float* row = fine[p].values.data() + r * fine[p].grid.row();
        for (int x = run.begin; x < run.end; ++x) row[x] = -row[x];
      }
  return static_cast<std::size_t>(std::count(needed.begin(), needed.end(), false));
}

bool is_needed(const Vec3f& point, std::span<const Level> fine, std::span<const LevelRuns> runs,
               const ContactRays& rays, float unsure) {
  return std::any_of(rays.rays.begin(), rays.rays.end(), [&](const ContactRay& ray) {
    const Vec3f way = ray.rim() - point;
    return glm::dot(way, way) < touching * touching &&
           components_near(ray, fine, runs, unsure, Wanted::any, 2.0f * unsure).empty();
  });
}

}  // namespace polyhull::refine
