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
  piece_at_ray_.assign(largest, 0);
  candidates_.resize(largest + 1);
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
  c_->nodes.clear();
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
  const Corner v0 =
      make_corner(left_line, far_line, left, far_plane, 1, turn_left, nullptr, nullptr, 0, 0);
  const Corner v1 =
      make_corner(far_line, right_line, far_plane, right, 1, turn_right, nullptr, nullptr, 0, 0);
  Corner v2{0, 0, 1, determinant_error, 0, 0, 1, true}, v3 = v2;  // the apex
  if (s.near[c_->cone] > 0) {
    v2 = make_corner(right_line, near_line, right, near_plane, 1, turn_right, nullptr, nullptr, 0,
                     0);
    v3 = make_corner(near_line, left_line, near_plane, left, 1, turn_left, nullptr, nullptr, 0, 0);
  }
  c_->nodes.push_back({v0, {far_line, far_plane, 1}});
  c_->nodes.push_back({v1, {right_line, right, static_cast<std::int8_t>(turn_right)}});
  c_->nodes.push_back({v2, {near_line, near_plane, 1}});
  c_->nodes.push_back({v3, {left_line, left, static_cast<std::int8_t>(turn_left)}});
  c_->loop_ends.assign(1, 4);
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
  const Corner v0 = make_corner(left, bottom, pl, pb, 1, 1, nullptr, nullptr, 0, 0);
  const Corner v1 = make_corner(bottom, right, pb, pr, 1, 1, nullptr, nullptr, 0, 0);
  const Corner v2 = make_corner(right, top, pr, pt, 1, 1, nullptr, nullptr, 0, 0);
  const Corner v3 = make_corner(top, left, pt, pl, 1, 1, nullptr, nullptr, 0, 0);
  c_->nodes.push_back({v0, {bottom, pb, 1}});
  c_->nodes.push_back({v1, {right, pr, 1}});
  c_->nodes.push_back({v2, {top, pt, 1}});
  c_->nodes.push_back({v3, {left, pl, 1}});
  c_->loop_ends.assign(1, 4);
}

FaceClipper::Corner FaceClipper::make_corner(const Line& l, const Line& m, std::uint32_t plane1,
                                             std::uint32_t plane2, int geometric, int orientation,
                                             const Corner* from, const Corner* to,
                                             double from_value, double to_value) {
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
  return v;
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
  const Line line = line_of(normal, p);
  begin_cuts(nullptr, 0, p);
  add_cut(line, 0, s.box_face(k));
  if (cuts_.empty()) return side(c_->nodes[0].corner, s.box_face(k), line) > 0;
  return apply_cuts();
}

bool FaceClipper::cut_by_cone(std::uint32_t index) {
  const Cone& cone = *scene_->cones[index];
  const Picture p = picture(index);
  const Meeting meeting = gather(cone, p);
  if (meeting == Meeting::inside) return !cone.complement;
  if (meeting == Meeting::outside) return cone.complement;
  begin_cuts(&cone, scene_->first_face[index], p);
  for (std::uint32_t i = 0; i < candidate_count_; ++i)
    add_cut(cached_line(candidates_[i]), candidates_[i], base_ + candidates_[i]);
  return apply_cuts();
}

/// Where the corners lie in (t, w); kept as it was where they are not known well.
void FaceClipper::update_extent() {
  Extent now{1e300, -1e300, 1e300, -1e300, false};
  for (const Node& node : c_->nodes) {
    const Corner& v = node.corner;
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

void FaceClipper::emit(FaceLoops& out) {
  // A cone's chart and the lower faces of the box are seen from inside, so their loops turn around.
  const bool reverse = c_->cone >= 0 || c_->handed > 0;
  bool any = false;
  std::uint32_t k = 0;
  for (const std::uint32_t loop_end : c_->loop_ends) {
    const std::size_t begin = out.corners.size();
    for (; k < loop_end; ++k) {
      const Corner& v = c_->nodes[k].corner;
      CornerKey key;
      if (v.apex) {
        key = {static_cast<std::uint32_t>(c_->cone), scene_->cones[c_->cone]->ring[c_->local],
               apex_mark};
        if (out.corners.size() > begin && out.corners.back() == key) continue;
      } else {
        key = {c_->face, v.plane1, v.plane2};
        if (key[1] > key[2]) std::swap(key[1], key[2]);
        if (key[0] > key[1]) std::swap(key[0], key[1]);
        if (key[1] > key[2]) std::swap(key[1], key[2]);
      }
      out.corners.push_back(key);
    }
    if (out.corners.size() > begin + 1 && out.corners.back() == out.corners[begin])
      out.corners.pop_back();
    if (out.corners.size() < begin + 3) {
      out.corners.resize(begin);
      ++broken_;
      continue;
    }
    if (reverse) std::reverse(out.corners.begin() + begin, out.corners.end());
    out.loop_ends.push_back(static_cast<std::uint32_t>(out.corners.size()));
    any = true;
  }
  if (any) {
    out.faces.push_back(c_->face);
    out.face_ends.push_back(static_cast<std::uint32_t>(out.loop_ends.size()));
  }
}

}  // namespace polyhull::hull
