// SPDX-License-Identifier: LGPL-2.1-or-later
// The part of FaceClipper that cuts the loops by one cone's edges.
#include <algorithm>
#include <cmath>

#include "hull/face_clipper.h"

namespace polyhull::hull {
namespace {

constexpr std::uint32_t nothing = 0xffffffffu;

}  // namespace

int FaceClipper::side(const Crossing& x, std::uint32_t plane, const Line& line, int orientation) {
  ++predicates_;
  const double d = line.a * x.h + line.b * x.t + line.d * x.w;
  if (d > determinant_error) return 1;
  if (d < -determinant_error) return -1;
  const Edge& edge = c_->edges[x.edge];
  Corner v{};
  v.plane1 = edge.plane;
  v.plane2 = cuts_[x.cut].plane;
  v.sign = static_cast<std::int8_t>(x.sign * edge.orientation);
  return side_exactly(v, plane, orientation);
}

/// Makes the crossing a corner.
std::uint32_t FaceClipper::keep(const Crossing& x) {
  const Edge& edge = c_->edges[x.edge];
  const Cut& cut = cuts_[x.cut];
  if (x.h <= 1e-9) {
    const Corner from = c_->corners[edge.from], to = c_->corners[edge.to];
    return make_corner(edge.line, cut.line, edge.plane, cut.plane, x.sign, edge.orientation, &from,
                       &to, value(from, cut.line), value(to, cut.line));
  }
  const double inverse = 1.0 / x.h;
  c_->corners.push_back({1.0, x.t * inverse, x.w * inverse, determinant_error * inverse, edge.plane,
                         cut.plane, static_cast<std::int8_t>(x.sign * edge.orientation), false});
  return static_cast<std::uint32_t>(c_->corners.size() - 1);
}

/// Crosses the cut's line with all edges; what it holds inside the face becomes new edges, and the
/// crossings between the cut's rays go to crossings_.
void FaceClipper::cross(std::uint32_t index, const Cone* cone, std::uint32_t base, const Picture& p,
                        bool forward) {
  const Cut cut = cuts_[index];
  const std::int8_t* sides = sides_.data() + cut.sides;
  std::uint32_t before = nothing, after = nothing, begin_ray = 0, end_ray = 0;
  Line before_line{}, after_line{};
  int begin_turn = 1, end_turn = 1;
  if (cone != nullptr) {
    begin_ray = cut.edge;
    end_ray = cone->next[cut.edge];
    before = cone->previous[cut.edge];
    after = end_ray;
    before_line = cached_line(*cone, before, p);
    after_line = cached_line(*cone, after, p);
    begin_turn = cone->turn[begin_ray];
    end_turn = cone->turn[end_ray];
  }
  on_cut_.clear();
  const std::int8_t begin_bit = forward ? 1 : 2, end_bit = forward ? 2 : 1;
  const Edge* edges = c_->edges.data();
  const std::uint32_t n = static_cast<std::uint32_t>(c_->edges.size());
  for (std::uint32_t e = 0; e < n; ++e) {
    const std::int8_t end_side = sides[edges[e].to];
    if (sides[edges[e].from] == end_side) continue;
    const Line l = edges[e].line, m = cut.line;
    const double s = -end_side;
    Crossing x;
    x.h = (l.b * m.d - l.d * m.b) * s;
    x.t = (l.d * m.a - l.a * m.d) * s;
    x.w = (l.a * m.b - l.b * m.a) * s;
    x.edge = e, x.cut = index, x.corner = nothing, x.later = nothing;
    x.sign = static_cast<std::int8_t>(-end_side);
    x.place = 0;
    if (cone != nullptr) {
      if (side(x, base + before, before_line, 1) != begin_turn) x.place |= begin_bit;
      if (side(x, base + after, after_line, 1) != end_turn) x.place |= end_bit;
    }
    on_cut_.push_back(x);
  }
  if (on_cut_.size() == 2) {
    // The line enters the face where the crossed edge's line grows.
    if (on_cut_[0].sign < 0) std::swap(on_cut_[0], on_cut_[1]);
  } else {
    const auto earlier = [&](const Crossing& x, const Crossing& y) {
      const Edge& edge = c_->edges[x.edge];
      return side(y, edge.plane, edge.line, edge.orientation) == x.sign;
    };
    for (std::size_t i = 1; i < on_cut_.size(); ++i)
      for (std::size_t k = i; k > 0 && earlier(on_cut_[k], on_cut_[k - 1]); --k)
        std::swap(on_cut_[k], on_cut_[k - 1]);
  }
  const auto ray_corner = [&](bool first) {
    const bool begin = first == forward;  // the ray where the edge begins, in the cone's order
    const std::uint32_t ray = begin ? begin_ray : end_ray;
    for (const auto& known : ray_corners_)
      if (known.first == ray) return known.second;
    const int geometric = (begin ? begin_turn : end_turn) * (forward ? 1 : -1);
    const std::uint32_t corner = begin
                                     ? make_corner(before_line, cut.line, base + before, cut.plane,
                                                   geometric, 1, nullptr, nullptr, 0, 0)
                                     : make_corner(cut.line, after_line, cut.plane, base + after,
                                                   geometric, 1, nullptr, nullptr, 0, 0);
    ray_corners_.push_back({ray, corner});
    return corner;
  };
  for (std::size_t i = 0; i + 1 < on_cut_.size(); i += 2) {
    Crossing& x = on_cut_[i];
    Crossing& y = on_cut_[i + 1];
    std::uint32_t a, b;
    if (x.place == 0)
      a = x.corner = keep(x);
    else if (x.place == 1 && (y.place == 0 || y.place == 2))
      a = ray_corner(true);
    else if (y.place == 0)
      a = ray_corner(true);
    else
      continue;
    if (y.place == 0)
      b = y.corner = keep(y);
    else
      b = ray_corner(false);
    new_edges_.push_back({cut.line, cut.plane, 1, a, b});
    for (const Crossing* z : {&x, &y}) {
      if (z->place != 0) continue;
      crossings_.push_back(*z);
      crossings_.back().later = first_on_edge_[z->edge];
      first_on_edge_[z->edge] = static_cast<std::uint32_t>(crossings_.size() - 1);
    }
  }
  if (on_cut_.size() % 2 != 0) ++broken_;
}

/// Of loops that cross no face of the cone: whether there is just one and it lies inside.
bool FaceClipper::whole(const Cone* cone, std::uint32_t cone_index, const Picture& p) {
  const std::uint32_t n = static_cast<std::uint32_t>(c_->edges.size());
  if (cone == nullptr) return false;
  next_.assign(c_->corners.size(), nothing);
  for (std::uint32_t e = 0; e < n; ++e) next_[c_->edges[e].from] = e;
  std::uint32_t length = 0, e = 0;
  do {
    e = next_[c_->edges[e].to];
    ++length;
  } while (e != 0 && e != nothing && length < n);
  return length == n && e == 0 && inside_cone(0, cone_index, p);
}

bool FaceClipper::apply_cuts(const Cone* cone, std::uint32_t cone_index, const Picture& p) {
  const std::uint32_t old_corners = static_cast<std::uint32_t>(c_->corners.size());
  const std::uint32_t base = cone != nullptr ? scene_->first_face[cone_index] : 0;
  bool forward = true;
  const std::uint32_t n = static_cast<std::uint32_t>(c_->edges.size());
  crossings_.clear();
  first_on_edge_.assign(n, nothing);
  ray_corners_.clear();
  new_edges_.clear();
  if (!cuts_.empty()) {
    if (cone != nullptr) {
      // Seen from the solid's side of the face, the cone's edges run against the chart.
      int above;
      double x;
      if (c_->cone >= 0) {
        const Cone& own = *scene_->cones[c_->cone];
        x = glm::dot(own.normals[c_->local], cone->centre_real - own.centre_real) * c_->unit;
      } else {
        const int k = static_cast<int>(c_->face - scene_->cone_faces());
        x = (cone->centre_real[k / 2] - scene_->box[k]) * c_->unit * c_->handed;
      }
      if (std::abs(x) > 1e-14)
        above = x > 0 ? 1 : -1;
      else
        above =
            scene_->set.side_of_point(c_->face, cone->centre[0], cone->centre[1], cone->centre[2]);
      forward = above * c_->handed < 0;
    }
    for (std::uint32_t i = 0; i < cuts_.size(); ++i) cross(i, cone, base, p, forward);
  }

  if (crossings_.empty() && new_edges_.empty() && whole(cone, cone_index, p)) {
    c_->corners.resize(old_corners);
    return true;
  }

  // What of each old edge stays. States: -1 unknown, 0 outside, 1 inside.
  state_.assign(n, -1);
  next_.assign(old_corners, nothing);
  for (std::uint32_t e = 0; e < n; ++e) next_[c_->edges[e].from] = e;
  for (std::uint32_t e = 0; e < n; ++e) {
    if (first_on_edge_[e] == nothing) continue;
    const Edge edge = c_->edges[e];
    on_edge_.clear();
    for (std::uint32_t i = first_on_edge_[e]; i != nothing; i = crossings_[i].later)
      on_edge_.push_back(crossings_[i]);
    const auto side_at = [&](const Crossing& x, std::uint32_t corner) {
      return sides_[cuts_[x.cut].sides + corner];
    };
    const auto earlier = [&](const Crossing& x, const Crossing& y) {
      const Cut& cut = cuts_[y.cut];
      return side(x, cut.plane, cut.line, 1) == side_at(y, edge.from);
    };
    for (std::size_t i = 1; i < on_edge_.size(); ++i)
      for (std::size_t k = i; k > 0 && earlier(on_edge_[k], on_edge_[k - 1]); --k)
        std::swap(on_edge_[k], on_edge_[k - 1]);
    bool inside = side_at(on_edge_[0], edge.from) > 0;
    std::uint32_t corner = edge.from;
    for (const Crossing& x : on_edge_) {
      if ((side_at(x, edge.from) > 0) != inside) ++broken_;
      if (inside) new_edges_.push_back({edge.line, edge.plane, edge.orientation, corner, x.corner});
      inside = !inside;
      corner = x.corner;
    }
    if (inside) new_edges_.push_back({edge.line, edge.plane, edge.orientation, corner, edge.to});
    state_[e] = inside ? 1 : 0;  // at its end
  }
  for (std::uint32_t e = 0; e < n; ++e) {
    if (first_on_edge_[e] == nothing) continue;
    for (std::uint32_t k = next_[c_->edges[e].to]; k != nothing && state_[k] < 0;
         k = next_[c_->edges[k].to]) {
      state_[k] = state_[e];
      if (state_[k] == 1) new_edges_.push_back(c_->edges[k]);
    }
  }
  for (std::uint32_t e = 0; e < n; ++e) {
    if (state_[e] >= 0) continue;
    bool inside;
    if (cone != nullptr) {
      inside = inside_cone(e, cone_index, p);
    } else {
      inside = !cuts_.empty() && sides_[cuts_[0].sides + c_->edges[e].from] > 0;
    }
    for (std::uint32_t k = e; k != nothing && state_[k] < 0; k = next_[c_->edges[k].to]) {
      state_[k] = inside;
      if (inside) new_edges_.push_back(c_->edges[k]);
    }
  }
  c_->edges.swap(new_edges_);
  if (c_->edges.empty()) return false;

  // Only the corners that are still in use.
  remap_.assign(c_->corners.size(), nothing);
  new_corners_.clear();
  for (Edge& e : c_->edges)
    for (std::uint32_t* v : {&e.from, &e.to}) {
      if (remap_[*v] == nothing) {
        remap_[*v] = static_cast<std::uint32_t>(new_corners_.size());
        new_corners_.push_back(c_->corners[*v]);
      }
      *v = remap_[*v];
    }
  c_->corners.swap(new_corners_);
  update_extent();
  return true;
}

void FaceClipper::emit(FaceLoops& out) {
  const std::uint32_t n = static_cast<std::uint32_t>(c_->edges.size());
  next_.assign(c_->corners.size(), nothing);
  for (std::uint32_t e = 0; e < n; ++e) next_[c_->edges[e].from] = e;
  state_.assign(n, 0);
  // A cone's chart and the lower faces of the box are seen from inside, so their loops turn around.
  const bool reverse = c_->cone >= 0 || c_->handed > 0;
  bool any = false;
  for (std::uint32_t e = 0; e < n; ++e) {
    if (state_[e] != 0) continue;
    const std::size_t begin = out.corners.size();
    for (std::uint32_t k = e; k != nothing && state_[k] == 0; k = next_[c_->edges[k].to]) {
      state_[k] = 1;
      const Corner& v = c_->corners[c_->edges[k].from];
      CornerKey key;
      if (v.apex) {
        key = {static_cast<std::uint32_t>(c_->cone), scene_->cones[c_->cone]->ring[c_->local],
               apex_mark};
        if (out.corners.size() > begin && out.corners.back() == key) continue;
      } else {
        key = {c_->face, v.plane1, v.plane2};
        std::sort(key.begin(), key.end());
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
