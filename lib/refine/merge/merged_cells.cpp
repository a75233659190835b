// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/merge/merged_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "base/thread_pool.h"
#include "refine/field/cell_table.h"
#include "refine/merge/brick_merger.h"
#include "refine/merge/polygon.h"

namespace polyhull::refine {
namespace {

constexpr int cells = Brick::cells;

/// Rims with less have lost their contact.
constexpr float least_value = -0.1f;

/// The cosine of an edge and the normal that a slide is reckoned with at least.
constexpr float least_along = 0.3f;

BrickEdge moved(const BrickEdge& edge, int axis, int by) {
  BrickEdge to = edge;
  (axis == 0 ? to.x : axis == 1 ? to.y : to.z) += by;
  return to;
}

/// Calls body(edge) for each crossed edge from a brick's own nodes.
template <typename Body>
void each_own_edge(const Brick& brick, const Body& body) {
  for (int z = 0; z < cells; ++z)
    for (int y = 0; y < cells; ++y) {
      const unsigned row = brick.signs[z][y];
      const unsigned crossed[3] = {row ^ row >> 1, row ^ brick.signs[z][y + 1],
                                   row ^ brick.signs[z + 1][y]};
      for (unsigned bits = (crossed[0] | crossed[1] | crossed[2]) & 0xfu; bits != 0;
           bits &= bits - 1) {
        const int x = std::countr_zero(bits);
        for (int axis = 0; axis < 3; ++axis)
          if (crossed[axis] >> x & 1) body(BrickEdge{x, y, z, axis});
      }
    }
}

Vec3f point_of(const BrickEdge& edge, float along) {
  Vec3f point(edge.x, edge.y, edge.z);
  point[edge.axis] += along;
  return point;
}

}  // namespace

std::int32_t CellMerger::brick_at(int x, int y, int z) const {
  if (x < 0 || y < 0 || z < 0 || x >= nx_ || y >= ny_ || z >= nz_) return -1;
  return grid_[(static_cast<std::size_t>(z) * ny_ + y) * nx_ + x];
}

std::uint32_t CellMerger::box_at(const Brick& brick, int x, int y, int z) const {
  const std::uint32_t number = brick.below[(x < 0) | (y < 0) << 1 | (z < 0) << 2];
  return 128 * number +
         bricks_[number]
             .box_of[Brick::cell_index(x & (cells - 1), y & (cells - 1), z & (cells - 1))];
}

/// The boxes of the four cells around an edge, one after the other.
void CellMerger::around(const Brick& brick, const BrickEdge& edge,
                        std::uint32_t (&boxes)[4]) const {
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  const int place[3] = {edge.x, edge.y, edge.z};
  if (place[u] > 0 && place[v] > 0) {
    constexpr int step[3] = {1, cells, cells * cells};
    const std::uint32_t own = 128 * brick.below[0];
    const std::uint8_t* box = &brick.box_of[Brick::cell_index(edge.x, edge.y, edge.z)];
    boxes[0] = own + box[0], boxes[1] = own + box[-step[u]];
    boxes[2] = own + box[-step[u] - step[v]], boxes[3] = own + box[-step[v]];
    return;
  }
  const BrickEdge at[4] = {edge, moved(edge, u, -1), moved(moved(edge, u, -1), v, -1),
                           moved(edge, v, -1)};
  for (int i = 0; i < 4; ++i) boxes[i] = box_at(brick, at[i].x, at[i].y, at[i].z);
}

/// Of the bricks of layer \p z those with surface.
void CellMerger::search(const Grid& grid, int z, std::vector<std::int32_t>& found) const {
  for (int y = 0; y < ny_; ++y)
    for (std::size_t w = 0; w < signs_.words; ++w) {
      std::uint64_t any = 0, every = ~std::uint64_t{0};
      for (int k = cells * z; k <= cells * (z + 1); ++k)
        for (int j = cells * y; j <= cells * (y + 1); ++j) {
          const std::uint64_t* row = signs_.row(grid, j, k);
          const std::uint64_t next = next_bits(row, w, signs_.words);
          any |= row[w] | next;
          every &= row[w] & next;
        }
      for (std::uint64_t bits = any & ~every; bits != 0;) {
        const int x = std::countr_zero(bits) / cells;
        found.push_back((z * ny_ + y) * nx_ + static_cast<int>(64 / cells * w) + x);
        bits &= ~(std::uint64_t{0xf} << cells * x);
      }
    }
}

/// Its nodes' signs, its cells with surface, and the bricks around.
void CellMerger::fill(const Grid& grid, Brick& brick) const {
  const auto bit = static_cast<std::size_t>(cells * brick.x);
  for (int k = 0; k < Brick::nodes; ++k)
    for (int j = 0; j < Brick::nodes; ++j) {
      const std::uint64_t* row = signs_.row(grid, cells * brick.y + j, cells * brick.z + k);
      std::uint64_t signs = row[bit / 64] >> bit % 64;
      if (bit % 64 == 60 && bit / 64 + 1 < signs_.words) signs |= row[bit / 64 + 1] << 4;
      brick.signs[k][j] = signs & 0x1f;
    }
  for (int side = 0; side < 8; ++side) {
    const int x = side & 1, y = side >> 1 & 1, z = side >> 2;
    brick.above[side] = static_cast<std::uint32_t>(brick_at(brick.x + x, brick.y + y, brick.z + z));
    brick.below[side] = static_cast<std::uint32_t>(brick_at(brick.x - x, brick.y - y, brick.z - z));
  }
  brick.active = 0;
  brick.refused.clear();
  for (int k = 0; k < cells; ++k)
    for (int j = 0; j < cells; ++j) {
      const unsigned a = brick.signs[k][j], b = brick.signs[k][j + 1], c = brick.signs[k + 1][j],
                     d = brick.signs[k + 1][j + 1];
      const unsigned any = a | b | c | d, every = a & b & c & d;
      const std::uint64_t some = (any | any >> 1) & ~(every & every >> 1) & 0xf;
      brick.active |= some << Brick::cell_index(0, j, k);
    }
}

/// The bricks with surface, in the order of the grid.
void CellMerger::find_bricks(const Level& fine, int threads) {
  const Grid& grid = fine.grid;
  signs_.find(fine, 0.0f, threads);
  nx_ = (grid.nx + cells - 1) / cells, ny_ = (grid.ny + cells - 1) / cells;
  nz_ = (grid.nz + cells - 1) / cells;
  grid_.assign(static_cast<std::size_t>(nx_) * ny_ * nz_, -1);
  layers_.resize(std::max(layers_.size(), static_cast<std::size_t>(nz_)));
  parallel_each(static_cast<std::size_t>(nz_), 1, threads, [&](std::size_t z) {
    layers_[z].clear();
    search(grid, static_cast<int>(z), layers_[z]);
  });
  count_ = 0;
  for (int z = 0; z < nz_; ++z)
    for (const std::int32_t at : layers_[static_cast<std::size_t>(z)]) {
      if (bricks_.size() == count_) bricks_.emplace_back();
      Brick& brick = bricks_[count_];
      brick.x = at % nx_, brick.y = at / nx_ % ny_, brick.z = at / nx_ / ny_;
      brick.rims = 0;
      grid_[static_cast<std::size_t>(at)] = static_cast<std::int32_t>(count_++);
    }
}

void CellMerger::mark_rims(const Grid& grid, const ContactRays& rays, std::uint32_t part) {
  for (const ContactRay& ray : rays.rays) {
    if (ray.part != part || !(ray.value > least_value)) continue;
    const Vec3f at = (ray.rim() - grid.low) / grid.cell;
    if (!(at.x >= 0.0f && at.y >= 0.0f && at.z >= 0.0f)) continue;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    const std::int32_t b = brick_at(x / cells, y / cells, z / cells);
    if (b >= 0)
      bricks_[static_cast<std::size_t>(b)].rims |=
          std::uint64_t{1} << Brick::cell_index(x % cells, y % cells, z % cells);
  }
}

/// A brick's own corners, as marching cubes has them.
void CellMerger::find_corners(const Level& fine, Brick& brick) const {
  brick.corners.clear();
  each_own_edge(brick, [&](const BrickEdge& edge) {
    std::uint32_t boxes[4];
    around(brick, edge, boxes);
    int meet = 0;  // they are convex, so each has neighbouring cells of the four
    for (int i = 0; i < 4; ++i) meet += boxes[i] != boxes[(i + 1) % 4];
    const int own = Brick::own_edge(edge);
    brick.number[own] = Brick::none;
    if (meet < 3) return;
    brick.number[own] = static_cast<std::uint8_t>(brick.corners.size());
    const float along = brick.along[own];
    brick.corners.push_back(
        {edge, point_of(edge, along),
         surface_normal(fine.grid, fine.values.data(), cells * brick.x + edge.x,
                        cells * brick.y + edge.y, cells * brick.z + edge.z, edge.axis, along)});
  });
}

/// The vertex on an edge of a brick: its number there times 256 and its own.
std::uint32_t CellMerger::vertex(const Brick& brick, const BrickEdge& edge) const {
  static_assert(cells == 4);
  const std::uint32_t owner = brick.above[edge.x >> 2 | edge.y >> 2 << 1 | edge.z >> 2 << 2];
  const int own = Brick::own_edge({edge.x & 3, edge.y & 3, edge.z & 3, edge.axis});
  return 256 * owner + bricks_[owner].number[own];
}

/// Where a vertex() is, from a brick's first node; \p point: before or after the slide.
Vec3f CellMerger::point(const Brick& brick, Vec3f BrickCorner::*point, std::uint32_t vertex) const {
  const Brick& owner = bricks_[vertex / 256];
  const Vec3f shift(owner.x - brick.x, owner.y - brick.y, owner.z - brick.z);
  return owner.corners[vertex % 256].*point + static_cast<float>(cells) * shift;
}

/// The triangles of a brick's boxes, and how far the surface lies outside of them, by the middles of
/// both. False where a polygon cannot be cut; its box is refused.
bool CellMerger::cut(Brick& brick) const {
  const CellTable& table = cell_table();
  brick.triangles.clear();
  brick.triangle_ends.clear();
  std::vector<PolygonCorner> corners;
  bool good = true;
  for (std::size_t i = 0; i < brick.boxes.size(); ++i) {
    CellBox& box = brick.boxes[i];
    if (!box.region.is_cell()) {
      corners.clear();
      for (const std::uint16_t index : brick.outline(i)) {
        const BrickEdge& edge = Brick::edge_at(index);
        const std::uint32_t v = vertex(brick, edge);
        if (v % 256 != Brick::none)
          corners.push_back({point(brick, &BrickCorner::point, v),
                             bricks_[v / 256].corners[v % 256].normal, box.region.faces_at(edge),
                             v});
      }
      const std::size_t first = brick.triangles.size();
      if (cut_polygon(corners, glm::normalize(box.surface.normal), brick.triangles)) {
        box.gap = gap(brick, box, first);
      } else {
        brick.refused.push_back(box.region);
        good = false;
      }
    } else {
      const auto [x, y, z] = box.region.low;
      for (const std::uint8_t index : table.triangles(brick.pattern(x, y, z))) {
        const CellEdge& e = table.edge(index);
        brick.triangles.push_back(vertex(brick, {x + e.x, y + e.y, z + e.z, e.axis}));
      }
    }
    brick.triangle_ends.push_back(static_cast<std::uint16_t>(brick.triangles.size()));
  }
  return good;
}

/// How far the surface in a box lies outside the triangles from \p first on, by the middles of both.
float CellMerger::gap(const Brick& brick, const CellBox& box, std::size_t first) const {
  Vec3f sum(0.0f);
  float area = 0.0f;
  for (std::size_t t = first; t < brick.triangles.size(); t += 3) {
    Vec3f p[3];
    for (std::size_t c = 0; c < 3; ++c)
      p[c] = point(brick, &BrickCorner::point, brick.triangles[t + c]);
    const float size = glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
    area += size, sum += size / 3.0f * (p[0] + p[1] + p[2]);
  }
  const Moments& surface = box.surface;
  return glm::dot(surface.normal, surface.sum / surface.area - sum / area) /
         glm::length(surface.normal);
}

/// Slides a brick's own corners.
void CellMerger::slide(Brick& brick) const {
  for (BrickCorner& corner : brick.corners) {
    const BrickEdge& edge = corner.edge;
    std::uint32_t boxes[4];
    around(brick, edge, boxes);
    Vec3f normal(0.0f);
    float area = 0.0f, gaps = 0.0f;
    for (int i = 0; i < 4; ++i) {
      if (boxes[i] == boxes[(i + 1) % 4]) continue;
      const CellBox& box = bricks_[boxes[i] / 128].boxes[boxes[i] % 128];
      normal += box.surface.normal, area += box.surface.area;
      gaps += box.surface.area * box.gap;
    }
    const float slope = normal[edge.axis] / std::max(glm::length(normal), 1e-12f);
    const float by = gaps / std::max(area, 1e-12f) /
                     std::copysign(std::max(std::abs(slope), least_along), slope);
    corner.slid = point_of(edge, std::clamp(brick.along[Brick::own_edge(edge)] + by,
                                            nearest_to_node, 1.0f - nearest_to_node));
  }
}

/// The corners of a brick's triangles that the slide turns over, as vertex() numbers them.
void CellMerger::find_turned(Brick& brick) const {
  brick.turned.clear();
  for (std::size_t i = 0; i < brick.triangle_ends.size(); ++i) {
    const CellBox& box = brick.boxes[i];
    if (box.region.is_cell()) continue;
    for (std::size_t t = i == 0 ? 0 : brick.triangle_ends[i - 1]; t < brick.triangle_ends[i];
         t += 3) {
      const std::uint32_t* corners = &brick.triangles[t];
      Vec3f p[3];
      for (std::size_t c = 0; c < 3; ++c) p[c] = point(brick, &BrickCorner::slid, corners[c]);
      if (!faces(p[0], p[1], p[2], box.surface.normal))
        brick.turned.insert(brick.turned.end(), corners, corners + 3);
    }
  }
}

template <typename Body>
void CellMerger::each(const Numbers& some, int threads, const Body& body) {
  parallel_each(some.size(), 32, threads, [&](std::size_t i) { body(bricks_[some[i]], some[i]); });
}

/// Takes the slide of corners back until no triangle is turned over: as they were cut, none is.
void CellMerger::take_back(const Numbers& all, int threads) {
  for (Numbers some = all; !some.empty();) {
    each(some, threads, [&](Brick& brick, std::uint32_t) { find_turned(brick); });
    Numbers moved;
    for (const std::uint32_t b : some)
      for (const std::uint32_t v : bricks_[b].turned) {
        BrickCorner& corner = bricks_[v / 256].corners[v % 256];
        if (corner.slid == corner.point) continue;
        corner.slid = corner.point;
        moved.push_back(v / 256);
      }
    some = near(moved, -1, 0);
  }
}

CellMerger::Numbers CellMerger::near(const Numbers& some, int first, int last) const {
  Numbers found;
  for (const std::uint32_t b : some)
    for (int z = first; z <= last; ++z)
      for (int y = first; y <= last; ++y)
        for (int x = first; x <= last; ++x) {
          const Brick& brick = bricks_[b];
          const std::int32_t other = brick_at(brick.x + x, brick.y + y, brick.z + z);
          if (other >= 0) found.push_back(static_cast<std::uint32_t>(other));
        }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

void CellMerger::gather(const Level& fine, CellSurface& out, int threads) const {
  std::vector<std::uint32_t> first_point(count_ + 1, static_cast<std::uint32_t>(out.points.size()));
  std::vector<std::size_t> first_corner(count_ + 1, out.triangles.size());
  for (std::size_t b = 0; b < count_; ++b) {
    first_point[b + 1] = first_point[b] + static_cast<std::uint32_t>(bricks_[b].corners.size());
    first_corner[b + 1] = first_corner[b] + bricks_[b].triangles.size();
  }
  out.points.resize(first_point.back());
  out.normals.resize(first_point.back());
  out.triangles.resize(first_corner.back());
  const Grid& grid = fine.grid;
  parallel_each(count_, 64, threads, [&](std::size_t b) {
    const Brick& brick = bricks_[b];
    const Vec3f low = grid.position(cells * brick.x, cells * brick.y, cells * brick.z);
    for (std::size_t i = 0; i < brick.corners.size(); ++i) {
      out.points[first_point[b] + i] = low + grid.cell * brick.corners[i].slid;
      out.normals[first_point[b] + i] = brick.corners[i].normal;
    }
    for (std::size_t i = 0; i < brick.triangles.size(); ++i)
      out.triangles[first_corner[b] + i] =
          first_point[brick.triangles[i] / 256] + brick.triangles[i] % 256;
  });
}

void CellMerger::march(const Level& fine, const ContactRays& rays, std::uint32_t part,
                       const Flatness& flatness, CellSurface& out, int threads) {
  find_bricks(fine, threads);
  mark_rims(fine.grid, rays, part);
  Numbers all(count_);
  std::iota(all.begin(), all.end(), 0u);
  // A brick's own corners depend on its boxes and on those of the bricks below, its triangles on the
  // corners of the bricks above: so far reaches what is merged anew. All bricks are more than the nearest
  // caches hold: each walk over them does what it can.
  std::vector<std::uint8_t> good(count_);
  bool filled = false;
  Numbers failed = all, own = all, cut_again = all;
  while (!failed.empty()) {
    parallel_for(failed.size(), 32, threads, [&](std::size_t begin, std::size_t end) {
      BrickMerger merger;
      for (std::size_t i = begin; i < end; ++i) {
        Brick& brick = bricks_[failed[i]];
        if (!filled) fill(fine.grid, brick);
        merger.merge(brick, fine, flatness);
      }
    });
    filled = true;
    each(own, threads, [&](Brick& brick, std::uint32_t) { find_corners(fine, brick); });
    each(cut_again, threads, [&](Brick& brick, std::uint32_t b) { good[b] = cut(brick); });
    failed.clear();
    for (const std::uint32_t b : cut_again)
      if (!good[b]) failed.push_back(b);
    own = near(failed, 0, 1), cut_again = near(failed, -1, 1);
  }
  each(all, threads, [&](Brick& brick, std::uint32_t) { slide(brick); });
  take_back(all, threads);
  gather(fine, out, threads);
}

}  // namespace polyhull::refine
