// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/face_clipper.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace polyhull::hull {

void FaceClipper::begin(const ClippingProblem& problem) {
  chart_.problem = &problem;
  std::size_t most = 0;
  for (const Cone* cone : problem.cones) most = std::max(most, cone->size());
  view_.begin(most);
  cutter_.begin(most);
  bounds_face_.assign(problem.cones.size(), 0);
}

void FaceClipper::clip(std::uint32_t begin, std::uint32_t end, FaceLoops& out) {
  std::int32_t cone = -2;
  for (std::uint32_t f = begin; f < end; ++f) {
    if (!chart_.lay(f)) continue;
    start();
    if (chart_.cone != cone) {
      cone = chart_.cone;
      order_ = cone >= 0 ? chart_.problem->order[cone] : chart_.problem->box_order;
    }
    // The starting rectangle of a box face already lies on its neighbours.
    if (cone >= 0) cut_by_box();
    cut_by_cones(order_);
    if (part_count_ == 0) continue;
    emit(out);
    to_front(order_);
  }
  out.predicates += std::exchange(chart_.predicates, 0);
  out.exact += std::exchange(chart_.exact, 0);
  out.broken += std::exchange(cutter_.broken, 0);
}

void FaceClipper::start() {
  if (parts_.empty()) parts_.emplace_back();
  part_count_ = 1;
  parts_[0].nodes.assign(chart_.start.begin(), chart_.start.end());
  parts_[0].loop_ends.assign(1, 4);
  parts_[0].extent = {0, 0, 0, 0, 0, true};  // until divide() knows better
  divide(0);
}

void FaceClipper::cut_by_box() {
  const ClippingProblem& s = *chart_.problem;
  for (int k = 0; k < 6; ++k) {
    if (!s.box_active[k]) continue;
    Vec3 normal(0.0), origin(0.0);
    normal[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
    origin[k / 2] = s.box[k];
    const Line line = line_of(normal, chart_.seen_from(origin));
    cutter_.begin_cuts(parts_[0], false);
    cutter_.add_cut(line, 0, s.box_face(k));
    const bool left = cutter_.any_cuts()
                          ? cutter_.apply()
                          : chart_.side(parts_[0].nodes[0].corner, s.box_face(k), line) > 0;
    if (!left) {
      part_count_ = 0;
      return;
    }
  }
  divide(0);
}

void FaceClipper::cut_by_cones(const std::vector<std::uint32_t>& order) {
  for (const std::uint32_t other : order) {
    view_.look_from(other);
    for (std::size_t i = part_count_; i-- > 0;)
      if (!cut_part(i)) std::swap(parts_[i], parts_[--part_count_]);
    if (part_count_ == 0) return;
  }
}

/// Cuts the part by the cone; false if nothing is left.
bool FaceClipper::cut_part(std::size_t index) {
  using Meeting = ConeView::Meeting;
  const Meeting meeting = view_.gather(parts_[index].extent);
  if (meeting != Meeting::perhaps) return (meeting == Meeting::inside) != view_.cone().complement;
  cutter_.begin_cuts(parts_[index], true);
  for (const std::uint32_t edge : view_.edges())
    cutter_.add_cut(view_.line(edge), edge, view_.base() + edge);
  if (!cutter_.apply()) return false;
  if (cutter_.changed()) divide(index);
  return true;
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
  divided_.swap(part.nodes);
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
    p.nodes.insert(p.nodes.end(), divided_.begin() + loop.begin, divided_.begin() + loop.end);
    p.loop_ends.push_back(static_cast<std::uint32_t>(p.nodes.size()));
  }
}

/// The cones that bound this face are likely to bound the next one, too, and what they leave most
/// others hold as a whole.
void FaceClipper::to_front(std::vector<std::uint32_t>& order) {
  std::fill(bounds_face_.begin(), bounds_face_.end(), 0);
  for (std::size_t i = 0; i < part_count_; ++i)
    for (const Node& node : parts_[i].nodes)
      if (node.edge.plane < chart_.problem->cone_faces())
        bounds_face_[chart_.problem->set.group[node.edge.plane]] = 1;
  new_order_.clear();
  for (int bounds = 1; bounds >= 0; --bounds)
    for (const std::uint32_t cone : order)
      if (bounds_face_[cone] == bounds) new_order_.push_back(cone);
  order.swap(new_order_);
}

/// By its planes in rising order; an apex by its cone and ring.
CornerKey FaceClipper::key_of(const Corner& v) const {
  if (v.apex)
    return {static_cast<std::uint32_t>(chart_.cone),
            chart_.problem->cones[chart_.cone]->ring[chart_.local], apex_mark};
  CornerKey key{chart_.face, v.plane1, v.plane2};
  if (key[1] > key[2]) std::swap(key[1], key[2]);
  if (key[0] > key[1]) std::swap(key[0], key[1]);
  if (key[1] > key[2]) std::swap(key[1], key[2]);
  return key;
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
        const CornerKey key = key_of(v);
        if (v.apex && out.corners.size() > begin && same(out.corners.back(), key)) continue;
        out.corners.push_back(key);
      }
      if (out.corners.size() > begin + 1 && same(out.corners.back(), out.corners[begin]))
        out.corners.pop_back();
      if (out.corners.size() < begin + 3) {
        out.corners.resize(begin);
        ++out.broken;
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
