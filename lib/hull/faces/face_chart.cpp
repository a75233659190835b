// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/face_chart.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {

Corner make_corner(const Edge& l, const Edge& m, int s) {
  const double u = l.line.b * m.line.d - l.line.d * m.line.b;
  const bool known = u * s > 1e-9;
  const double inverse = 1.0 / (known || std::abs(u) > 1e-300 ? u : 1e-300);
  Corner v;
  v.h = 1.0;
  v.t = (l.line.d * m.line.a - l.line.a * m.line.d) * inverse;
  v.w = (l.line.a * m.line.b - l.line.b * m.line.a) * inverse;
  v.tolerance = known ? determinant_error * std::abs(inverse) : undecided;
  v.plane1 = l.plane, v.plane2 = m.plane;
  v.sign = static_cast<std::int8_t>(s * l.orientation * m.orientation);
  v.apex = false;
  return v;
}

bool FaceChart::lay(std::uint32_t number) {
  face = number;
  const ClippingProblem& s = *problem;
  if (face >= s.cone_faces()) {
    if (!s.box_active[face - s.cone_faces()]) return false;
    lay_on_box();
    return true;
  }
  cone = s.set.group[face];
  local = face - s.first_face[cone];
  if (s.far[cone] <= 0) return false;
  lay_on_cone();
  return true;
}

void FaceChart::lay_on_cone() {
  const ClippingProblem& s = *problem;
  const Cone& c = *s.cones[cone];
  const std::uint32_t begin = local, end = c.next[local], base = s.first_face[cone];
  const Vec3 d0 = real(c.rays[begin]), e = real(c.rays[end]) - d0;
  const double length = glm::length(d0), along = glm::length(e);
  axis_a = d0 / length;
  axis_b = e / along;
  corner = c.centre_real;
  // Depths are in units of the far plane's, so that w is at least about 1.
  const Vec3 axis = real(c.axis);
  const double axis_length = glm::length(axis);
  unit = 1.0 / s.reach[cone];
  handed = 1;

  const double width = along / length;  // t of the second ray
  const double scale = 1.0 / std::max(1.0, width);
  const double za = glm::dot(axis, axis_a) / axis_length, zb = glm::dot(axis, axis_b) / axis_length;
  const Edge left{{0, 1, 0}, base + c.previous[begin], c.turn[begin]};
  const Edge right{{width * scale, -scale, 0}, base + end, c.turn[end]};
  const Edge far{{-za, -zb, s.far[cone] * unit / axis_length}, s.far_plane(cone), 1};
  const Edge near{{za, zb, -s.near[cone] * unit / axis_length}, s.near_plane(cone), 1};
  // far (left to right), right ray (up to near), near, left ray (down).
  const Corner apex{0, 0, 1, determinant_error, 0, 0, 1, true};
  const bool ends = s.near[cone] > 0;
  start = {{{make_corner(left, far, 1), far},
            {make_corner(far, right, 1), right},
            {ends ? make_corner(right, near, 1) : apex, near},
            {ends ? make_corner(near, left, 1) : apex, left}}};
}

void FaceChart::lay_on_box() {
  const ClippingProblem& s = *problem;
  const int k = static_cast<int>(face - s.cone_faces()), axis = k / 2;
  cone = -1;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  corner = Vec3(0.0);
  corner[axis] = s.box[k], corner[u] = s.box[2 * u], corner[v] = s.box[2 * v];
  axis_b = axis_c = Vec3(0.0);
  axis_b[u] = 1, axis_c[v] = 1;
  const double wide = s.box[2 * u + 1] - s.box[2 * u], high = s.box[2 * v + 1] - s.box[2 * v];
  double largest = std::max(wide, high);
  for (const Cone* other : s.cones)
    largest = std::max(largest, glm::length(other->centre_real - corner));
  for (int i = 0; i < 6; ++i) largest = std::max(largest, std::abs(s.box[i] - corner[i / 2]));
  unit = 1.0 / largest;
  // u, v and the face's axis are right-handed; the inward normal is the axis for the lower face.
  handed = k % 2 == 0 ? 1 : -1;
  const std::uint32_t pu = s.box_face(2 * u), pv = s.box_face(2 * v);
  const Edge left{{0, 1, 0}, pu, 1}, right{{wide * unit, -1, 0}, pu + 1, 1};
  const Edge bottom{{0, 0, 1}, pv, 1}, top{{high * unit, 0, -1}, pv + 1, 1};
  start = {{{make_corner(left, bottom, 1), bottom},
            {make_corner(bottom, right, 1), right},
            {make_corner(right, top, 1), top},
            {make_corner(top, left, 1), left}}};
}

int FaceChart::side_exactly(const Corner& v, std::uint32_t plane, int orientation) {
  ++exact;
  int sign;
  if (v.apex) {
    const IntVec& c = problem->cones[cone]->centre;
    sign = orientation * problem->set.side_of_point(plane, c[0], c[1], c[2]);
  } else {
    sign =
        orientation * v.sign * handed * problem->set.orientation(face, v.plane1, v.plane2, plane);
  }
  return sign != 0 ? sign : 1;
}

}  // namespace polyhull::hull
