// SPDX-License-Identifier: LGPL-2.1-or-later
// The part of CoverageRaster that makes small triangles on the screen of the mesh's.
#include <algorithm>
#include <cmath>

#include "rig/lens.h"
#include "studio/cameras/coverage_raster.h"
#include "studio/cameras/coverage_samples.h"

namespace polyhull {

using namespace coverage;

namespace {

constexpr std::int32_t longest_edge = 16 * unit;
constexpr int deepest_split = 14;
constexpr int deepest_split_behind = 6;  // of triangles that reach behind the camera
constexpr std::uint8_t front = 1, back = 2;

/// Twice the area; y points down, so that of a triangle seen from outside is negative.
template <class Point>
std::int64_t area_of(const Point* const p[3]) {
  return static_cast<std::int64_t>(p[1]->x - p[0]->x) * (p[2]->y - p[0]->y) -
         static_cast<std::int64_t>(p[2]->x - p[0]->x) * (p[1]->y - p[0]->y);
}

}  // namespace

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

void CoverageRaster::emit(const ScreenPoint* const points[3], const Corner* const* corners,
                          std::uint32_t source, unsigned sides) {
  const std::int64_t area = area_of(points);
  if (area == 0 || (area > 0 && !two_sided_)) return;
  const int order[3] = {0, area < 0 ? 2 : 1, area < 0 ? 1 : 2};
  Triangle t;
  t.outlines = 0;
  for (int k = 0; k < 3; ++k) {
    const ScreenPoint& v = *points[order[k]];
    t.x[k] = v.x;
    t.y[k] = v.y;
    t.inverse_depth[k] = v.inverse_depth;
    t.outlines |= (sides >> order[(k + 2) % 3] & 1) << k;
  }
  const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
  const auto [top, bottom] = std::minmax({t.y[0], t.y[1], t.y[2]});
  if (floor_pixel(right) < 0 || floor_pixel(bottom) < 0 || floor_pixel(left) >= camera_->width ||
      floor_pixel(top) >= camera_->height)
    return;
  t.source = source;
  t.corners = static_cast<std::uint32_t>(corner_coordinates_.size());
  // Whole triangles need no coordinates of their own, only the order that was chosen.
  if (corners == nullptr)
    t.corners = nothing - 1 - (area > 0);
  else
    for (const int k : order) corner_coordinates_.push_back(corners[k]->at);
  drawn_ = {std::min(drawn_.left, left), std::max(drawn_.right, right), std::min(drawn_.top, top),
            std::max(drawn_.bottom, bottom)};
  const int last = std::min(floor_pixel(bottom), camera_->height - 1) / band_rows;
  for (int band = std::max(floor_pixel(top), 0) / band_rows; band <= last; ++band)
    bands_[band].push_back(t);
}

void CoverageRaster::split(const Corner& a, const Corner& b, const Corner& c, std::uint32_t source,
                           unsigned sides, int depth) {
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
    if (!va->valid || !vb->valid || !vc->valid) return;
    // A bent triangle can turn its back in part. Else only its own sides can be outlines.
    unsigned outlines = camera_->has_distortion() ? 7 : 0;
    for (int k = 0; k < 3; ++k)
      for (int side = 0; side < 3; ++side)
        if ((sides >> side & 1) && corner[(k + 1) % 3]->at[side] == 0.0f &&
            corner[(k + 2) % 3]->at[side] == 0.0f)
          outlines |= 1u << k;
    const ScreenPoint* const points[3] = {va, vb, vc};
    emit(points, corner, source, outlines);
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
    split(a, middle[0], middle[2], source, sides, depth + 1);
    split(middle[0], b, middle[1], source, sides, depth + 1);
    split(middle[2], middle[1], c, source, sides, depth + 1);
    split(middle[0], middle[1], middle[2], source, sides, depth + 1);
    return;
  }
  for (int k = 0; k < 3; ++k) {
    const Corner &p = *corner[k], &q = *corner[(k + 1) % 3], &r = *corner[(k + 2) % 3];
    if (cuts == 1 && cut[k]) {
      split(p, middle[k], r, source, sides, depth + 1);
      split(middle[k], q, r, source, sides, depth + 1);
    } else if (cuts == 2 && !cut[k]) {
      // The two cut edges meet in r.
      split(p, q, middle[(k + 1) % 3], source, sides, depth + 1);
      split(p, middle[(k + 1) % 3], middle[(k + 2) % 3], source, sides, depth + 1);
      split(middle[(k + 1) % 3], r, middle[(k + 2) % 3], source, sides, depth + 1);
    }
  }
}

bool CoverageRaster::is_small(const ScreenPoint* const points[3]) const {
  bool small = points[0]->valid && points[1]->valid && points[2]->valid;
  for (int k = 0; k < 3 && small; ++k) {
    const ScreenPoint &p = *points[k], &q = *points[(k + 1) % 3];
    small = std::abs(p.x - q.x) <= longest_edge && std::abs(p.y - q.y) <= longest_edge;
  }
  return small;
}

void CoverageRaster::find_facing(const Mesh& mesh) {
  const std::span<const std::uint32_t> triangles = mesh.triangles;
  facing_.resize(triangles.size() / 3);
  ways_.resize(triangles.size() / 3);
  const bool bends = camera_->has_distortion();
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const ScreenPoint* const points[3] = {&vertices_[triangles[t]], &vertices_[triangles[t + 1]],
                                          &vertices_[triangles[t + 2]]};
    const bool small = is_small(points);
    std::uint8_t facing = front | back;
    const bool valid = small || (points[0]->valid && points[1]->valid && points[2]->valid);
    const std::int64_t area = valid ? area_of(points) : 0;
    if (area != 0 && (small || !bends)) facing = area < 0 ? front : back;
    facing_[t / 3] = facing;
    const bool seen = area < 0 || (area > 0 && two_sided_);
    ways_[t / 3] = !small ? Way::split : seen ? Way::whole : Way::none;
  }
}

void CoverageRaster::split_all(const Mesh& mesh) {
  bands_.resize((camera_->height + band_rows - 1) / band_rows);
  for (auto& band : bands_) band.clear();
  drawn_ = {INT32_MAX, INT32_MIN, INT32_MAX, INT32_MIN};
  corner_coordinates_.clear();
  find_facing(mesh);
  const auto outline = [&](std::size_t t, int k) -> unsigned {
    return !everywhere_ && (facing_[t / 3] | facing_[mesh.neighbours[t + k]]) == (front | back);
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    const auto source = static_cast<std::uint32_t>(t / 3);
    if (ways_[source] == Way::none) continue;
    const std::uint32_t a = mesh.triangles[t], b = mesh.triangles[t + 1], c = mesh.triangles[t + 2];
    const unsigned sides = outline(t, 1) | outline(t, 2) << 1 | outline(t, 0) << 2;
    if (ways_[source] == Way::whole) {
      const ScreenPoint* const points[3] = {&vertices_[a], &vertices_[b], &vertices_[c]};
      emit(points, nullptr, source, sides);
      continue;
    }
    Corner corners[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3 position(mesh.positions[mesh.triangles[t + k]]);
      corners[k].vertex = project(linear_ * position + origin_);
      corners[k].at[k] = 1.0f;
    }
    split(corners[0], corners[1], corners[2], source, sides, 0);
  }
}

}  // namespace polyhull
