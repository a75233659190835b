// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/coverage_raster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/thread_pool.h"
#include "studio/cameras/coverage_samples.h"

namespace polyhull {

using namespace coverage;

namespace {

constexpr int band_rows = 16;

}  // namespace

/// What the pixels of one band of rows hold while triangles are drawn into it.
struct CoverageRaster::Band {
  int first_row, rows, x0, width;
  struct Pixel {
    alignas(16) float depth[depth_samples];  // inverse, 0: nothing
    alignas(16) std::uint32_t triangle[depth_samples];
    std::uint64_t covered;
    std::uint32_t any;  // a triangle that covers a sample
    float centre;       // inverse depth at the centre
  };
  std::vector<Pixel> pixels;
  Pixel& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y - first_row) * width + (x - x0)];
  }
  const Pixel& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y - first_row) * width + (x - x0)];
  }
};

void CoverageRaster::cover(const Triangle& t, std::uint32_t index, Band& band) const {
  std::int32_t a[3], b[3];
  EdgeSteps steps[3];
  for (int k = 0; k < 3; ++k) {
    const int n = (k + 1) % 3;
    a[k] = t.y[k] - t.y[n];
    b[k] = t.x[n] - t.x[k];
    steps[k] = edge_steps(a[k], b[k]);
  }
  const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
  const auto [top, bottom] = std::minmax({t.y[0], t.y[1], t.y[2]});
  const int x_first = std::max(floor_pixel(left), band.x0);
  const int x_last = std::min(floor_pixel(right), band.x0 + band.width - 1);
  const int y_first = std::max(floor_pixel(top), band.first_row);
  const int y_last = std::min(floor_pixel(bottom), band.first_row + band.rows - 1);

  // Inverse depth as a plane over the screen.
  const float x1 = static_cast<float>(t.x[1] - t.x[0]), y1 = static_cast<float>(t.y[1] - t.y[0]);
  const float x2 = static_cast<float>(t.x[2] - t.x[0]), y2 = static_cast<float>(t.y[2] - t.y[0]);
  const float d1 = t.inverse_depth[1] - t.inverse_depth[0],
              d2 = t.inverse_depth[2] - t.inverse_depth[0];
  const float area = x1 * y2 - x2 * y1;
  const float gx = (d1 * y2 - d2 * y1) / area, gy = (d2 * x1 - d1 * x2) / area;
  // Needles have wild planes; nothing of a triangle is nearer or farther than its corners.
  const auto [far, near] =
      std::minmax({t.inverse_depth[0], t.inverse_depth[1], t.inverse_depth[2]});

  for (int y = y_first; y <= y_last; ++y) {
    for (int x = x_first; x <= x_last; ++x) {
      std::int32_t e[3];
      bool out = false, full = true;
      for (int k = 0; k < 3; ++k) {
        e[k] = a[k] * (x * unit - t.x[k]) + b[k] * (y * unit - t.y[k]);
        out |= e[k] + steps[k].reach < 0;
        full &= e[k] - steps[k].reach >= 0;
      }
      if (out) continue;
      Band::Pixel& pixel = band.at(x, y);
      const float centre = t.inverse_depth[0] + gx * static_cast<float>(x * unit - t.x[0]) +
                           gy * static_cast<float>(y * unit - t.y[0]);
      if ((e[0] | e[1] | e[2]) >= 0)
        pixel.centre = std::max(pixel.centre, std::clamp(centre, far, near));
      const std::uint64_t mask = full ? ~std::uint64_t{0} : inside(e, steps);
      if (mask == 0) continue;
      pixel.covered |= mask;
      pixel.any = index;
      const std::uint32_t bits = depth_bits(mask);
      if (bits != 0)
        test_depth(bits, centre, gx, gy, far, near, index, pixel.depth, pixel.triangle);
    }
  }
}

Fragment CoverageRaster::fragment(std::uint32_t index, float x, float y) const {
  const Triangle& t = triangles_[index];
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
  w /= sum;
  Fragment f;
  f.triangle = t.source;
  f.depth = w.x / t.inverse_depth[0] + w.y / t.inverse_depth[1] + w.z / t.inverse_depth[2];
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

void CoverageRaster::resolve(const Band& band, int x, int y, float separation,
                             CoveredPixel& out) const {
  const Band::Pixel& pixel = band.at(x, y);
  out.x = x;
  out.coverage = static_cast<float>(std::popcount(pixel.covered)) / samples;
  out.centre_depth = pixel.centre > 0.0f ? 1.0f / pixel.centre : 0.0f;
  out.fragment_count = 0;
  std::uint32_t left = 0;
  for (int k = 0; k < depth_samples; ++k)
    left |= static_cast<std::uint32_t>(pixel.depth[k] > 0.0f) << k;
  const auto total = static_cast<float>(std::popcount(left));
  const float px = static_cast<float>(x * unit), py = static_cast<float>(y * unit);
  if (left == 0) {
    out.fragments[out.fragment_count++] = fragment(pixel.any, px, py);
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
    f = fragment(pixel.triangle[best], px + centre.x, py + centre.y);
    f.weight = count / total;
    left &= ~members;
  }
}

void CoverageRaster::draw_band(int first_row, int rows, const Rectangle& region,
                               std::span<const std::uint32_t> list, float separation,
                               const RowSink& sink) const {
  thread_local Band band;
  band.first_row = first_row;
  band.rows = rows;
  band.x0 = region.x;
  band.width = region.width;
  Band::Pixel empty{};
  empty.any = nothing;
  band.pixels.assign(static_cast<std::size_t>(rows) * region.width, empty);
  for (const std::uint32_t index : list) cover(triangles_[index], index, band);
  thread_local std::vector<CoveredPixel> row;
  for (int y = first_row; y < first_row + rows; ++y) {
    row.clear();
    for (int x = region.x; x < region.x + region.width; ++x) {
      if (band.at(x, y).covered == 0) continue;
      row.emplace_back();
      resolve(band, x, y, separation, row.back());
    }
    if (!row.empty()) sink(y, row);
  }
}

Rectangle CoverageRaster::drawn_region() const {
  if (triangles_.empty()) return {};
  std::int32_t left = INT32_MAX, right = INT32_MIN, top = INT32_MAX, bottom = INT32_MIN;
  for (const Triangle& t : triangles_) {
    for (int k = 0; k < 3; ++k) {
      left = std::min(left, t.x[k]);
      right = std::max(right, t.x[k]);
      top = std::min(top, t.y[k]);
      bottom = std::max(bottom, t.y[k]);
    }
  }
  Rectangle region;
  region.x = std::max(floor_pixel(left), 0);
  region.y = std::max(floor_pixel(top), 0);
  region.width = std::min(floor_pixel(right), camera_->width - 1) - region.x + 1;
  region.height = std::min(floor_pixel(bottom), camera_->height - 1) - region.y + 1;
  return region;
}

int CoverageRaster::sort_into_bands(const Rectangle& region) {
  const int bands = (region.height + band_rows - 1) / band_rows;
  if (static_cast<int>(bands_.size()) < bands) bands_.resize(bands);
  for (auto& list : bands_) list.clear();
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    const auto [first, last] =
        std::minmax({triangles_[i].y[0], triangles_[i].y[1], triangles_[i].y[2]});
    const int from = std::max(floor_pixel(first) - region.y, 0) / band_rows;
    const int to = std::min((floor_pixel(last) - region.y) / band_rows, bands - 1);
    for (int b = from; b <= to; ++b) bands_[b].push_back(i);
  }
  return bands;
}

Rectangle CoverageRaster::draw(const Camera& camera, const Mesh& mesh, const RowSink& sink) {
  camera_ = &camera;
  find_valid_region(camera);
  const Mat3 linear = camera.R * mesh.linear;
  const Vec3 origin = camera.R * mesh.origin + camera.t;
  vertices_.resize(mesh.positions.size());
  parallel_for(mesh.positions.size(), 4096, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      vertices_[i] = project(linear * Vec3(mesh.positions[i]) + origin);
  });
  // From inside the subject its surface is seen from behind.
  two_sided_ = false;
  for (std::size_t i = 0; i < vertices_.size() && !two_sided_; ++i)
    two_sided_ = vertices_[i].position.z < 0.0;

  split_all(mesh.triangles);
  const Rectangle region = drawn_region();
  if (region.empty()) return {};
  const int bands = sort_into_bands(region);
  parallel_for(bands, 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const int row = region.y + static_cast<int>(b) * band_rows;
      draw_band(row, std::min(band_rows, region.y + region.height - row), region, bands_[b],
                mesh.separation, sink);
    }
  });
  return region;
}

}  // namespace polyhull
