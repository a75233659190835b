// SPDX-License-Identifier: LGPL-2.1-or-later
// The part of FaceClipper that cuts the loops by one cone's edges.
#include <algorithm>
#include <cmath>

#include "hull/face_clipper.h"

namespace polyhull::hull {
namespace {

constexpr std::uint32_t nothing = 0xffffffffu;

}  // namespace

/// Crosses the cut's line with all edges; what it holds inside the face becomes new edges, and the
/// crossings between the cut's rays go to crossings_.
void FaceClipper::cross(std::uint32_t index, const Cone* cone, std::uint32_t base, const Picture& p,
                        bool forward) {
  Cut& cut = cuts_[index];
  const std::int8_t* sides = sides_.data() + cut.sides;
  on_cut_.clear();
  std::uint32_t before = nothing, after = nothing, begin_ray = 0, end_ray = 0;
  Line before_line{}, after_line{};
  if (cone != nullptr) {
    begin_ray = cut.edge;
    end_ray = cone->next[cut.edge];
    before = cone->previous[cut.edge];
    after = end_ray;
    before_line = cached_line(*cone, before, p);
    after_line = cached_line(*cone, after, p);
  }
  for (std::uint32_t e = 0; e < c_->edges.size(); ++e) {
    const Edge edge = c_->edges[e];
    if (sides[edge.from] == sides[edge.to]) continue;
    const Corner from = c_->corners[edge.from], to = c_->corners[edge.to];
    const std::uint32_t corner =
        make_corner(edge.line, cut.line, edge.plane, cut.plane, -sides[edge.to], edge.orientation,
                    &from, &to, value(from, cut.line), value(to, cut.line));
    std::int8_t place = 0;
    if (cone != nullptr) {
      const Corner& x = c_->corners[corner];
      if (side(x, base + before, before_line) != cone->turn[begin_ray]) place |= forward ? 1 : 2;
      if (side(x, base + after, after_line) != cone->turn[end_ray]) place |= forward ? 2 : 1;
    }
    on_cut_.push_back({e, corner, index, place});
  }
  // Along the line's own direction. It enters the face where the crossed edge's line grows.
  const auto earlier = [&](const Crossing& x, const Crossing& y) {
    const Edge& edge = c_->edges[x.edge];
    const int growth = -sides[edge.to];
    return side(c_->corners[y.corner], edge.plane, edge.line, edge.orientation) == growth;
  };
  for (std::size_t i = 1; i < on_cut_.size(); ++i)
    for (std::size_t k = i; k > 0 && earlier(on_cut_[k], on_cut_[k - 1]); --k)
      std::swap(on_cut_[k], on_cut_[k - 1]);
  const auto ray_corner = [&](bool first) {
    const bool begin = first == forward;  // the ray where the edge begins, in the cone's order
    const std::uint32_t ray = begin ? begin_ray : end_ray;
    for (const auto& known : ray_corners_)
      if (known.first == ray) return known.second;
    const int geometric = cone->turn[ray] * (forward ? 1 : -1);
    const std::uint32_t corner = begin
                                     ? make_corner(before_line, cut.line, base + before, cut.plane,
                                                   geometric, 1, nullptr, nullptr, 0, 0)
                                     : make_corner(cut.line, after_line, cut.plane, base + after,
                                                   geometric, 1, nullptr, nullptr, 0, 0);
    ray_corners_.push_back({ray, corner});
    return corner;
  };
  for (std::size_t i = 0; i + 1 < on_cut_.size(); i += 2) {
    const Crossing& x = on_cut_[i];
    const Crossing& y = on_cut_[i + 1];
    std::uint32_t a = nothing, b = nothing;
    if (x.place == 0)
      a = x.corner, b = y.place == 0 ? y.corner : ray_corner(false);
    else if (y.place == 0)
      a = ray_corner(true), b = y.corner;
    else if (x.place == 1 && y.place == 2)
      a = ray_corner(true), b = ray_corner(false);
    if (a != nothing) new_edges_.push_back({cut.line, cut.plane, 1, a, b});
  }
  if (on_cut_.size() % 2 != 0) ++broken_;
  for (const Crossing& x : on_cut_)
    if (x.place == 0) crossings_.push_back(x);
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
  crossings_.clear();
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
  const std::uint32_t n = static_cast<std::uint32_t>(c_->edges.size());
  state_.assign(n, -1);
  edge_start_.assign(n + 1, 0);
  for (const Crossing& x : crossings_) ++edge_start_[x.edge + 1];
  for (std::uint32_t e = 0; e < n; ++e) edge_start_[e + 1] += edge_start_[e];
  on_edge_.resize(crossings_.size());
  for (const Crossing& x : crossings_) on_edge_[edge_start_[x.edge]++] = x;
  for (std::uint32_t e = n; e > 0; --e) edge_start_[e] = edge_start_[e - 1];
  edge_start_[0] = 0;
  next_.assign(old_corners, nothing);
  for (std::uint32_t e = 0; e < n; ++e) next_[c_->edges[e].from] = e;

  for (std::uint32_t e = 0; e < n; ++e) {
    const std::uint32_t begin = edge_start_[e], end = edge_start_[e + 1];
    if (begin == end) continue;
    const Edge edge = c_->edges[e];
    const auto side_at = [&](const Crossing& x, std::uint32_t corner) {
      return sides_[cuts_[x.cut].sides + corner];
    };
    const auto earlier = [&](const Crossing& x, const Crossing& y) {
      const Cut& cut = cuts_[y.cut];
      return side(c_->corners[x.corner], cut.plane, cut.line) == side_at(y, edge.from);
    };
    for (std::uint32_t i = begin + 1; i < end; ++i)
      for (std::uint32_t k = i; k > begin && earlier(on_edge_[k], on_edge_[k - 1]); --k)
        std::swap(on_edge_[k], on_edge_[k - 1]);
    bool inside = side_at(on_edge_[begin], edge.from) > 0;
    std::uint32_t corner = edge.from;
    for (std::uint32_t i = begin; i < end; ++i) {
      if ((side_at(on_edge_[i], edge.from) > 0) != inside) ++broken_;
      if (inside)
        new_edges_.push_back({edge.line, edge.plane, edge.orientation, corner, on_edge_[i].corner});
      inside = !inside;
      corner = on_edge_[i].corner;
    }
    if (inside) new_edges_.push_back({edge.line, edge.plane, edge.orientation, corner, edge.to});
    state_[e] = inside ? 1 : 0;  // at its end
  }
  for (std::uint32_t e = 0; e < n; ++e) {
    if (edge_start_[e] == edge_start_[e + 1]) continue;
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
