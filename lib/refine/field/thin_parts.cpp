// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/thin_parts.h"

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// A rim further outside has lost its contact.
constexpr float lost = -0.12f;
/// No node that is further outside the hull is put inside.
constexpr float farthest = -0.15f;
/// f of what is put inside.
constexpr float hair = 0.02f;
/// Of depth along a ray, and of the way inwards, where the hull's middle is looked for.
constexpr float step = 0.25f, inward_step = 0.08f;

struct Middle {
  Vec3f point{0.0f};
  std::uint32_t part = 0;
  float at = 0.0f;      ///< depth along the ray
  float depth = -1e3f;  ///< H there
};

/// The deepest point inside the hull next to \p ray, over its pieces: from the outline inwards,
/// until H falls again; any that exceeds \p half_thickness where there is one.
Middle middle_of_hull(const ContactRay& ray, const ContactRays& rays, const HullDistance& hull,
                      float half_thickness) {
  Middle best;
  for (std::uint32_t k = ray.first_piece; k < ray.end_piece; ++k) {
    const RayPiece& piece = rays.pieces[k];
    const int steps = static_cast<int>(std::min((piece.end - piece.begin) / step, 4096.0f));
    for (int i = 0; i <= steps; ++i) {
      const float at = piece.begin + static_cast<float>(i) * step;
      const Vec3f outline = ray.point(at);
      float last = -1e3f;
      for (float way = 0.0f; way <= 2.0f * half_thickness; way += inward_step) {
        const Vec3f point = outline - way * ray.normal;
        const float depth = hull.exact(point, -1.0f);
        if (depth > best.depth) best = {point, piece.part, at, depth};
        if (depth > half_thickness) return best;  // as this one is
        if (depth < last) break;
        last = depth;
      }
    }
  }
  return best;
}

void put_inside(Level& level, const HullDistance& hull, const Vec3f& point) {
  const Grid& grid = level.grid;
  const Vec3f at = (point - grid.low) / grid.cell;
  const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
  if (x < 1 || y < 1 || z < 1 || x + 2 >= grid.nx || y + 2 >= grid.ny || z + 2 >= grid.nz) return;
  for (int k = 0; k < 8; ++k) {
    const int row = (z + (k >> 2)) * grid.ny + y + (k >> 1 & 1);
    const Vec3f node = grid.position(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
    if (hull.exact(node, -1.0f) < farthest || hull.from_bounds(node) < 2.0f * hair) continue;
    float& value = level.values[grid.node(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))];
    value = std::max(value, hair);
    Extent& extent = level.rows[static_cast<std::size_t>(row)];
    if (extent.begin == extent.end) extent = {x, x};
    extent = {std::min(extent.begin, x), std::max(extent.end, x + 2)};
  }
}

}  // namespace

std::size_t keep_thin_parts(std::span<Level> fine, ContactRays& rays, const HullDistance& hull,
                            float half_thickness, int threads) {
  std::vector<std::uint32_t> outside_rays;
  for (std::size_t i = 0; i < rays.rays.size(); ++i)
    if (rays.rays[i].value <= lost) outside_rays.push_back(static_cast<std::uint32_t>(i));
  std::vector<Middle> middles(outside_rays.size());
  parallel_each(middles.size(), 8, threads, [&](std::size_t i) {
    middles[i] = middle_of_hull(rays.rays[outside_rays[i]], rays, hull, half_thickness);
  });
  std::size_t count = 0;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const Middle& middle = middles[i];
    if (middle.depth <= 0.0f || middle.depth > half_thickness) continue;
    put_inside(fine[middle.part], hull, middle.point);
    ContactRay& ray = rays.rays[outside_rays[i]];
    ray.part = middle.part, ray.depth = middle.at, ray.value = 0.0f;
    ++count;
  }
  return count;
}

}  // namespace polyhull::refine
