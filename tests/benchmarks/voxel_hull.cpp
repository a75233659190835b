// SPDX-License-Identifier: LGPL-2.1-or-later
#include "voxel_hull.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::test {

VoxelHull::VoxelHull(const Bounds& bounds, int cells) : bounds_(bounds) {
  const Vec3 size = bounds.max - bounds.min;
  cell_ = std::max({size.x, size.y, size.z}) / cells;
  nx_ = static_cast<int>(std::ceil(size.x / cell_)) + 1;
  ny_ = static_cast<int>(std::ceil(size.y / cell_)) + 1;
  nz_ = static_cast<int>(std::ceil(size.z / cell_)) + 1;
  inside_.resize(static_cast<std::size_t>(nx_) * ny_ * nz_);
  hull_.origin = (bounds.min + bounds.max) * 0.5;
}

void VoxelHull::rasterise(const Silhouette& silhouette, Mask& mask) {
  const Camera& camera = *silhouette.camera;
  mask.KR = camera.K * camera.R;
  mask.Kt = camera.K * camera.t;
  mask.width = camera.width;
  mask.height = camera.height;
  mask.pixels.assign(static_cast<std::size_t>(mask.width) * mask.height, 0);
  // Even-odd: each edge turns all pixels to its right round, row by row.
  for (std::size_t r = 0; r < silhouette.rings->size(); ++r) {
    const auto ring = silhouette.rings->ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      Vec2 p(ring[i]), q(ring[i + 1 == ring.size() ? 0 : i + 1]);
      if (p.y > q.y) std::swap(p, q);
      const int first = std::max(0, static_cast<int>(std::ceil(p.y)));
      const int last = std::min(mask.height - 1, static_cast<int>(std::ceil(q.y)) - 1);
      for (int y = first; y <= last; ++y) {
        const double x = p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
        const int begin = std::max(0, static_cast<int>(std::ceil(x)));
        if (begin < mask.width) mask.pixels[static_cast<std::size_t>(y) * mask.width + begin] ^= 1;
      }
    }
  }
  Vec2f low(mask.width, mask.height), high(0, 0);
  for (const Vec2f& p : silhouette.rings->points) {
    low = glm::max(glm::min(low, p), Vec2f(0));
    high = glm::min(glm::max(high, p), Vec2f(mask.width - 1, mask.height - 1));
  }
  for (int y = static_cast<int>(low.y); y <= static_cast<int>(high.y); ++y) {
    std::uint8_t* row = &mask.pixels[static_cast<std::size_t>(y) * mask.width];
    std::uint8_t in = 0;
    for (int x = static_cast<int>(low.x); x <= static_cast<int>(high.x) + 1 && x < mask.width;
         ++x) {
      row[x] = in ^= row[x];
    }
  }
}

void VoxelHull::fill_row(int y, int z) {
  std::uint8_t* row = &inside_[(static_cast<std::size_t>(z) * ny_ + y) * nx_];
  std::fill_n(row, nx_, std::uint8_t(y > 0 && z > 0 && y < ny_ - 1 && z < nz_ - 1));
  if (!row[0]) return;
  row[0] = row[nx_ - 1] = 0;
  const Vec3 start = bounds_.min + cell_ * Vec3(0, y, z);
  int begin = 1, end = nx_ - 1;
  for (const Mask& mask : masks_) {
    const Vec3 h0 = mask.KR * start + mask.Kt, step = cell_ * mask.KR[0];
    int low = nx_, high = 0;
    for (int x = begin; x < end; ++x) {
      if (!row[x]) continue;
      const Vec3 h = h0 + double(x) * step;
      const double w = 1.0 / h.z;
      const int u = static_cast<int>(h.x * w + 0.5), v = static_cast<int>(h.y * w + 0.5);
      const bool seen =
          h.z > 0 && unsigned(u) < unsigned(mask.width) && unsigned(v) < unsigned(mask.height);
      row[x] = seen ? mask.pixels[static_cast<std::size_t>(v) * mask.width + u] : 0;
      if (row[x]) {
        low = std::min(low, x);
        high = x + 1;
      }
    }
    begin = low;
    end = high;
    if (begin >= end) return;
  }
}

void VoxelHull::march_layer(int z) {
  // Six tetrahedra around each cell's diagonal 0-7; corner k is at (k & 1, k >> 1 & 1, k >> 2 & 1).
  static constexpr int tetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                           {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  // Ids of the cut edges that begin in this layer of nodes and in the next; the one before is
  // forgotten.
  const std::size_t layer = static_cast<std::size_t>(nx_) * ny_;
  std::fill_n(vertex_of_.begin() + static_cast<std::ptrdiff_t>((z + 1) % 2 * layer * 7), layer * 7,
              -1);
  for (int y = 0; y + 1 < ny_; ++y) {
    for (int x = 0; x + 1 < nx_; ++x) {
      std::array<std::size_t, 8> node;
      int sum = 0;
      for (int k = 0; k < 8; ++k) {
        node[k] =
            (static_cast<std::size_t>(z + (k >> 2)) * ny_ + y + (k >> 1 & 1)) * nx_ + x + (k & 1);
        sum += inside_[node[k]];
      }
      if (sum == 0 || sum == 8) continue;
      const auto vertex = [&](int a, int b) {
        const int low = std::min(a, b),
                  direction = std::max(a, b) - low;  // 1..7: the edge's direction
        std::int32_t& id = vertex_of_[(node[low] % (2 * layer)) * 7 + direction - 1];
        if (id < 0) {
          id = static_cast<std::int32_t>(hull_.vertices.size());
          const auto at = [&](int k) { return Vec3(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)); };
          hull_.vertices.emplace_back(bounds_.min + cell_ * 0.5 * (at(a) + at(b)) - hull_.origin);
        }
        return static_cast<std::uint32_t>(id);
      };
      const auto emit = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        hull_.triangles.insert(hull_.triangles.end(), {a, b, c});
      };
      for (const auto& t : tetrahedra) {
        int in[4], out[4], n = 0, m = 0;
        for (int k : t) (inside_[node[k]] ? in[n++] : out[m++]) = k;
        if (n == 0 || m == 0) continue;
        // Orientation: make (order of corners) even as in t by the sign of the permutation.
        int order[4], parity = 0;
        for (int k = 0; k < n; ++k) order[k] = in[k];
        for (int k = 0; k < m; ++k) order[n + k] = out[k];
        int place[8] = {};
        for (int k = 0; k < 4; ++k) place[t[k]] = k;
        for (int a = 0; a < 4; ++a) {
          for (int b = a + 1; b < 4; ++b) parity ^= place[order[a]] > place[order[b]];
        }
        if (n == 1) {
          const auto a = vertex(in[0], out[0]), b = vertex(in[0], out[1]),
                     c = vertex(in[0], out[2]);
          parity ? emit(a, c, b) : emit(a, b, c);
        } else if (n == 3) {
          const auto a = vertex(in[0], out[0]), b = vertex(in[1], out[0]),
                     c = vertex(in[2], out[0]);
          parity ? emit(a, c, b) : emit(a, b, c);
        } else {
          const auto a = vertex(in[0], out[0]), b = vertex(in[0], out[1]),
                     c = vertex(in[1], out[1]), d = vertex(in[1], out[0]);
          if (parity) {
            emit(a, c, b);
            emit(a, d, c);
          } else {
            emit(a, b, c);
            emit(a, c, d);
          }
        }
      }
    }
  }
}

const Hull& VoxelHull::build(std::span<const Silhouette> silhouettes, int threads) {
  masks_.resize(silhouettes.size());
  parallel_for(silhouettes.size(), 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) rasterise(silhouettes[i], masks_[i]);
  });
  parallel_for(static_cast<std::size_t>(nz_), 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      for (int y = 0; y < ny_; ++y) fill_row(y, static_cast<int>(z));
    }
  });
  hull_.vertices.clear();
  hull_.triangles.clear();
  vertex_of_.assign(static_cast<std::size_t>(nx_) * ny_ * 2 * 7, -1);
  for (int z = 0; z + 1 < nz_; ++z) march_layer(z);
  return hull_;
}

}  // namespace polyhull::test
