// SPDX-License-Identifier: LGPL-2.1-or-later
// The second half of FaceClipper: cutting the loops by one cone's edges.
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
    before_line = line_of(cone->normals[before], p);
    after_line = line_of(cone->normals[after], p);
  }
  for (std::uint32_t e = 0; e < edges_.size(); ++e) {
    const Edge edge = edges_[e];
    if (sides[edge.from] == sides[edge.to]) continue;
    const Corner from = corners_[edge.from], to = corners_[edge.to];
    const std::uint32_t corner =
        make_corner(edge.line, cut.line, edge.plane, cut.plane, -sides[edge.to], edge.orientation,
                    &from, &to, value(from, cut.line), value(to, cut.line));
    std::int8_t place = 0;
    if (cone != nullptr) {
      const Corner& x = corners_[corner];
      if (side(x, base + before, before_line) != cone->turn[begin_ray]) place |= forward ? 1 : 2;
      if (side(x, base + after, after_line) != cone->turn[end_ray]) place |= forward ? 2 : 1;
    }
    on_cut_.push_back({e, corner, index, place});
  }
  // Along the line's own direction. It enters the face where the crossed edge's line grows.
  const auto earlier = [&](const Crossing& x, const Crossing& y) {
    const Edge& edge = edges_[x.edge];
    const int growth = -sides[edge.to];
    return side(corners_[y.corner], edge.plane, edge.line, edge.orientation) == growth;
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

bool FaceClipper::apply_cuts(const Cone* cone, std::uint32_t cone_index, const Picture& p) {
  const std::uint32_t old_corners = static_cast<std::uint32_t>(corners_.size());
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
      if (cone_ >= 0) {
        const Cone& own = *scene_->cones[cone_];
        x = glm::dot(own.normals[local_], cone->centre_real - own.centre_real) * unit_;
      } else {
        const int k = static_cast<int>(face_ - scene_->cone_faces());
        x = (cone->centre_real[k / 2] - scene_->box[k]) * unit_ * handed_;
      }
      if (std::abs(x) > 1e-14)
        above = x > 0 ? 1 : -1;
      else
        above = scene_->set.side_of_point(face_, cone->centre[0], cone->centre[1], cone->centre[2]);
      forward = above * handed_ < 0;
    }
    for (std::uint32_t i = 0; i < cuts_.size(); ++i) cross(i, cone, base, p, forward);
  }

  // What of each old edge stays. States: -1 unknown, 0 outside, 1 inside.
  const std::uint32_t n = static_cast<std::uint32_t>(edges_.size());
  state_.assign(n, -1);
  edge_start_.assign(n + 1, 0);
  for (const Crossing& x : crossings_) ++edge_start_[x.edge + 1];
  for (std::uint32_t e = 0; e < n; ++e) edge_start_[e + 1] += edge_start_[e];
  on_edge_.resize(crossings_.size());
  for (const Crossing& x : crossings_) on_edge_[edge_start_[x.edge]++] = x;
  for (std::uint32_t e = n; e > 0; --e) edge_start_[e] = edge_start_[e - 1];
  edge_start_[0] = 0;
  next_.assign(old_corners, nothing);
  for (std::uint32_t e = 0; e < n; ++e) next_[edges_[e].from] = e;

  for (std::uint32_t e = 0; e < n; ++e) {
    const std::uint32_t begin = edge_start_[e], end = edge_start_[e + 1];
    if (begin == end) continue;
    const Edge edge = edges_[e];
    const auto side_at = [&](const Crossing& x, std::uint32_t corner) {
      return sides_[cuts_[x.cut].sides + corner];
    };
    const auto earlier = [&](const Crossing& x, const Crossing& y) {
      const Cut& cut = cuts_[y.cut];
      return side(corners_[x.corner], cut.plane, cut.line) == side_at(y, edge.from);
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
    for (std::uint32_t k = next_[edges_[e].to]; k != nothing && state_[k] < 0;
         k = next_[edges_[k].to]) {
      state_[k] = state_[e];
      if (state_[k] == 1) new_edges_.push_back(edges_[k]);
    }
  }
  for (std::uint32_t e = 0; e < n; ++e) {
    if (state_[e] >= 0) continue;
    bool inside;
    if (cone != nullptr) {
      inside = inside_cone(e, cone_index, p);
    } else {
      inside = !cuts_.empty() && sides_[cuts_[0].sides + edges_[e].from] > 0;
    }
    for (std::uint32_t k = e; k != nothing && state_[k] < 0; k = next_[edges_[k].to]) {
      state_[k] = inside;
      if (inside) new_edges_.push_back(edges_[k]);
    }
  }
  edges_.swap(new_edges_);

  // Only the corners that are still in use.
  remap_.assign(corners_.size(), nothing);
  new_corners_.clear();
  for (Edge& e : edges_)
    for (std::uint32_t* v : {&e.from, &e.to}) {
      if (remap_[*v] == nothing) {
        remap_[*v] = static_cast<std::uint32_t>(new_corners_.size());
        new_corners_.push_back(corners_[*v]);
      }
      *v = remap_[*v];
    }
  corners_.swap(new_corners_);
  return !edges_.empty();
}

/// Whether the loop of \p edge, which crosses no face of the cone, lies inside it.
bool FaceClipper::inside_cone(std::uint32_t edge, std::uint32_t cone_index, const Picture& p) {
  const Cone& cone = *scene_->cones[cone_index];
  const Mat3& m = cone.camera.to_pixel;
  while (corners_[edges_[edge].from].apex) edge = next_[edges_[edge].to];
  const Corner& v = corners_[edges_[edge].from];
  if (v.tolerance < 1e-3) {
    const Vec3 d = v.h * p.a + v.t * p.b + v.w * p.d;
    const Vec3 q = m * d;
    const double size = std::abs(m[0][2] * d.x) + std::abs(m[1][2] * d.y) + std::abs(m[2][2] * d.z);
    if (q.z < -1e-3 * size) return cone.complement;
    if (q.z > 1e-3 * size && v.tolerance < 1e-7) {
      const Vec2 x = Vec2(q) / q.z;
      const ContourGrid& grid = cone.grid;
      int c0, c1, r0, r1;
      grid.column_range(x.x, x.x, c0, c1);
      grid.row_range(x.y, x.y, r0, r1);
      if (c0 > c1 || r0 > r1) return cone.complement;
      if (grid.state(c0, r0) != CellState::unknown) {
        // Count the edges between here and the middle of the cell.
        const Vec2 middle = grid.centre(c0, r0), away = middle - x;
        bool inside = grid.state(c0, r0) == CellState::inside, sure = true;
        const auto cross2 = [](const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; };
        const double tiny = 1e-4;
        const double way = glm::length(away);
        for (std::uint32_t e : grid.edges(c0, r0)) {
          const Vec2 a = cone.pixels[e], b = cone.pixels[cone.next[e]];
          const double length = glm::length(b - a);
          const double s0 = cross2(b - a, x - a), s1 = cross2(b - a, middle - a);
          const double t0 = cross2(away, a - x), t1 = cross2(away, b - x);
          const bool apart = (s0 > tiny * length && s1 > tiny * length) ||
                             (s0 < -tiny * length && s1 < -tiny * length) ||
                             (t0 > tiny * way && t1 > tiny * way) ||
                             (t0 < -tiny * way && t1 < -tiny * way);
          if (apart) continue;
          if (std::abs(s0) < tiny * length || std::abs(s1) < tiny * length ||
              std::abs(t0) < tiny * way || std::abs(t1) < tiny * way) {
            sure = false;
            break;
          }
          inside = !inside;
        }
        if (sure) return inside != cone.complement;
      }
    }
  }
  return inside_cone_exact(edge, cone_index, p);
}

/// The same from all edges of the cone: along the edge's line from its first corner to infinity,
/// that end which is behind the cone's centre and so outside, count the faces on the way.
bool FaceClipper::inside_cone_exact(std::uint32_t edge, std::uint32_t cone_index,
                                    const Picture& p) {
  const Scene& s = *scene_;
  const Cone& cone = *s.cones[cone_index];
  const std::uint32_t base = s.first_face[cone_index];
  const Edge e = edges_[edge];
  const Corner from = corners_[e.from];
  // The line's point at infinity: the plane at infinity is w = 0 in a cone's chart, h = 0 in a
  // box's.
  const Line infinite = cone_ >= 0 ? Line{0, 0, 1} : Line{1, 0, 0};
  Corner to{};
  to.h = e.line.b * infinite.d - e.line.d * infinite.b;
  to.t = e.line.d * infinite.a - e.line.a * infinite.d;
  to.w = e.line.a * infinite.b - e.line.b * infinite.a;
  to.tolerance = 4 * determinant_error;
  const Vec3 direction = to.h * p.a + to.t * p.b + to.w * p.d;
  int sign = glm::dot(cone.camera.forward, direction) > 0 ? -1 : 1;
  to.h *= sign, to.t *= sign, to.w *= sign;
  to.plane1 = e.plane;
  to.plane2 = s.infinity();
  to.sign = static_cast<std::int8_t>(sign * e.orientation);
  to.apex = false;
  bool inside = cone.complement;
  for (std::uint32_t k = 0; k < cone.size(); ++k) {
    const Line line = line_of(cone.normals[k], p);
    const int s0 = side(from, base + k, line), s1 = side(to, base + k, line);
    if (s0 == s1) continue;
    const std::uint32_t before = cone.previous[k], after = cone.next[k];
    Corner x{};
    x.plane1 = e.plane, x.plane2 = base + k;
    x.apex = false;
    const double a = std::abs(value(from, line)), b = std::abs(value(to, line));
    x.h = b * from.h + a * to.h, x.t = b * from.t + a * to.t, x.w = b * from.w + a * to.w;
    x.tolerance = undecided;
    // to = sign (e x infinity) and k's line has the sign s1 there, so det(e, k, infinity) has the
    // sign of -s1 sign; x = s (e x k) is on infinity's positive side.
    x.sign = static_cast<std::int8_t>(-s1 * sign * e.orientation);
    if (side(x, base + before, line_of(cone.normals[before], p)) == cone.turn[k] &&
        side(x, base + after, line_of(cone.normals[after], p)) == cone.turn[after])
      inside = !inside;
  }
  return inside;
}

void FaceClipper::emit(FaceLoops& out) {
  const std::uint32_t n = static_cast<std::uint32_t>(edges_.size());
  next_.assign(corners_.size(), nothing);
  for (std::uint32_t e = 0; e < n; ++e) next_[edges_[e].from] = e;
  state_.assign(n, 0);
  // A cone's chart and the lower faces of the box are seen from inside, so their loops turn around.
  const bool reverse = cone_ >= 0 || handed_ > 0;
  bool any = false;
  for (std::uint32_t e = 0; e < n; ++e) {
    if (state_[e] != 0) continue;
    const std::size_t begin = out.corners.size();
    for (std::uint32_t k = e; k != nothing && state_[k] == 0; k = next_[edges_[k].to]) {
      state_[k] = 1;
      const Corner& v = corners_[edges_[k].from];
      CornerKey key;
      if (v.apex) {
        key = {static_cast<std::uint32_t>(cone_), scene_->cones[cone_]->ring[local_], apex_mark};
        if (out.corners.size() > begin && out.corners.back() == key) continue;
      } else {
        key = {face_, v.plane1, v.plane2};
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
    out.faces.push_back(face_);
    out.face_ends.push_back(static_cast<std::uint32_t>(out.loop_ends.size()));
  }
}

}  // namespace polyhull::hull
