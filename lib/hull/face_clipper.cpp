// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/face_clipper.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {
void FaceClipper::begin(const Scene& scene) {
  scene_ = &scene;
  stamp_.assign(scene.cone_faces(), 0);
  stamp_now_ = 0;
}

int FaceClipper::side(const Corner& v, std::uint32_t plane, const Line& line, int orientation) {
  ++predicates_;
  const double x = value(v, line);
  if (x > v.tolerance) return 1;
  if (x < -v.tolerance) return -1;
  ++exact_;
  int sign;
  if (v.apex) {
    const IntVec& c = scene_->cones[cone_]->centre;
    sign = orientation * scene_->set.side_of_point(plane, c[0], c[1], c[2]);
  } else {
    sign =
        orientation * v.sign * handed_ * scene_->set.orientation(face_, v.plane1, v.plane2, plane);
  }
  return sign != 0 ? sign : 1;
}

FaceClipper::Picture FaceClipper::picture(std::uint32_t cone) const {
  const Vec3 centre = scene_->cones[cone]->centre_real;
  if (cone_ >= 0) return {axis_a_, axis_b_, (corner_ - centre) * unit_};
  return {(corner_ - centre) * unit_, axis_b_, axis_c_};
}

bool FaceClipper::start(std::uint32_t face) {
  face_ = face;
  corners_.clear();
  edges_.clear();
  const Scene& s = *scene_;
  if (face >= s.cone_faces()) {
    if (!s.box_active[face - s.cone_faces()]) return false;
    start_box_face();
    return true;
  }
  cone_ = static_cast<std::int32_t>(
      std::upper_bound(s.first_face.begin(), s.first_face.end(), face) - s.first_face.begin() - 1);
  local_ = face - s.first_face[cone_];
  if (s.far[cone_] <= 0) return false;
  start_cone_face();
  return true;
}

void FaceClipper::start_cone_face() {
  const Scene& s = *scene_;
  const Cone& c = *s.cones[cone_];
  const std::uint32_t begin = local_, end = c.next[local_], base = s.first_face[cone_];
  const auto real = [](const IntVec& v) {
    return Vec3(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
  };
  const Vec3 d0 = real(c.rays[begin]), e = real(c.rays[end]) - d0;
  const double length = glm::length(d0), along = glm::length(e);
  axis_a_ = d0 / length;
  axis_b_ = e / along;
  corner_ = c.centre_real;
  // Depths are in units of the far plane's, so that w is at least about 1.
  const Vec3 axis = real(c.axis);
  const double axis_length = glm::length(axis);
  double largest = s.far[cone_] / axis_length;
  for (const Cone* other : s.cones)
    largest = std::max(largest, glm::length(other->centre_real - corner_));
  for (int k = 0; k < 6; ++k)
    if (s.box_active[k]) largest = std::max(largest, std::abs(s.box[k] - corner_[k / 2]));
  unit_ = 1.0 / largest;
  handed_ = 1;

  const double width = along / length;  // t of the second ray
  const double scale = 1.0 / std::max(1.0, width);
  const std::uint32_t left = base + c.previous[begin], right = base + end;
  const Line left_line{0, 1, 0}, right_line{width * scale, -scale, 0};
  const double za = glm::dot(axis, axis_a_) / axis_length,
               zb = glm::dot(axis, axis_b_) / axis_length;
  const Line far_line{-za, -zb, s.far[cone_] * unit_ / axis_length};
  const Line near_line{za, zb, -s.near[cone_] * unit_ / axis_length};
  const std::uint32_t far_plane = s.far_plane(cone_), near_plane = s.near_plane(cone_);
  const int turn_left = c.turn[begin], turn_right = c.turn[end];
  // far (left to right), right ray (up to near), near, left ray (down).
  const std::uint32_t v0 =
      make_corner(left_line, far_line, left, far_plane, 1, turn_left, nullptr, nullptr, 0, 0);
  const std::uint32_t v1 =
      make_corner(far_line, right_line, far_plane, right, 1, turn_right, nullptr, nullptr, 0, 0);
  std::uint32_t v2, v3;
  if (s.near[cone_] > 0) {
    v2 = make_corner(right_line, near_line, right, near_plane, 1, turn_right, nullptr, nullptr, 0,
                     0);
    v3 = make_corner(near_line, left_line, near_plane, left, 1, turn_left, nullptr, nullptr, 0, 0);
  } else {
    v2 = static_cast<std::uint32_t>(corners_.size());
    v3 = v2 + 1;
    corners_.push_back({0, 0, 1, determinant_error, 0, 0, 1, true});
    corners_.push_back({0, 0, 1, determinant_error, 0, 0, 1, true});
  }
  edges_.push_back({far_line, far_plane, 1, v0, v1});
  edges_.push_back({right_line, right, static_cast<std::int8_t>(turn_right), v1, v2});
  edges_.push_back({near_line, near_plane, 1, v2, v3});
  edges_.push_back({left_line, left, static_cast<std::int8_t>(turn_left), v3, v0});
}

void FaceClipper::start_box_face() {
  const Scene& s = *scene_;
  const int k = static_cast<int>(face_ - s.cone_faces()), axis = k / 2;
  cone_ = -1;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  corner_ = Vec3(0.0);
  corner_[axis] = s.box[k], corner_[u] = s.box[2 * u], corner_[v] = s.box[2 * v];
  axis_b_ = axis_c_ = Vec3(0.0);
  axis_b_[u] = 1, axis_c_[v] = 1;
  const double wide = s.box[2 * u + 1] - s.box[2 * u], high = s.box[2 * v + 1] - s.box[2 * v];
  double largest = std::max(wide, high);
  for (const Cone* other : s.cones)
    largest = std::max(largest, glm::length(other->centre_real - corner_));
  for (int i = 0; i < 6; ++i) largest = std::max(largest, std::abs(s.box[i] - corner_[i / 2]));
  unit_ = 1.0 / largest;
  // u, v and the face's axis are right-handed; the inward normal is the axis for the lower face.
  handed_ = k % 2 == 0 ? 1 : -1;
  const Line left{0, 1, 0}, right{wide * unit_, -1, 0}, bottom{0, 0, 1}, top{high * unit_, 0, -1};
  const std::uint32_t pl = s.box_face(2 * u), pr = pl + 1, pb = s.box_face(2 * v), pt = pb + 1;
  const std::uint32_t v0 = make_corner(left, bottom, pl, pb, 1, 1, nullptr, nullptr, 0, 0);
  const std::uint32_t v1 = make_corner(bottom, right, pb, pr, 1, 1, nullptr, nullptr, 0, 0);
  const std::uint32_t v2 = make_corner(right, top, pr, pt, 1, 1, nullptr, nullptr, 0, 0);
  const std::uint32_t v3 = make_corner(top, left, pt, pl, 1, 1, nullptr, nullptr, 0, 0);
  edges_.push_back({bottom, pb, 1, v0, v1});
  edges_.push_back({right, pr, 1, v1, v2});
  edges_.push_back({top, pt, 1, v2, v3});
  edges_.push_back({left, pl, 1, v3, v0});
}

std::uint32_t FaceClipper::make_corner(const Line& l, const Line& m, std::uint32_t plane1,
                                       std::uint32_t plane2, int geometric, int orientation,
                                       const Corner* from, const Corner* to, double from_value,
                                       double to_value) {
  Corner v;
  const double u = l.b * m.d - l.d * m.b;
  if (u * geometric > 1e-9) {
    v.h = 1.0;
    v.t = (l.d * m.a - l.a * m.d) / u;
    v.w = (l.a * m.b - l.b * m.a) / u;
    v.tolerance = determinant_error / std::abs(u);
  } else if (from != nullptr) {
    // Nearly parallel: a place between the ends is good enough to look around from.
    const double a = std::abs(from_value), b = std::abs(to_value);
    const double sum = a + b > 0 ? a + b : 1.0, f = a + b > 0 ? b / sum : 0.5, g = 1.0 - f;
    const double h = f * from->h + g * to->h;
    const double inverse = h > 0 ? 1.0 / h : 1.0;
    v.h = 1.0;
    v.t = (f * from->t + g * to->t) * inverse;
    v.w = (f * from->w + g * to->w) * inverse;
    v.tolerance = undecided;
  } else {
    const double safe = std::abs(u) > 1e-300 ? u : 1e-300;
    v.h = 1.0;
    v.t = (l.d * m.a - l.a * m.d) / safe;
    v.w = (l.a * m.b - l.b * m.a) / safe;
    v.tolerance = undecided;
  }
  v.plane1 = plane1;
  v.plane2 = plane2;
  v.sign = static_cast<std::int8_t>(geometric * orientation);
  v.apex = false;
  corners_.push_back(v);
  return static_cast<std::uint32_t>(corners_.size() - 1);
}

void FaceClipper::clip(std::uint32_t face, FaceLoops& out) {
  if (!start(face)) return;
  const Scene& s = *scene_;
  bool left = true;
  for (int k = 0; k < 6 && left; ++k)
    if (s.box_active[k] && s.box_face(k) != face) left = cut_by_plane(k);
  if (cone_ >= 0) {
    for (std::size_t i = 0; i < s.order[cone_].size() && left; ++i)
      left = cut_by_cone(s.order[cone_][i]);
  } else {
    for (std::uint32_t i = 0; i < s.cones.size() && left; ++i) left = cut_by_cone(i);
  }
  if (left) emit(out);
  out.predicates += predicates_, out.exact += exact_, out.broken += broken_;
  predicates_ = exact_ = broken_ = 0;
}

bool FaceClipper::cut_by_plane(int k) {
  const Scene& s = *scene_;
  Vec3 normal(0.0);
  normal[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
  Vec3 origin(0.0);
  origin[k / 2] = s.box[k];
  Picture p = cone_ >= 0 ? Picture{axis_a_, axis_b_, (corner_ - origin) * unit_}
                         : Picture{(corner_ - origin) * unit_, axis_b_, axis_c_};
  // The starting rectangle of a box face already lies on its neighbours.
  if (cone_ < 0) return true;
  cuts_.clear();
  sides_.clear();
  add_cut(line_of(normal, p), 0, s.box_face(k));
  if (cuts_.empty()) {
    const Line line = line_of(normal, p);
    return side(corners_[edges_[0].from], s.box_face(k), line) > 0;
  }
  return apply_cuts(nullptr, 0, p);
}

bool FaceClipper::cut_by_cone(std::uint32_t index) {
  const Scene& s = *scene_;
  const Cone& cone = *s.cones[index];
  const Picture p = picture(index);
  CellState uniform = CellState::unknown;
  candidates_.clear();
  if (!gather(cone, p, uniform)) return (uniform == CellState::inside) != cone.complement;
  cuts_.clear();
  sides_.clear();
  const std::uint32_t base = s.first_face[index];
  for (std::uint32_t e : candidates_) add_cut(line_of(cone.normals[e], p), e, base + e);
  return apply_cuts(&cone, index, p);
}

bool FaceClipper::gather(const Cone& cone, const Picture& p, CellState& uniform) {
  const Mat3& m = cone.camera.to_pixel;
  const Vec3 a = m * p.a, b = m * p.b, d = m * p.d;
  const std::size_t n = corners_.size();
  values_.resize(2 * n);
  const ContourGrid& grid = cone.grid;
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
  bool all = false;
  for (std::size_t i = 0; i < n; ++i) {
    const Corner& v = corners_[i];
    const double z = a.z * v.h + b.z * v.t + d.z * v.w;
    const double size = std::abs(a.z) * v.h + std::abs(b.z * v.t) + std::abs(d.z * v.w);
    if (!(z > 1e-6 * size)) {
      all = true;
      break;
    }
    const double inverse = 1.0 / z;
    const double x = (a.x * v.h + b.x * v.t + d.x * v.w) * inverse;
    const double y = (a.y * v.h + b.y * v.t + d.y * v.w) * inverse;
    values_[2 * i] = x, values_[2 * i + 1] = y;
    x0 = std::min(x0, x), x1 = std::max(x1, x);
    y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  if (all) {
    for (std::uint32_t e = 0; e < cone.size(); ++e) candidates_.push_back(e);
    return true;
  }
  int c0, c1, r0, r1;
  grid.column_range(x0, x1, c0, c1);
  grid.row_range(y0, y1, r0, r1);
  uniform = CellState::outside;
  if (c0 > c1 || r0 > r1) return false;
  if (grid.occupied(c0, c1, r0, r1) == 0) {
    uniform = grid.state(c0, r0);
    return false;
  }
  ++stamp_now_;
  const auto take = [&](int column, int row) {
    for (std::uint32_t e : grid.edges(column, row)) {
      if (stamp_[e] == stamp_now_) continue;
      stamp_[e] = stamp_now_;
      candidates_.push_back(e);
    }
  };
  if (c0 == c1 || r0 == r1) {
    for (int r = r0; r <= r1; ++r)
      for (int c = c0; c <= c1; ++c) take(c, r);
    return true;
  }
  // The columns that the polygon spans in each row of cells.
  rows_.assign(static_cast<std::size_t>(r1 - r0) + 1, {c1 + 1, c0 - 1});
  for (const Edge& e : edges_) {
    const double px = values_[2 * e.from], py = values_[2 * e.from + 1];
    const double qx = values_[2 * e.to], qy = values_[2 * e.to + 1];
    int first, last;
    grid.row_range(std::min(py, qy), std::max(py, qy), first, last);
    const double dy = qy - py, slope = std::abs(dy) > 2 * grid_margin ? (qx - px) / dy : 0.0;
    for (int r = std::max(first, r0); r <= std::min(last, r1); ++r) {
      double xa = px, xb = qx;
      if (slope != 0.0) {
        const double top = grid.row_top(r) - grid_margin,
                     bottom = grid.row_top(r + 1) + grid_margin;
        xa = px + (std::clamp(py, top, bottom) - py) * slope;
        xb = px + (std::clamp(qy, top, bottom) - py) * slope;
      }
      int ca, cb;
      grid.column_range(std::min(xa, xb), std::max(xa, xb), ca, cb);
      auto& row = rows_[r - r0];
      row[0] = std::min(row[0], std::max(ca, c0)), row[1] = std::max(row[1], std::min(cb, c1));
    }
  }
  for (int r = r0; r <= r1; ++r)
    for (int c = rows_[r - r0][0]; c <= rows_[r - r0][1]; ++c) take(c, r);
  return true;
}

void FaceClipper::add_cut(const Line& line, std::uint32_t edge, std::uint32_t plane) {
  const std::size_t n = corners_.size();
  bool positive = false, negative = false, unsure = false;
  for (std::size_t i = 0; i < n; ++i) {
    const Corner& v = corners_[i];
    const double x = value(v, line);
    positive = positive || x > v.tolerance;
    negative = negative || x < -v.tolerance;
    unsure = unsure || !(std::abs(x) > v.tolerance);
  }
  predicates_ += n;
  if (!unsure && positive != negative) return;
  const std::size_t begin = sides_.size();
  bool any[2] = {false, false};
  for (std::size_t i = 0; i < n; ++i) {
    const int sign = side(corners_[i], plane, line);
    sides_.push_back(static_cast<std::int8_t>(sign));
    any[sign > 0] = true;
  }
  predicates_ -= n;
  if (any[0] && any[1])
    cuts_.push_back({line, edge, plane, begin, {}, {}, false});
  else
    sides_.resize(begin);
}

}  // namespace polyhull::hull
