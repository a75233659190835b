// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/coverage_raster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/thread_pool.h"
#include "rig/lens.h"
#include "studio/cameras/coverage_samples.h"

namespace polyhull {

using namespace coverage;

namespace {

constexpr std::int32_t longest_edge = 16 * unit;
constexpr int deepest_split = 14;
constexpr int deepest_split_behind = 6;  // of triangles that reach behind the camera
constexpr int band_rows = 16;
constexpr std::uint32_t nothing = ~std::uint32_t{0};

std::int32_t floor_pixel(std::int32_t fixed) {
  return (fixed + unit / 2) >> 10;
}

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

CoverageRaster::Vertex CoverageRaster::project(const Vec3& position) const {
  Vertex v;
  v.position = position;
  if (!(position.z > 1e-6)) return v;
  const Vec3 h = camera_->K * (position / position.z);
  const Vec2 ideal(h);
  v.ideal = ideal;
  v.in_front = true;
  if (!(ideal.x > valid_min_.x && ideal.y > valid_min_.y && ideal.x < valid_max_.x &&
        ideal.y < valid_max_.y))
    return v;
  const Vec2 real = camera_->has_distortion() ? camera_->distort(ideal) : ideal;
  if (!(std::abs(real.x) < 1e6 && std::abs(real.y) < 1e6)) return v;
  v.x = static_cast<std::int32_t>(std::lround(real.x * unit));
  v.y = static_cast<std::int32_t>(std::lround(real.y * unit));
  v.inverse_depth = static_cast<float>(1.0 / position.z);
  v.valid = true;
  return v;
}

void CoverageRaster::find_valid_region(const Camera& camera) {
  std::vector<double> lens = {camera.K[0][0],
                              camera.K[1][0],
                              camera.K[1][1],
                              camera.K[2][0],
                              camera.K[2][1],
                              static_cast<double>(camera.width),
                              static_cast<double>(camera.height)};
  lens.insert(lens.end(), camera.distortion.begin(), camera.distortion.end());
  if (lens == known_lens_) return;
  known_lens_ = std::move(lens);
  // A margin wider than the longest edge: what is dropped for lying outside touches no pixel.
  constexpr double margin = 32.0;
  const double w = camera.width - 0.5 + margin, h = camera.height - 0.5 + margin, o = -0.5 - margin;
  if (!camera.has_distortion()) {
    valid_min_ = {o, o};
    valid_max_ = {w, h};
    return;
  }
  valid_min_ = Vec2(1e30);
  valid_max_ = Vec2(-1e30);
  const Lens lens_model(camera);
  constexpr int steps = 64;
  for (int i = 0; i <= steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    for (const Vec2& real : {Vec2(o + (w - o) * s, o), Vec2(o + (w - o) * s, h),
                             Vec2(o, o + (h - o) * s), Vec2(w, o + (h - o) * s)}) {
      const Vec2 ideal = lens_model.undistort(real);
      valid_min_ = glm::min(valid_min_, ideal);
      valid_max_ = glm::max(valid_max_, ideal);
    }
  }
}

void CoverageRaster::emit(const Corner* const corners[3], std::uint32_t source, bool whole) {
  const Vertex *a = &corners[0]->vertex, *b = &corners[1]->vertex, *c = &corners[2]->vertex;
  const std::int64_t area = static_cast<std::int64_t>(b->x - a->x) * (c->y - a->y) -
                            static_cast<std::int64_t>(c->x - a->x) * (b->y - a->y);
  // y points down, so the outside of a triangle has negative area.
  if (area == 0 || (area > 0 && !two_sided_)) return;
  const int order[3] = {0, area < 0 ? 2 : 1, area < 0 ? 1 : 2};
  Triangle t;
  for (int k = 0; k < 3; ++k) {
    const Vertex& v = corners[order[k]]->vertex;
    t.x[k] = v.x;
    t.y[k] = v.y;
    t.inverse_depth[k] = v.inverse_depth;
  }
  const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
  const auto [top, bottom] = std::minmax({t.y[0], t.y[1], t.y[2]});
  if (floor_pixel(right) < 0 || floor_pixel(bottom) < 0 || floor_pixel(left) >= camera_->width ||
      floor_pixel(top) >= camera_->height)
    return;
  t.source = source;
  t.corners = static_cast<std::uint32_t>(corner_coordinates_.size());
  // Whole triangles need no coordinates of their own, only the order that was chosen.
  if (whole)
    t.corners = nothing - 1 - (area > 0);
  else
    for (const int k : order) corner_coordinates_.push_back(corners[k]->at);
  triangles_.push_back(t);
}

void CoverageRaster::split(const Corner& a, const Corner& b, const Corner& c, std::uint32_t source,
                           int depth) {
  const Corner* corner[3] = {&a, &b, &c};
  const Vertex *va = &a.vertex, *vb = &b.vertex, *vc = &c.vertex;
  if (!va->in_front && !vb->in_front && !vc->in_front) return;
  if (va->in_front && vb->in_front && vc->in_front) {
    const Vec2 least = glm::min(glm::min(va->ideal, vb->ideal), vc->ideal);
    const Vec2 most = glm::max(glm::max(va->ideal, vb->ideal), vc->ideal);
    if (most.x < valid_min_.x || most.y < valid_min_.y || least.x > valid_max_.x ||
        least.y > valid_max_.y)
      return;
  }
  bool cut[3];
  int cuts = 0;
  for (int k = 0; k < 3; ++k) {
    const Vertex &p = corner[k]->vertex, &q = corner[(k + 1) % 3]->vertex;
    if (p.valid && q.valid) {
      cut[k] = std::abs(p.x - q.x) > longest_edge || std::abs(p.y - q.y) > longest_edge;
    } else if (p.in_front && q.in_front) {
      const Vec2 d = glm::abs(p.ideal - q.ideal) * static_cast<double>(unit);
      cut[k] = std::max(d.x, d.y) > longest_edge;
    } else {
      cut[k] = depth < deepest_split_behind;
    }
    cut[k] &= depth < deepest_split;
    cuts += cut[k];
  }
  if (cuts == 0) {
    if (va->valid && vb->valid && vc->valid) emit(corner, source, depth == 0);
    return;
  }
  Corner middle[3];
  for (int k = 0; k < 3; ++k) {
    if (!cut[k]) continue;
    const Corner &p = *corner[k], &q = *corner[(k + 1) % 3];
    middle[k].vertex = project(0.5 * (p.vertex.position + q.vertex.position));
    middle[k].at = 0.5f * (p.at + q.at);
  }
  if (cuts == 3) {
    split(a, middle[0], middle[2], source, depth + 1);
    split(middle[0], b, middle[1], source, depth + 1);
    split(middle[2], middle[1], c, source, depth + 1);
    split(middle[0], middle[1], middle[2], source, depth + 1);
    return;
  }
  for (int k = 0; k < 3; ++k) {
    const Corner &p = *corner[k], &q = *corner[(k + 1) % 3], &r = *corner[(k + 2) % 3];
    if (cuts == 1 && cut[k]) {
      split(p, middle[k], r, source, depth + 1);
      split(middle[k], q, r, source, depth + 1);
    } else if (cuts == 2 && !cut[k]) {
      // The two cut edges meet in r.
      split(p, q, middle[(k + 1) % 3], source, depth + 1);
      split(p, middle[(k + 1) % 3], middle[(k + 2) % 3], source, depth + 1);
      split(middle[(k + 1) % 3], r, middle[(k + 2) % 3], source, depth + 1);
    }
  }
}

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

  triangles_.clear();
  corner_coordinates_.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    Corner corner[3];
    for (int k = 0; k < 3; ++k) {
      corner[k].vertex = vertices_[mesh.triangles[t + k]];
      corner[k].at[k] = 1.0f;
    }
    split(corner[0], corner[1], corner[2], static_cast<std::uint32_t>(t / 3), 0);
  }
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
  region.width = std::min(floor_pixel(right), camera.width - 1) - region.x + 1;
  region.height = std::min(floor_pixel(bottom), camera.height - 1) - region.y + 1;
  if (region.empty()) return {};

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
