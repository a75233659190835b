// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/face_clipper.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {
void FaceClipper::begin(const ClippingProblem& problem) {
  problem_ = &problem;
  std::size_t largest = 0;
  for (const Cone* cone : problem.cones) largest = std::max(largest, cone->size());
  stamp_.assign(largest, 0);
  line_stamp_.assign(largest, 0);
  lines_.resize(largest);
  piece_at_ray_.assign(largest, 0);
  candidates_.resize(largest + 1);
  stamp_now_ = look_now_ = 0;
  bounds_face_.assign(problem.cones.size(), 0);
}

bool FaceClipper::start(std::uint32_t face) {
  chart_.face = face;
  const ClippingProblem& s = *problem_;
  if (face >= s.cone_faces()) {
    if (!s.box_active[face - s.cone_faces()]) return false;
    start_box_face();
    return true;
  }
  chart_.cone = s.set.group[face];
  chart_.local = face - s.first_face[chart_.cone];
  if (s.far[chart_.cone] <= 0) return false;
  start_cone_face();
  return true;
}

void FaceClipper::start_cone_face() {
  const ClippingProblem& s = *problem_;
  const Cone& c = *s.cones[chart_.cone];
  const std::uint32_t begin = chart_.local, end = c.next[chart_.local],
                      base = s.first_face[chart_.cone];
  const auto real = [](const IntVec& v) {
    return Vec3(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
  };
  const Vec3 d0 = real(c.rays[begin]), e = real(c.rays[end]) - d0;
  const double length = glm::length(d0), along = glm::length(e);
  chart_.axis_a = d0 / length;
  chart_.axis_b = e / along;
  chart_.corner = c.centre_real;
  // Depths are in units of the far plane's, so that w is at least about 1.
  const Vec3 axis = real(c.axis);
  const double axis_length = glm::length(axis);
  chart_.unit = 1.0 / s.reach[chart_.cone];
  chart_.handed = 1;

  const double width = along / length;  // t of the second ray
  const double scale = 1.0 / std::max(1.0, width);
  const double za = glm::dot(axis, chart_.axis_a) / axis_length,
               zb = glm::dot(axis, chart_.axis_b) / axis_length;
  const Edge left{{0, 1, 0}, base + c.previous[begin], c.turn[begin]};
  const Edge right{{width * scale, -scale, 0}, base + end, c.turn[end]};
  const Edge far{
      {-za, -zb, s.far[chart_.cone] * chart_.unit / axis_length}, s.far_plane(chart_.cone), 1};
  const Edge near{
      {za, zb, -s.near[chart_.cone] * chart_.unit / axis_length}, s.near_plane(chart_.cone), 1};
  // far (left to right), right ray (up to near), near, left ray (down).
  const Corner apex{0, 0, 1, determinant_error, 0, 0, 1, true};
  const bool ends = s.near[chart_.cone] > 0;
  add_rectangle({{{make_corner(left, far, 1), far},
                  {make_corner(far, right, 1), right},
                  {ends ? make_corner(right, near, 1) : apex, near},
                  {ends ? make_corner(near, left, 1) : apex, left}}});
}

void FaceClipper::start_box_face() {
  const ClippingProblem& s = *problem_;
  const int k = static_cast<int>(chart_.face - s.cone_faces()), axis = k / 2;
  chart_.cone = -1;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  chart_.corner = Vec3(0.0);
  chart_.corner[axis] = s.box[k], chart_.corner[u] = s.box[2 * u], chart_.corner[v] = s.box[2 * v];
  chart_.axis_b = chart_.axis_c = Vec3(0.0);
  chart_.axis_b[u] = 1, chart_.axis_c[v] = 1;
  const double wide = s.box[2 * u + 1] - s.box[2 * u], high = s.box[2 * v + 1] - s.box[2 * v];
  double largest = std::max(wide, high);
  for (const Cone* other : s.cones)
    largest = std::max(largest, glm::length(other->centre_real - chart_.corner));
  for (int i = 0; i < 6; ++i)
    largest = std::max(largest, std::abs(s.box[i] - chart_.corner[i / 2]));
  chart_.unit = 1.0 / largest;
  // u, v and the face's axis are right-handed; the inward normal is the axis for the lower face.
  chart_.handed = k % 2 == 0 ? 1 : -1;
  const std::uint32_t pu = s.box_face(2 * u), pv = s.box_face(2 * v);
  const Edge left{{0, 1, 0}, pu, 1}, right{{wide * chart_.unit, -1, 0}, pu + 1, 1};
  const Edge bottom{{0, 0, 1}, pv, 1}, top{{high * chart_.unit, 0, -1}, pv + 1, 1};
  add_rectangle({{{make_corner(left, bottom, 1), bottom},
                  {make_corner(bottom, right, 1), right},
                  {make_corner(right, top, 1), top},
                  {make_corner(top, left, 1), left}}});
}

FaceClipper::Corner FaceClipper::make_corner(const Edge& l, const Edge& m, int s) {
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

void FaceClipper::add_rectangle(const std::array<Node, 4>& nodes) {
  if (parts_.empty()) parts_.emplace_back();
  part_count_ = 1;
  parts_[0].nodes.assign(nodes.begin(), nodes.end());
  parts_[0].loop_ends.assign(1, 4);
  parts_[0].extent = {0, 0, 0, 0, 0, true};  // until divide() knows better
  divide(0);
}

void FaceClipper::clip(std::uint32_t begin, std::uint32_t end, FaceLoops& out) {
  std::int32_t cone = -2;
  for (std::uint32_t f = begin; f < end; ++f) {
    if (!start(f)) continue;
    if (chart_.cone != cone) {
      cone = chart_.cone;
      order_ = cone >= 0 ? problem_->order[cone] : problem_->box_order;
    }
    // The starting rectangle of a box face already lies on its neighbours.
    if (cone >= 0) cut_by_box();
    cut_by_cones(order_);
    if (part_count_ == 0) continue;
    emit(out);
    to_front(order_);
  }
  out.predicates += predicates_, out.exact += exact_, out.broken += broken_;
  predicates_ = exact_ = broken_ = 0;
}

void FaceClipper::cut_by_box() {
  const ClippingProblem& s = *problem_;
  part_ = &parts_[0];
  cone_ = nullptr;
  for (int k = 0; k < 6; ++k) {
    if (!s.box_active[k]) continue;
    Vec3 normal(0.0), origin(0.0);
    normal[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
    origin[k / 2] = s.box[k];
    const Line line =
        line_of(normal, {chart_.axis_a, chart_.axis_b, (chart_.corner - origin) * chart_.unit});
    begin_cuts();
    add_cut(line, 0, s.box_face(k));
    const bool left =
        cuts_.empty() ? side(part_->nodes[0].corner, s.box_face(k), line) > 0 : apply_cuts();
    if (!left) {
      part_count_ = 0;
      return;
    }
  }
  divide(0);
}

void FaceClipper::cut_by_cones(std::vector<std::uint32_t>& order) {
  for (const std::uint32_t other : order) {
    look_at(other);
    for (std::size_t i = part_count_; i-- > 0;) {
      part_ = &parts_[i];
      changed_ = false;
      if (!cut_part())
        std::swap(parts_[i], parts_[--part_count_]);
      else if (changed_)
        divide(i);
    }
    if (part_count_ == 0) return;
  }
}

/// Cuts the part by the cone; false if nothing is left.
bool FaceClipper::cut_part() {
  const Meeting meeting = gather();
  if (meeting == Meeting::inside) return !cone_->complement;
  if (meeting == Meeting::outside) return cone_->complement;
  begin_cuts();
  for (std::uint32_t i = 0; i < candidate_count_; ++i)
    add_cut(cached_line(candidates_[i]), candidates_[i], base_ + candidates_[i]);
  return apply_cuts();
}

/// Finds where the part's corners lie in (t, w); loops that lie apart in w become parts of their
/// own, added at the end. Where the corners are not known well all stays as it was.
void FaceClipper::divide(std::size_t index) {
  Part& part = parts_[index];
  loops_.clear();
  std::uint32_t begin = 0;
  for (const std::uint32_t end : part.loop_ends) {
    Extent now{1e300, -1e300, 1e300, -1e300, 0, false};
    for (std::uint32_t i = begin; i < end; ++i) {
      const Corner& v = part.nodes[i].corner;
      if (v.apex) {
        now.endless = true;
        continue;
      }
      if (v.tolerance > 1e-9) return;
      now.t0 = std::min(now.t0, v.t), now.t1 = std::max(now.t1, v.t);
      now.w0 = std::min(now.w0, v.w), now.w1 = std::max(now.w1, v.w);
      now.error = std::max(now.error, v.tolerance);
    }
    loops_.push_back({now, begin, end});
    begin = end;
  }
  if (loops_.size() > 1)
    std::sort(loops_.begin(), loops_.end(),
              [](const Loop& a, const Loop& b) { return a.extent.w0 < b.extent.w0; });
  part.extent = loops_[0].extent;
  std::size_t group = 1;  // how many loops the first part keeps
  const auto apart = [](const Extent& a, const Extent& b) {
    // A hole lies within its loop's extent, so they stay together.
    return !a.endless && b.w0 > a.w1 + 1e-6 * (1.0 + std::abs(a.w1));
  };
  const auto join = [](Extent& a, const Extent& b) {
    a.t0 = std::min(a.t0, b.t0), a.t1 = std::max(a.t1, b.t1), a.w1 = std::max(a.w1, b.w1);
    a.error = std::max(a.error, b.error), a.endless = a.endless || b.endless;
  };
  for (; group < loops_.size() && !apart(part.extent, loops_[group].extent); ++group)
    join(part.extent, loops_[group].extent);
  if (group == loops_.size()) return;
  new_nodes_.swap(part.nodes);
  part.nodes.clear(), part.loop_ends.clear();
  std::size_t to = index;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const Loop& loop = loops_[i];
    if (i >= group) {
      if (i == group || apart(parts_[to].extent, loop.extent)) {
        to = part_count_++;
        if (parts_.size() < part_count_) parts_.emplace_back();
        parts_[to].nodes.clear(), parts_[to].loop_ends.clear();
        parts_[to].extent = loop.extent;
      } else {
        join(parts_[to].extent, loop.extent);
      }
    }
    Part& p = parts_[to];
    p.nodes.insert(p.nodes.end(), new_nodes_.begin() + loop.begin, new_nodes_.begin() + loop.end);
    p.loop_ends.push_back(static_cast<std::uint32_t>(p.nodes.size()));
  }
}

/// The cones that bound this face are likely to bound the next one, too, and what they leave most
/// others hold as a whole.
void FaceClipper::to_front(std::vector<std::uint32_t>& order) {
  std::fill(bounds_face_.begin(), bounds_face_.end(), 0);
  for (std::size_t i = 0; i < part_count_; ++i)
    for (const Node& node : parts_[i].nodes)
      if (node.edge.plane < problem_->cone_faces())
        bounds_face_[problem_->set.group[node.edge.plane]] = 1;
  new_order_.clear();
  for (int bounds = 1; bounds >= 0; --bounds)
    for (const std::uint32_t cone : order)
      if (bounds_face_[cone] == bounds) new_order_.push_back(cone);
  order.swap(new_order_);
}

int FaceClipper::side_exactly(const Corner& v, std::uint32_t plane, int orientation) {
  ++exact_;
  int sign;
  if (v.apex) {
    const IntVec& c = problem_->cones[chart_.cone]->centre;
    sign = orientation * problem_->set.side_of_point(plane, c[0], c[1], c[2]);
  } else {
    sign = orientation * v.sign * chart_.handed *
           problem_->set.orientation(chart_.face, v.plane1, v.plane2, plane);
  }
  return sign != 0 ? sign : 1;
}

void FaceClipper::emit(FaceLoops& out) {
  // A cone's chart and the lower faces of the box are seen from inside, so their loops turn around.
  const bool reverse = chart_.cone >= 0 || chart_.handed > 0;
  bool any = false;
  std::uint32_t k = 0;
  for (std::size_t i = 0; i < part_count_; ++i, k = 0)
    for (const std::uint32_t loop_end : parts_[i].loop_ends) {
      const std::size_t begin = out.corners.size();
      for (; k < loop_end; ++k) {
        const Corner& v = parts_[i].nodes[k].corner;
        CornerKey key;
        if (v.apex) {
          key = {static_cast<std::uint32_t>(chart_.cone),
                 problem_->cones[chart_.cone]->ring[chart_.local], apex_mark};
          if (out.corners.size() > begin && same(out.corners.back(), key)) continue;
        } else {
          key = {chart_.face, v.plane1, v.plane2};
          if (key[1] > key[2]) std::swap(key[1], key[2]);
          if (key[0] > key[1]) std::swap(key[0], key[1]);
          if (key[1] > key[2]) std::swap(key[1], key[2]);
        }
        out.corners.push_back(key);
      }
      if (out.corners.size() > begin + 1 && same(out.corners.back(), out.corners[begin]))
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
    out.faces.push_back(chart_.face);
    out.face_ends.push_back(static_cast<std::uint32_t>(out.loop_ends.size()));
  }
}

}  // namespace polyhull::hull
