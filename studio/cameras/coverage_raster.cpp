// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/coverage_raster.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/instruction_set.h"
#include "base/thread_pool.h"
#include "studio/cameras/coverage_samples.h"

namespace polyhull {

using namespace coverage;

namespace {

using Int4 = int __attribute__((vector_size(16)));
using Float4 = float __attribute__((vector_size(16)));

}  // namespace

struct CoverageRaster::Samples {
  alignas(16) float depth[depth_samples];  // inverse, 0: nothing
  alignas(16) std::uint32_t triangle[depth_samples];
  std::uint64_t covered;
  std::uint32_t any;  // a triangle that covers a sample
};

/// What the pixels of one band of rows hold while triangles are drawn into it.
struct CoverageRaster::Band {
  int first_row, rows, x0, width;
  // Of each pixel, with some to spare at the end of a row:
  int stride;
  std::vector<float> centres;              // inverse depth there, 0: nothing
  std::vector<std::uint32_t> triangles;    // that are nearest there
  std::vector<std::int32_t> sample_index;  // -1: takes none

  std::vector<Samples> samples;
  std::vector<std::uint64_t> sampled;  // a bit for each pixel that takes samples, in words per row
  int words;

  void begin(int y, int count, const Rectangle& region) {
    first_row = y;
    rows = count;
    x0 = region.x;
    width = region.width;
    words = (width + 63) / 64;
    stride = width + 3;
    centres.assign(static_cast<std::size_t>(rows) * stride, 0.0f);
    triangles.resize(centres.size());
    sample_index.assign(centres.size(), -1);
    samples.clear();
    sampled.assign(static_cast<std::size_t>(rows) * words, 0);
  }

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y - first_row) * stride + (x - x0);
  }
  void take_samples(int x, int y) {
    std::int32_t& index = sample_index[at(x, y)];
    if (index >= 0) return;
    index = static_cast<std::int32_t>(samples.size());
    samples.push_back({});
    samples.back().any = nothing;
    sampled[(y - first_row) * words + (x - x0) / 64] |= std::uint64_t{1} << ((x - x0) % 64);
  }
  /// Calls body(x) for the pixels x_first .. x_last of row y that take samples.
  template <class Body>
  [[gnu::always_inline]] void for_sampled(int y, int x_first, int x_last, Body&& body) const {
    const std::uint64_t* row = &sampled[static_cast<std::size_t>(y - first_row) * words];
    const int first = x_first - x0, last = x_last - x0;
    for (int word = first / 64; word <= last / 64; ++word) {
      std::uint64_t bits = row[word];
      if (word == first / 64) bits &= ~std::uint64_t{0} << (first % 64);
      if (word == last / 64) bits &= ~std::uint64_t{0} >> (63 - last % 64);
      for (; bits != 0; bits &= bits - 1) body(x0 + 64 * word + std::countr_zero(bits));
    }
  }
};

/// What covering a triangle begins with: edge functions a x + b y (positive inside) and the inverse
/// depth as a plane over the screen.
struct CoverageRaster::Setup {
  std::int32_t a[3], b[3];
  float gx, gy, far, near;

  explicit Setup(const Triangle& t) {
    for (int k = 0; k < 3; ++k) {
      const int n = (k + 1) % 3;
      a[k] = t.y[k] - t.y[n];
      b[k] = t.x[n] - t.x[k];
    }
    const float x1 = static_cast<float>(t.x[1] - t.x[0]), y1 = static_cast<float>(t.y[1] - t.y[0]);
    const float x2 = static_cast<float>(t.x[2] - t.x[0]), y2 = static_cast<float>(t.y[2] - t.y[0]);
    const float d1 = t.inverse_depth[1] - t.inverse_depth[0],
                d2 = t.inverse_depth[2] - t.inverse_depth[0];
    const float area = x1 * y2 - x2 * y1;
    gx = (d1 * y2 - d2 * y1) / area;
    gy = (d2 * x1 - d1 * x2) / area;
    // Needles have wild planes; nothing of a triangle is nearer or farther than its corners.
    far = std::min({t.inverse_depth[0], t.inverse_depth[1], t.inverse_depth[2]});
    near = std::max({t.inverse_depth[0], t.inverse_depth[1], t.inverse_depth[2]});
  }
};

[[gnu::always_inline]] inline void CoverageRaster::cover_centres(const Triangle& t, const Setup& s,
                                                                 std::uint32_t index, int x_first,
                                                                 int x_last, int y_first,
                                                                 int y_last, Band& band) {
  const Int4 places = {0, unit, 2 * unit, 3 * unit};
  const Float4 far = Float4{} + s.far, near = Float4{} + s.near;
  for (int y = y_first; y <= y_last; ++y) {
    const std::int32_t dy = y * unit;
    for (int x = x_first; x <= x_last; x += 4) {
      const Int4 dx = places + x * unit;
      const Int4 outside = (s.a[0] * (dx - t.x[0]) + s.b[0] * (dy - t.y[0])) |
                           (s.a[1] * (dx - t.x[1]) + s.b[1] * (dy - t.y[1])) |
                           (s.a[2] * (dx - t.x[2]) + s.b[2] * (dy - t.y[2]));
      Float4 depth = t.inverse_depth[0] + s.gx * __builtin_convertvector(dx - t.x[0], Float4) +
                     s.gy * static_cast<float>(dy - t.y[0]);
      depth = depth > far ? depth : far;
      depth = depth < near ? depth : near;
      float* const centres = &band.centres[band.at(x, y)];
      std::uint32_t* const triangles = &band.triangles[band.at(x, y)];
      Float4 before;
      Int4 whose;
      std::memcpy(&before, centres, sizeof before);
      std::memcpy(&whose, triangles, sizeof whose);
      const Int4 wins = (outside >= 0) & (depth > before);
      before = wins ? depth : before;
      whose = wins ? Int4{} + static_cast<int>(index) : whose;
      std::memcpy(centres, &before, sizeof before);
      std::memcpy(triangles, &whose, sizeof whose);
    }
  }
}

[[gnu::always_inline]] inline void CoverageRaster::cover_samples(const Triangle& t, const Setup& s,
                                                                 std::uint32_t index, int x, int y,
                                                                 Samples& samples) {
  std::int32_t e[3];
  EdgeSteps steps[3];
  bool out = false, full = true;
  for (int k = 0; k < 3; ++k) {
    e[k] = s.a[k] * (x * unit - t.x[k]) + s.b[k] * (y * unit - t.y[k]);
    steps[k] = edge_steps(s.a[k], s.b[k]);
    out |= e[k] + steps[k].reach < 0;
    full &= e[k] - steps[k].reach >= 0;
  }
  if (out) return;
  const std::uint64_t mask = full ? ~std::uint64_t{0} : inside(e, steps);
  if (mask == 0) return;
  samples.covered |= mask;
  samples.any = index;
  const std::uint32_t bits = depth_bits(mask);
  if (bits == 0) return;
  const float centre = t.inverse_depth[0] + s.gx * static_cast<float>(x * unit - t.x[0]) +
                       s.gy * static_cast<float>(y * unit - t.y[0]);
  test_depth(bits, centre, s.gx, s.gy, s.far, s.near, index, samples.depth, samples.triangle);
}

[[gnu::always_inline]] inline void CoverageRaster::cover(const Triangle& t, std::uint32_t index,
                                                         Band& band) const {
  const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
  const auto [top, bottom] = std::minmax({t.y[0], t.y[1], t.y[2]});
  const int band_right = band.x0 + band.width - 1, band_bottom = band.first_row + band.rows - 1;
  const Setup s(t);
  cover_centres(
      t, s, index, std::max(next_centre(left), band.x0), std::min(last_centre(right), band_right),
      std::max(next_centre(top), band.first_row), std::min(last_centre(bottom), band_bottom), band);
  const int x_first = std::max(floor_pixel(left), band.x0);
  const int x_last = std::min(floor_pixel(right), band_right);
  const int y_last = std::min(floor_pixel(bottom), band_bottom);
  if (x_first > x_last) return;
  for (int y = std::max(floor_pixel(top), band.first_row); y <= y_last; ++y)
    band.for_sampled(
        y, x_first, x_last, [&](int x) __attribute__((always_inline)) {
          cover_samples(t, s, index, x, y, band.samples[band.sample_index[band.at(x, y)]]);
        });
}

void CoverageRaster::cover_all(std::span<const Triangle> list, Band& band) const {
  for (std::uint32_t i = 0; i < list.size(); ++i) cover(list[i], i, band);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]]  // without fused multiplication: the same bits
#endif
void CoverageRaster::cover_all_avx2(std::span<const Triangle> list, Band& band) const {
  for (std::uint32_t i = 0; i < list.size(); ++i) cover(list[i], i, band);
}

void CoverageRaster::mark_outlines(const Triangle& t, Band& band) const {
  for (int k = 0; k < 3; ++k) {
    if (!(t.outlines >> k & 1)) continue;
    const int n = (k + 1) % 3;
    const auto [left, right] = std::minmax(t.x[k], t.x[n]);
    const auto [top, bottom] = std::minmax(t.y[k], t.y[n]);
    const int y_first = std::max(floor_pixel(top), band.first_row);
    const int y_last = std::min(floor_pixel(bottom), band.first_row + band.rows - 1);
    const double slope = static_cast<double>(t.x[n] - t.x[k]) / std::max(bottom - top, 1) *
                         (t.y[n] < t.y[k] ? -1.0 : 1.0);
    for (int y = y_first; y <= y_last; ++y) {
      // Where the edge enters the row and leaves it, to the next whole numbers outside.
      const double from = t.x[k] + slope * (y * unit - unit / 2 - t.y[k]);
      const double to = t.x[k] + slope * (y * unit + unit / 2 - t.y[k]);
      const auto [low, high] = std::minmax(from, to);
      const int first = static_cast<int>(std::clamp<double>(std::floor(low), left, right));
      const int last = static_cast<int>(std::clamp<double>(std::ceil(high), left, right));
      const int x_last = std::min(floor_pixel(last), band.x0 + band.width - 1);
      for (int x = std::max(floor_pixel(first), band.x0); x <= x_last; ++x) band.take_samples(x, y);
    }
  }
}

inline Vec3f CoverageRaster::weights(const Triangle& t, float x, float y) const {
  Vec3f w;
  for (int k = 0; k < 3; ++k) {
    const int p = (k + 1) % 3, q = (k + 2) % 3;
    // The edge opposite to corner k.
    const float value = static_cast<float>(t.y[p] - t.y[q]) * (x - static_cast<float>(t.x[p])) +
                        static_cast<float>(t.x[q] - t.x[p]) * (y - static_cast<float>(t.y[p]));
    w[k] = std::max(value, 0.0f) * t.inverse_depth[k];
  }
  float sum = w.x + w.y + w.z;
  if (!(sum > 0.0f)) {
    w = Vec3f(t.inverse_depth[0], t.inverse_depth[1], t.inverse_depth[2]);
    sum = w.x + w.y + w.z;
  }
  return w / sum;
}

inline Fragment CoverageRaster::fragment(const Triangle& t, const Vec3f& w, float depth) const {
  Fragment f;
  f.triangle = t.source;
  f.depth = depth;
  if (t.corners == nothing - 1) {
    f.at = {w.x, w.z, w.y};
  } else if (t.corners == nothing - 2) {
    f.at = w;
  } else {
    const Vec3f* c = &corner_coordinates_[t.corners];
    f.at = c[0] * w.x + c[1] * w.y + c[2] * w.z;
  }
  return f;
}

Fragment CoverageRaster::fragment(const Triangle& t, float x, float y) const {
  const Vec3f w = weights(t, x, y);
  return fragment(t, w,
                  w.x / t.inverse_depth[0] + w.y / t.inverse_depth[1] + w.z / t.inverse_depth[2]);
}

/// A pixel that one triangle covers.
[[gnu::always_inline]] inline void CoverageRaster::show(const Triangle& t, float depth, int x,
                                                        int y, CoveredPixel& out) const {
  out.x = x;
  out.centre_depth = depth;
  out.coverage = 1.0f;
  out.fragment_count = 1;
  out.fragments[0] =
      fragment(t, weights(t, static_cast<float>(x * unit), static_cast<float>(y * unit)), depth);
  out.fragments[0].weight = 1.0f;
}

/// A pixel that takes samples.
void CoverageRaster::resolve(std::span<const Triangle> list, const Band& band, int x, int y,
                             float separation, CoveredPixel& out) const {
  const std::size_t at = band.at(x, y);
  const float px = static_cast<float>(x * unit), py = static_cast<float>(y * unit);
  out.x = x;
  out.centre_depth = band.centres[at] > 0.0f ? 1.0f / band.centres[at] : 0.0f;
  const Samples& pixel = band.samples[band.sample_index[at]];
  out.coverage = static_cast<float>(std::popcount(pixel.covered)) / samples;
  out.fragment_count = 0;
  std::uint32_t left = 0;
  for (int k = 0; k < depth_samples; ++k)
    left |= static_cast<std::uint32_t>(pixel.depth[k] > 0.0f) << k;
  const auto total = static_cast<float>(std::popcount(left));
  if (left == 0) {
    out.fragments[out.fragment_count++] = fragment(list[pixel.any], px, py);
    out.fragments[0].weight = 1.0f;
    return;
  }
  while (left != 0) {
    float nearest = 0.0f;
    for (int k = 0; k < depth_samples; ++k)
      if (left >> k & 1) nearest = std::max(nearest, pixel.depth[k]);
    // The last fragment takes what remains.
    const bool last = out.fragment_count == 3;
    const float limit = last ? 0.0f : 1.0f / (1.0f / nearest + separation);
    std::uint32_t members = 0;
    Vec2f centre(0.0f);
    for (int k = 0; k < depth_samples; ++k) {
      if ((left >> k & 1) && pixel.depth[k] >= limit) {
        members |= 1u << k;
        centre += Vec2f(pattern.x[k], pattern.y[k]);
      }
    }
    const auto count = static_cast<float>(std::popcount(members));
    centre /= count;
    int best = 0;
    float least = 1e30f;
    for (int k = 0; k < depth_samples; ++k) {
      if (!(members >> k & 1)) continue;
      const Vec2f d = Vec2f(pattern.x[k], pattern.y[k]) - centre;
      if (glm::dot(d, d) < least) {
        least = glm::dot(d, d);
        best = k;
      }
    }
    Fragment& f = out.fragments[out.fragment_count++];
    f = fragment(list[pixel.triangle[best]], px + centre.x, py + centre.y);
    f.weight = count / total;
    left &= ~members;
  }
}

void CoverageRaster::draw_band(int first_row, int rows, const Rectangle& region,
                               std::span<const Triangle> list, float separation,
                               const RowSink& sink) const {
  thread_local Band bands_memory;
  thread_local std::vector<CoveredPixel> rows_memory;  // never shorter, so that it is cleared once
  Band& band = bands_memory;
  std::vector<CoveredPixel>& row = rows_memory;
  band.begin(first_row, rows, region);
  if (everywhere_) {
    for (int y = first_row; y < first_row + rows; ++y)
      for (int x = region.x; x < region.x + region.width; ++x) band.take_samples(x, y);
  } else {
    for (const Triangle& triangle : list)
      if (triangle.outlines != 0) mark_outlines(triangle, band);
  }
  static const bool avx2 = may_use_avx2();
  avx2 ? cover_all_avx2(list, band) : cover_all(list, band);
  if (row.size() < static_cast<std::size_t>(region.width)) row.resize(region.width);
  for (int y = first_row; y < first_row + rows; ++y) {
    std::size_t count = 0;
    for (int x = region.x; x < region.x + region.width; ++x) {
      const std::size_t at = band.at(x, y);
      const std::int32_t samples = band.sample_index[at];
      if (samples >= 0) {
        if (band.samples[samples].covered != 0) resolve(list, band, x, y, separation, row[count++]);
      } else if (band.centres[at] > 0.0f) {
        show(list[band.triangles[at]], 1.0f / band.centres[at], x, y, row[count++]);
      }
    }
    if (count > 0) sink(y, {row.data(), count});
  }
}

Rectangle CoverageRaster::draw(const Camera& camera, const Mesh& mesh, const RowSink& sink) {
  camera_ = &camera;
  find_valid_region(camera);
  linear_ = camera.R * mesh.linear;
  origin_ = camera.R * mesh.origin + camera.t;
  vertices_.resize(mesh.positions.size());
  std::atomic<bool> behind = false;
  parallel_each(mesh.positions.size(), 4096, 0, [&](std::size_t i) {
    const Vertex vertex = project(linear_ * Vec3(mesh.positions[i]) + origin_);
    vertices_[i] = vertex;
    if (vertex.position.z < 0.0) behind = true;
  });
  // From inside the subject its surface is seen from behind.
  two_sided_ = behind;
  everywhere_ = mesh.neighbours.empty() || two_sided_;

  split_all(mesh);
  if (drawn_.right < drawn_.left) return {};
  Rectangle region;
  region.x = std::max(floor_pixel(drawn_.left), 0);
  region.y = std::max(floor_pixel(drawn_.top), 0);
  region.width = std::min(floor_pixel(drawn_.right), camera.width - 1) - region.x + 1;
  region.height = std::min(floor_pixel(drawn_.bottom), camera.height - 1) - region.y + 1;
  parallel_each(bands_.size(), 1, 0, [&](std::size_t b) {
    if (bands_[b].empty()) return;
    const int band = static_cast<int>(b) * band_rows;
    const int first = std::max(band, region.y);
    const int rows = std::min(band + band_rows, region.y + region.height) - first;
    draw_band(first, rows, region, bands_[b], mesh.separation, sink);
  });
  return region;
}

}  // namespace polyhull
