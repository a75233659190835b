// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/contact_rays.h"

#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// So far outside the hull, by H on a grid, a ray may still touch it, in the grid's cells.
constexpr float slack = 0.6f;

/// A function of a part at \p count depths of a ray, \p step apart.
void sample_ray(const Grid& grid, const std::vector<float>& values, const ContactRay& ray,
                float from, float step, int count, float* out) {
  const Vec3f at = (ray.point(from) - grid.low) / grid.cell;
  const Vec3f way = ray.direction * (step / grid.cell);
  Loops::best().along({values.data(),
                       grid.nx,
                       grid.ny,
                       grid.nz,
                       outside,
                       {at.x, at.y, at.z},
                       {way.x, way.y, way.z}},
                      count, out);
}

void add_pieces(const ContactRay& ray, std::span<const Level> parts, std::vector<float>& depths,
                std::vector<RayPiece>& out) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Grid& grid = parts[p].grid;
    float from = 0.0f, to = 0.0f;
    if (!clip(ray, grid, from, to)) continue;
    const float step = grid.cell / glm::length(ray.direction);
    const int count = static_cast<int>((to - from) / step) + 1;
    depths.resize(static_cast<std::size_t>(count) + 1);
    sample_ray(grid, parts[p].hull, ray, from, step, count, depths.data());
    depths[static_cast<std::size_t>(count)] = outside;
    bool on = false;
    float begin = 0.0f;
    for (int i = 0; i <= count; ++i) {
      const float z = from + step * static_cast<float>(i);
      const bool is_on = depths[static_cast<std::size_t>(i)] > -slack * grid.cell;
      if (is_on && !on) begin = z;
      if (!is_on && on)
        out.push_back({std::max(from, begin - 0.5f * step), std::min(to, z - 0.5f * step),
                       static_cast<std::uint32_t>(p)});
      on = is_on;
    }
  }
}

void trace_view(const OutlineView& view, std::span<const Level> parts, ContactRays& out) {
  std::vector<float> depths;
  const auto direction = [&](const Vec2& at) { return view.ray * Vec3(at.x, at.y, 1.0); };
  for (std::size_t r = 0; r < view.rings->size(); ++r) {
    const std::span<const Vec2f> ring = view.rings->ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec2 a(ring[i]), b(ring[i + 1 == ring.size() ? 0 : i + 1]);
      const double length = glm::length(b - a);
      if (!(length > 1e-6)) continue;
      const Vec3 from = direction(a), to = direction(b);
      // Out of the cone: the silhouette is on the left of the edge as seen on the screen, y down.
      const Vec3 normal = glm::normalize(glm::cross(from, to));
      const int count = std::max(1, static_cast<int>(std::lround(length / view.spacing)));
      for (int k = 0; k < count; ++k) {
        ContactRay ray;
        ray.origin = view.centre;
        ray.direction = Vec3f(from + (to - from) * ((k + 0.5) / count));
        ray.normal = Vec3f(normal);
        ray.first_piece = static_cast<std::uint32_t>(out.pieces.size());
        add_pieces(ray, parts, depths, out.pieces);
        ray.end_piece = static_cast<std::uint32_t>(out.pieces.size());
        if (ray.first_piece == ray.end_piece) continue;
        const RayPiece& piece = out.pieces[ray.first_piece];
        ray.part = piece.part;
        ray.depth = 0.5f * (piece.begin + piece.end);
        out.rays.push_back(ray);
      }
    }
  }
}

/// Looks for the largest f on a ray.
class RimSeeker {
 public:
  RimSeeker(const ContactRay& ray, std::span<const Level> parts)
      : ray_(ray), parts_(parts), depth_(ray.depth), part_(ray.part) {}

  /// At \p count depths of a part, \p step apart, and between them by parabolas: a rim that could be
  /// at those depths only would jump by a step where f changes a little.
  void look(std::uint32_t part, float begin, float step, int count) {
    constexpr int most = 32;
    float values[most];
    const Level& level = parts_[part];
    for (int first = 0; first < count; first += most) {
      const int some = std::min(most, count - first);
      const float from = begin + step * static_cast<float>(first);
      sample_ray(level.grid, level.values, ray_, from, step, some, values);
      for (int i = 0; i < some; ++i) {
        if (values[i] <= best_) continue;
        best_ = values[i];
        depth_ = from + step * static_cast<float>(i);
        part_ = part;
        if (i > 0 && i + 1 < some) peak(values + i, step);
      }
    }
  }
  /// Uphill from the last rim, in steps of \p step and three at most.
  void climb(float step) {
    const Level& level = parts_[part_];
    const auto value = [&](int steps) {
      return sample(level.grid, level.values.data(),
                    ray_.point(ray_.depth + step * static_cast<float>(steps)));
    };
    float around[3] = {value(-1), value(0), value(1)};
    int at = 0;
    const int way = around[2] > around[0] ? 1 : -1;
    while (std::abs(at) < 3 && around[1 + way] > around[1]) {
      at += way;
      around[1 - way] = around[1];
      around[1] = around[1 + way];
      around[1 + way] = value(at + way);
    }
    best_ = around[1];
    depth_ = ray_.depth + step * static_cast<float>(at);
    if (!(around[1 + way] > around[1])) peak(around + 1, step);
  }
  void take(ContactRay& ray) const {
    ray.value = best_;
    ray.depth = depth_;
    ray.part = part_;
  }

 private:
  /// Moves the best from the middle one of three depths to the peak of their parabola.
  void peak(const float* middle, float step) {
    const float before = middle[-1], after = middle[1];
    const float bend = 2.0f * middle[0] - before - after;
    if (!(bend > 1e-6f)) return;
    const float shift = 0.5f * (after - before) / bend;
    if (!(std::abs(shift) < 0.6f)) return;  // no peak
    depth_ += shift * step;
    best_ += 0.25f * (after - before) * shift;
  }

  const ContactRay& ray_;
  std::span<const Level> parts_;
  float best_ = -1e3f, depth_;
  std::uint32_t part_;
};

void find_rim(ContactRay& ray, const ContactRays& rays, std::span<const Level> parts, float step,
              RimSearch where) {
  RimSeeker seeker(ray, parts);
  if (where == RimSearch::near) {
    seeker.climb(step);
  } else {
    for (std::uint32_t k = ray.first_piece; k < ray.end_piece; ++k) {
      const RayPiece& piece = rays.pieces[k];
      const float length = piece.end - piece.begin;
      const int count = std::max(1, static_cast<int>(length / step + 0.5f));
      seeker.look(piece.part, piece.begin, length / static_cast<float>(count), count + 1);
    }
  }
  seeker.take(ray);
}

}  // namespace

bool clip(const ContactRay& ray, const Grid& grid, float& from, float& to) {
  from = 0.01f;
  to = 1e9f;
  if (!(glm::dot(ray.direction, ray.direction) < 1e30f)) return false;
  const Vec3f high = grid.position(grid.nx - 1, grid.ny - 1, grid.nz - 1);
  for (int k = 0; k < 3; ++k) {
    if (std::abs(ray.direction[k]) < 1e-9f) {
      if (ray.origin[k] < grid.low[k] || ray.origin[k] > high[k]) return false;
      continue;
    }
    const float a = (grid.low[k] - ray.origin[k]) / ray.direction[k];
    const float b = (high[k] - ray.origin[k]) / ray.direction[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from < to;
}

void sample_row(const Grid& grid, const float* values, const Grid& at, int y, int z, Extent nodes,
                std::vector<float>& mixed, float* out) {
  const Vec3f begin = (at.position(0, y, z) - grid.low) / grid.cell;
  std::fill(out + nodes.begin, out + nodes.end, outside);
  if (!(begin.y >= 0.0f && begin.z >= 0.0f && begin.y < static_cast<float>(grid.ny - 1) &&
        begin.z < static_cast<float>(grid.nz - 1)))
    return;
  const float step = at.cell / grid.cell, last = static_cast<float>(grid.nx - 1);
  const auto place = [&](int x) { return begin.x + static_cast<float>(x) * step; };
  while (nodes.begin < nodes.end && !(place(nodes.begin) >= 0.0f)) ++nodes.begin;
  while (nodes.begin < nodes.end && !(place(nodes.end - 1) < last)) --nodes.end;
  if (nodes.begin == nodes.end) return;
  // First along y and z, whole rows, then along x.
  const int cy = static_cast<int>(begin.y), cz = static_cast<int>(begin.z);
  const float b = begin.y - static_cast<float>(cy), c = begin.z - static_cast<float>(cz);
  const float* p = values + grid.node(0, cy, cz);
  const float *q = p + grid.row(), *r = p + grid.slab(), *s = r + grid.row();
  mixed.resize(grid.row());
  float* __restrict mix = mixed.data();
  const int end = static_cast<int>(place(nodes.end - 1)) + 2;
  for (int x = static_cast<int>(place(nodes.begin)); x < end; ++x) {
    const float near = p[x] + b * (q[x] - p[x]), far = r[x] + b * (s[x] - r[x]);
    mix[x] = near + c * (far - near);
  }
  for (int x = nodes.begin; x < nodes.end; ++x) {
    const float t = place(x);
    const int k = static_cast<int>(t);
    out[x] = mix[k] + (t - static_cast<float>(k)) * (mix[k + 1] - mix[k]);
  }
}

void trace_rays(std::span<const OutlineView> views, std::span<const Level> parts, int threads,
                ContactRays& out) {
  std::vector<ContactRays> of_view(views.size());
  parallel_each(views.size(), 1, threads,
                [&](std::size_t k) { trace_view(views[k], parts, of_view[k]); });
  out.rays.clear();
  out.pieces.clear();
  for (const ContactRays& some : of_view) {
    const auto shift = static_cast<std::uint32_t>(out.pieces.size());
    for (ContactRay ray : some.rays) {
      ray.first_piece += shift;
      ray.end_piece += shift;
      out.rays.push_back(ray);
    }
    out.pieces.insert(out.pieces.end(), some.pieces.begin(), some.pieces.end());
  }
}

void find_rims(ContactRays& rays, std::span<const Level> parts, float step, RimSearch where,
               std::size_t stride, int threads, float held) {
  const std::size_t count = (rays.rays.size() + stride - 1) / stride;
  parallel_each(count, 64, threads, [&](std::size_t i) {
    ContactRay& ray = rays.rays[i * stride];
    if (ray.value < held) find_rim(ray, rays, parts, step, where);
  });
}

}  // namespace polyhull::refine
