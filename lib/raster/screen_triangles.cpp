// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raster/screen_triangles.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

/// A corner of what clipping leaves.
struct Cut {
  Vec3 pixel;
  double kept, second, third;
};

/// The part of a convex polygon where distance(corner) >= 0. An edge that is cut is cut from its
/// inner end on, so that both triangles at it get the same point.
template <class Distance>
int clip(const Cut* from, int count, Cut* to, Distance&& distance) {
  int made = 0;
  for (int i = 0; i < count; ++i) {
    const Cut& a = from[i];
    const Cut& b = from[(i + 1) % count];
    const double da = distance(a), db = distance(b);
    if (da >= 0.0) to[made++] = a;
    if ((da >= 0.0) == (db >= 0.0)) continue;
    const Cut& in = da >= 0.0 ? a : b;
    const Cut& out = da >= 0.0 ? b : a;
    const double di = std::max(da, db), d = std::min(da, db);
    const double t = di / (di - d);
    to[made++] = {in.pixel + t * (out.pixel - in.pixel), in.kept + t * (out.kept - in.kept),
                  in.second + t * (out.second - in.second), in.third + t * (out.third - in.third)};
  }
  return made;
}

ScreenPlane plane_of(const double (&f)[3], const double (&x)[3], const double (&y)[3],
                     double area) {
  ScreenPlane out;
  out.dx = ((f[1] - f[0]) * (y[2] - y[0]) - (f[2] - f[0]) * (y[1] - y[0])) / area;
  out.dy = ((f[2] - f[0]) * (x[1] - x[0]) - (f[1] - f[0]) * (x[2] - x[0])) / area;
  out.value = f[0] - out.dx * x[0] - out.dy * y[0];
  return out;
}

}  // namespace

const float (*sample_places(int samples))[2] {
  // In sixteenths of a pixel; the last is the middle.
  static const float one[][2] = {{0.5f, 0.5f}, {0.5f, 0.5f}};
  static const float two[][2] = {{0.75f, 0.75f}, {0.25f, 0.25f}, {0.5f, 0.5f}};
  static const float four[][2] = {
      {0.375f, 0.125f}, {0.875f, 0.375f}, {0.125f, 0.625f}, {0.625f, 0.875f}, {0.5f, 0.5f}};
  static const float eight[][2] = {{0.5625f, 0.3125f}, {0.4375f, 0.6875f}, {0.8125f, 0.5625f},
                                   {0.3125f, 0.1875f}, {0.1875f, 0.8125f}, {0.0625f, 0.4375f},
                                   {0.6875f, 0.9375f}, {0.9375f, 0.0625f}, {0.5f, 0.5f}};
  return samples >= 8 ? eight : samples >= 4 ? four : samples >= 2 ? two : one;
}

Mat4 pixels_from_clip(int width, int height) {
  Mat4 out(0.0);
  out[0][0] = 0.5 * width;
  out[3][0] = 0.5 * width;
  out[1][1] = 0.5 * height;
  out[3][1] = 0.5 * height;
  out[3][2] = 1.0;  // the third row is the clip w, which is the depth
  return out;
}

void ScreenTriangles::begin(int width, int height, double near) {
  width_ = width;
  height_ = height;
  near_ = near;
  triangles_.clear();
  bands_.resize(static_cast<std::size_t>((height + band_rows - 1) / band_rows));
  for (auto& band : bands_) band.clear();
  columns_.assign(bands_.size(), {width, 0});
}

void ScreenTriangles::add(const std::array<Corner, 3>& corners, std::uint32_t id, Facing facing) {
  Cut polygon[6], clipped[6];
  bool inside = true;
  for (int i = 0; i < 3; ++i) {
    const Corner& c = corners[static_cast<std::size_t>(i)];
    if (!std::isfinite(c.pixel.x + c.pixel.y + c.pixel.z + c.kept)) return;
    polygon[i] = {c.pixel, c.kept, i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0};
    inside = inside && c.kept >= 0.0 && c.pixel.z >= near_;
  }
  int count = 3;
  if (!inside) {
    count = clip(polygon, count, clipped, [this](const Cut& c) { return c.pixel.z - near_; });
    count = clip(clipped, count, polygon, [](const Cut& c) { return c.kept; });
  }
  for (int k = 1; k + 1 < count; ++k) {
    const Cut* order[3] = {&polygon[0], &polygon[k], &polygon[k + 1]};
    double x[3], y[3], one[3], second[3], third[3];
    for (int i = 0; i < 3; ++i) {
      const Cut& c = *order[i];
      one[i] = 1.0 / c.pixel.z;
      x[i] = c.pixel.x * one[i];
      y[i] = c.pixel.y * one[i];
      second[i] = c.second * one[i];
      third[i] = c.third * one[i];
    }
    // Rows go down: what goes round clockwise to the eye has a positive area here.
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (area == 0.0 || !std::isfinite(area)) continue;
    if (facing == Facing::clockwise && area > 0.0) continue;
    if (facing == Facing::counterclockwise && area < 0.0) continue;
    const double low_x = std::min({x[0], x[1], x[2]}), high_x = std::max({x[0], x[1], x[2]});
    const double low_y = std::min({y[0], y[1], y[2]}), high_y = std::max({y[0], y[1], y[2]});
    if (high_x < 0.0 || low_x > width_ || high_y < 0.0 || low_y > height_) continue;
    ScreenTriangle t;
    t.id = id;
    t.inverse = plane_of(one, x, y, area);
    t.second = plane_of(second, x, y, area);
    t.third = plane_of(third, x, y, area);
    int at[3] = {0, 1, 2};
    std::sort(at, at + 3, [&](int i, int j) { return y[i] != y[j] ? y[i] < y[j] : x[i] < x[j]; });
    for (int i = 0; i < 3; ++i) t.x[i] = x[at[i]], t.y[i] = y[at[i]];
    const auto slope = [&](int i, int j) {
      const double rows = t.y[j] - t.y[i];
      return rows > 0.0 ? (t.x[j] - t.x[i]) / rows : 0.0;
    };
    t.slope[0] = slope(0, 2);
    t.slope[1] = slope(0, 1);
    t.slope[2] = slope(1, 2);
    t.middle_left = (t.x[1] - t.x[0]) * (t.y[2] - t.y[0]) < (t.x[2] - t.x[0]) * (t.y[1] - t.y[0]);
    const auto index = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back(t);
    const int first = static_cast<int>(std::max(0.0, low_y)) / band_rows;
    const int last = static_cast<int>(std::min<double>(height_ - 1, high_y)) / band_rows;
    const int left = static_cast<int>(std::max(0.0, low_x));
    const int end = static_cast<int>(std::min<double>(width_ - 1, high_x)) + 1;
    for (int band = first; band <= last; ++band) {
      bands_[static_cast<std::size_t>(band)].push_back(index);
      Columns& columns = columns_[static_cast<std::size_t>(band)];
      columns = {std::min(columns.first, left), std::max(columns.end, end)};
    }
  }
}

void ScreenTriangles::draw(std::span<const std::uint32_t> numbers, const SampleRows& rows,
                           std::uint32_t first) const {
  RasterLoops::best().draw_packed(triangles_.data(), numbers.data(),
                                  static_cast<int>(numbers.size()), first, rows);
}

void ScreenTriangles::draw(int band, const SampleRows& rows, std::uint32_t first) const {
  // What is drawn is named by its place here, which leads back to its planes.
  const std::vector<std::uint32_t>& numbers = bands_[static_cast<std::size_t>(band)];
  if (rows.packed) return draw(std::span(numbers), rows, first);
  const RasterLoops& best = RasterLoops::best();
  for (const std::uint32_t index : numbers) {
    ScreenTriangle t = triangles_[index];
    t.id = first + index;
    best.draw(t, rows);
  }
}

}  // namespace polyhull
