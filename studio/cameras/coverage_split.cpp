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

void CoverageRaster::split_all(std::span<const std::uint32_t> triangles) {
  triangles_.clear();
  corner_coordinates_.clear();
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    Corner corner[3];
    for (int k = 0; k < 3; ++k) {
      corner[k].vertex = vertices_[triangles[t + k]];
      corner[k].at[k] = 1.0f;
    }
    split(corner[0], corner[1], corner[2], static_cast<std::uint32_t>(t / 3), 0);
  }
}

}  // namespace polyhull
