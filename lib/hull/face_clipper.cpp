// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/face_clipper.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {
void FaceClipper::begin(const Scene& scene) {
  scene_ = &scene;
  std::size_t largest = 0;
  for (const Cone* cone : scene.cones) largest = std::max(largest, cone->size());
  stamp_.assign(largest, 0);
  line_stamp_.assign(largest, 0);
  lines_.resize(largest);
  stamp_now_ = 0;
}

FaceClipper::Picture FaceClipper::picture(std::uint32_t cone) const {
  const Vec3 centre = scene_->cones[cone]->centre_real;
  if (c_->cone >= 0) return {c_->axis_a, c_->axis_b, (c_->corner - centre) * c_->unit};
  return {(c_->corner - centre) * c_->unit, c_->axis_b, c_->axis_c};
}

std::size_t FaceClipper::cone_of(std::uint32_t face) const {
  const auto& first = scene_->first_face;
  return std::upper_bound(first.begin(), first.end(), face) - first.begin() - 1;
}

bool FaceClipper::start(std::uint32_t face) {
  c_->face = face;
  c_->corners.clear();
  c_->edges.clear();
  const Scene& s = *scene_;
  if (face >= s.cone_faces()) {
    if (!s.box_active[face - s.cone_faces()]) return false;
    start_box_face();
    return true;
  }
  c_->cone = static_cast<std::int32_t>(cone_of(face));
  c_->local = face - s.first_face[c_->cone];
  if (s.far[c_->cone] <= 0) return false;
  start_cone_face();
  return true;
}

void FaceClipper::start_cone_face() {
  const Scene& s = *scene_;
  const Cone& c = *s.cones[c_->cone];
  const std::uint32_t begin = c_->local, end = c.next[c_->local], base = s.first_face[c_->cone];
  const auto real = [](const IntVec& v) {
    return Vec3(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
  };
  const Vec3 d0 = real(c.rays[begin]), e = real(c.rays[end]) - d0;
  const double length = glm::length(d0), along = glm::length(e);
  c_->axis_a = d0 / length;
  c_->axis_b = e / along;
  c_->corner = c.centre_real;
  // Depths are in units of the far plane's, so that w is at least about 1.
  const Vec3 axis = real(c.axis);
  const double axis_length = glm::length(axis);
  double largest = s.far[c_->cone] / axis_length;
  for (const Cone* other : s.cones)
    largest = std::max(largest, glm::length(other->centre_real - c_->corner));
  for (int k = 0; k < 6; ++k)
    if (s.box_active[k]) largest = std::max(largest, std::abs(s.box[k] - c_->corner[k / 2]));
  c_->unit = 1.0 / largest;
  c_->handed = 1;

  const double width = along / length;  // t of the second ray
  const double scale = 1.0 / std::max(1.0, width);
  const std::uint32_t left = base + c.previous[begin], right = base + end;
  const Line left_line{0, 1, 0}, right_line{width * scale, -scale, 0};
  const double za = glm::dot(axis, c_->axis_a) / axis_length,
               zb = glm::dot(axis, c_->axis_b) / axis_length;
  const Line far_line{-za, -zb, s.far[c_->cone] * c_->unit / axis_length};
  const Line near_line{za, zb, -s.near[c_->cone] * c_->unit / axis_length};
  const std::uint32_t far_plane = s.far_plane(c_->cone), near_plane = s.near_plane(c_->cone);
  const int turn_left = c.turn[begin], turn_right = c.turn[end];
  // far (left to right), right ray (up to near), near, left ray (down).
  const std::uint32_t v0 =
      make_corner(left_line, far_line, left, far_plane, 1, turn_left, nullptr, nullptr, 0, 0);
  const std::uint32_t v1 =
      make_corner(far_line, right_line, far_plane, right, 1, turn_right, nullptr, nullptr, 0, 0);
  std::uint32_t v2, v3;
  if (s.near[c_->cone] > 0) {
    v2 = make_corner(right_line, near_line, right, near_plane, 1, turn_right, nullptr, nullptr, 0,
                     0);
    v3 = make_corner(near_line, left_line, near_plane, left, 1, turn_left, nullptr, nullptr, 0, 0);
  } else {
    v2 = static_cast<std::uint32_t>(c_->corners.size());
    v3 = v2 + 1;
    c_->corners.push_back({0, 0, 1, determinant_error, 0, 0, 1, true});
    c_->corners.push_back({0, 0, 1, determinant_error, 0, 0, 1, true});
  }
  c_->edges.push_back({far_line, far_plane, 1, v0, v1});
  c_->edges.push_back({right_line, right, static_cast<std::int8_t>(turn_right), v1, v2});
  c_->edges.push_back({near_line, near_plane, 1, v2, v3});
  c_->edges.push_back({left_line, left, static_cast<std::int8_t>(turn_left), v3, v0});
}

void FaceClipper::start_box_face() {
  const Scene& s = *scene_;
  const int k = static_cast<int>(c_->face - s.cone_faces()), axis = k / 2;
  c_->cone = -1;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  c_->corner = Vec3(0.0);
  c_->corner[axis] = s.box[k], c_->corner[u] = s.box[2 * u], c_->corner[v] = s.box[2 * v];
  c_->axis_b = c_->axis_c = Vec3(0.0);
  c_->axis_b[u] = 1, c_->axis_c[v] = 1;
  const double wide = s.box[2 * u + 1] - s.box[2 * u], high = s.box[2 * v + 1] - s.box[2 * v];
  double largest = std::max(wide, high);
  for (const Cone* other : s.cones)
    largest = std::max(largest, glm::length(other->centre_real - c_->corner));
  for (int i = 0; i < 6; ++i) largest = std::max(largest, std::abs(s.box[i] - c_->corner[i / 2]));
  c_->unit = 1.0 / largest;
  // u, v and the face's axis are right-handed; the inward normal is the axis for the lower face.
  c_->handed = k % 2 == 0 ? 1 : -1;
  const Line left{0, 1, 0}, right{wide * c_->unit, -1, 0}, bottom{0, 0, 1},
      top{high * c_->unit, 0, -1};
  const std::uint32_t pl = s.box_face(2 * u), pr = pl + 1, pb = s.box_face(2 * v), pt = pb + 1;
  const std::uint32_t v0 = make_corner(left, bottom, pl, pb, 1, 1, nullptr, nullptr, 0, 0);
  const std::uint32_t v1 = make_corner(bottom, right, pb, pr, 1, 1, nullptr, nullptr, 0, 0);
  const std::uint32_t v2 = make_corner(right, top, pr, pt, 1, 1, nullptr, nullptr, 0, 0);
  const std::uint32_t v3 = make_corner(top, left, pt, pl, 1, 1, nullptr, nullptr, 0, 0);
  c_->edges.push_back({bottom, pb, 1, v0, v1});
  c_->edges.push_back({right, pr, 1, v1, v2});
  c_->edges.push_back({top, pt, 1, v2, v3});
  c_->edges.push_back({left, pl, 1, v3, v0});
}

std::uint32_t FaceClipper::make_corner(const Line& l, const Line& m, std::uint32_t plane1,
                                       std::uint32_t plane2, int geometric, int orientation,
                                       const Corner* from, const Corner* to, double from_value,
                                       double to_value) {
  Corner v;
  const double u = l.b * m.d - l.d * m.b;
  if (u * geometric > 1e-9) {
    const double inverse = 1.0 / u;
    v.h = 1.0;
    v.t = (l.d * m.a - l.a * m.d) * inverse;
    v.w = (l.a * m.b - l.b * m.a) * inverse;
    v.tolerance = determinant_error * std::abs(inverse);
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
  c_->corners.push_back(v);
  return static_cast<std::uint32_t>(c_->corners.size() - 1);
}

void FaceClipper::clip(std::uint32_t begin, std::uint32_t end, FaceLoops& out) {
  const Scene& s = *scene_;
  if (charts_.size() < end - begin) charts_.resize(end - begin);
  for (std::uint32_t f = begin; f < end; ++f) {
    c_ = &charts_[f - begin];
    c_->left = start(f);
    if (!c_->left) continue;
    c_->extent = {0, 0, 0, 0, false};
    update_extent();
    for (int k = 0; k < 6 && c_->left; ++k)
      if (s.box_active[k] && s.box_face(k) != f) c_->left = cut_by_plane(k);
  }
  for (std::uint32_t first = begin; first < end;) {
    // Faces of one cone meet the others in the same order.
    std::uint32_t last = end;
    const std::vector<std::uint32_t>* order = &s.box_order;
    if (first < s.cone_faces()) {
      const std::size_t cone = cone_of(first);
      last = std::min(end, s.first_face[cone + 1]);
      order = &s.order[cone];
    }
    for (const std::uint32_t other : *order)
      for (std::uint32_t f = first; f < last; ++f) {
        c_ = &charts_[f - begin];
        if (c_->left) c_->left = cut_by_cone(other);
      }
    first = last;
  }
  for (std::uint32_t f = begin; f < end; ++f) {
    c_ = &charts_[f - begin];
    if (c_->left) emit(out);
  }
  out.predicates += predicates_, out.exact += exact_, out.broken += broken_;
  predicates_ = exact_ = broken_ = 0;
}

bool FaceClipper::cut_by_plane(int k) {
  const Scene& s = *scene_;
  Vec3 normal(0.0);
  normal[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
  Vec3 origin(0.0);
  origin[k / 2] = s.box[k];
  Picture p = c_->cone >= 0 ? Picture{c_->axis_a, c_->axis_b, (c_->corner - origin) * c_->unit}
                            : Picture{(c_->corner - origin) * c_->unit, c_->axis_b, c_->axis_c};
  // The starting rectangle of a box face already lies on its neighbours.
  if (c_->cone < 0) return true;
  cuts_.clear();
  sides_.clear();
  add_cut(line_of(normal, p), 0, s.box_face(k));
  if (cuts_.empty()) {
    const Line line = line_of(normal, p);
    return side(c_->corners[c_->edges[0].from], s.box_face(k), line) > 0;
  }
  return apply_cuts(nullptr, 0, p);
}

bool FaceClipper::cut_by_cone(std::uint32_t index) {
  const Cone& cone = *scene_->cones[index];
  const Picture p = picture(index);
  candidates_.clear();
  const Meeting meeting = gather(cone, p);
  if (meeting == Meeting::inside) return !cone.complement;
  if (meeting == Meeting::outside) return cone.complement;
  cuts_.clear();
  sides_.clear();
  const std::uint32_t base = scene_->first_face[index];
  for (std::uint32_t e : candidates_) add_cut(cached_line(cone, e, p), e, base + e);
  return apply_cuts(&cone, index, p);
}

void FaceClipper::add_cut(const Line& line, std::uint32_t edge, std::uint32_t plane) {
  const std::size_t n = c_->corners.size(), begin = sides_.size();
  sides_.resize(begin + n);
  const Corner* corners = c_->corners.data();
  std::int8_t* sides = sides_.data() + begin;
  const Line l = line;
  int sum = 0, unsure = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = value(corners[i], l), bound = corners[i].tolerance;
    const int sign = (x > bound) - (x < -bound);
    sides[i] = static_cast<std::int8_t>(sign);
    sum += sign;
    unsure += sign == 0;
  }
  predicates_ += n;
  if (unsure > 0)
    for (std::size_t i = 0; i < n; ++i)
      if (sides[i] == 0) {
        sides[i] = static_cast<std::int8_t>(side_exactly(corners[i], plane, 1));
        sum += sides[i];
      }
  const int all = static_cast<int>(n);
  if (sum < all && sum > -all)
    cuts_.push_back({l, edge, plane, begin});
  else
    sides_.resize(begin);
}

/// Where the corners lie in (t, w); kept as it was where they are not known well.
void FaceClipper::update_extent() {
  Extent now{1e300, -1e300, 1e300, -1e300, false};
  for (const Corner& v : c_->corners) {
    if (v.apex) {
      now.endless = true;
      continue;
    }
    if (v.tolerance > 1e-9) return;
    now.t0 = std::min(now.t0, v.t), now.t1 = std::max(now.t1, v.t);
    now.w0 = std::min(now.w0, v.w), now.w1 = std::max(now.w1, v.w);
  }
  c_->extent = now;
}

int FaceClipper::side_exactly(const Corner& v, std::uint32_t plane, int orientation) {
  ++exact_;
  int sign;
  if (v.apex) {
    const IntVec& c = scene_->cones[c_->cone]->centre;
    sign = orientation * scene_->set.side_of_point(plane, c[0], c[1], c[2]);
  } else {
    sign = orientation * v.sign * c_->handed *
           scene_->set.orientation(c_->face, v.plane1, v.plane2, plane);
  }
  return sign != 0 ? sign : 1;
}

}  // namespace polyhull::hull
