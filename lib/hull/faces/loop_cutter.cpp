// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/loop_cutter.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace polyhull::hull {
namespace {

constexpr std::uint32_t nothing = 0xffffffffu;

}  // namespace

int LoopCutter::side_exactly(const Crossing& x, std::uint32_t plane, int orientation) {
  const Edge& edge = part_->nodes[x.node].edge;
  Corner v{};
  v.plane1 = edge.plane;
  v.plane2 = cuts_[x.cut].plane;
  v.sign = static_cast<std::int8_t>(x.sign * edge.orientation);
  return chart_.side_exactly(v, plane, orientation);
}

std::uint32_t LoopCutter::following(std::uint32_t node) const {
  ++node;
  std::uint32_t begin = 0;
  for (const std::uint32_t end : part_->loop_ends) {
    if (node == end) return begin;
    begin = end;
  }
  return node;
}

/// Makes the crossing a corner of the new loops, with \p edge behind it. (Written in place: parts
/// copied out of the pipeline of stores would stall.)
void LoopCutter::append(const Crossing& x, const Edge& edge) {
  const Edge& own = part_->nodes[x.node].edge;
  const Cut& cut = cuts_[x.cut];
  Node& node = new_nodes_.emplace_back();
  node.edge = edge;
  Corner& v = node.corner;
  if (x.h > 1e-9) {
    const double inverse = 1.0 / x.h;
    v.h = 1.0, v.t = x.t * inverse, v.w = x.w * inverse;
    v.tolerance = determinant_error * inverse;
  } else {
    // Nearly parallel: a place between the edge's ends is good enough to look around from.
    const Corner &from = part_->nodes[x.node].corner, &to = part_->nodes[following(x.node)].corner;
    const double a = std::abs(value(from, cut.line)), b = std::abs(value(to, cut.line));
    const double f = a + b > 0 ? b / (a + b) : 0.5, g = 1.0 - f, h = f * from.h + g * to.h;
    const double inverse = h > 0 ? 1.0 / h : 1.0;
    v.h = 1.0, v.t = (f * from.t + g * to.t) * inverse, v.w = (f * from.w + g * to.w) * inverse;
    v.tolerance = undecided;
  }
  v.plane1 = own.plane, v.plane2 = cut.plane;
  v.sign = static_cast<std::int8_t>(x.sign * own.orientation);
  v.apex = false;
}

Corner LoopCutter::corner_at_ray(std::uint32_t ray) {
  const std::uint32_t before = cone_->previous[ray];
  return make_corner({view_.line(before), base_ + before, 1}, {view_.line(ray), base_ + ray, 1},
                     forward_ ? cone_->turn[ray] : -cone_->turn[ray]);
}

/// Crosses the cut's line with all edges.
void LoopCutter::find_crossings(std::uint32_t index) {
  const Cut& cut = cuts_[index];
  std::uint32_t before = 0, after = 0;
  Line before_line{}, after_line{};
  int begin_turn = 1, end_turn = 1;
  if (cone_ != nullptr) {
    before = cone_->previous[cut.edge];
    after = cone_->next[cut.edge];
    before_line = view_.line(before);
    after_line = view_.line(after);
    begin_turn = cone_->turn[cut.edge];
    end_turn = cone_->turn[after];
  }
  on_cut_.clear();
  const Line m = cut.line;
  const std::uint64_t* mask = masks_.data() + index * words_;
  for (std::uint32_t word = 0; word < words_; ++word) {
    // The bit of the next corner along its loop.
    std::uint64_t next = mask[word] >> 1;
    if (word + 1 < words_) next |= mask[word + 1] << 63;
    std::uint32_t begin = 0;
    for (const std::uint32_t end : part_->loop_ends) {
      if ((end - 1) >> 6 == word) {
        const std::uint64_t bit = std::uint64_t{1} << ((end - 1) & 63);
        next = (next & ~bit) | (inner(index, begin) ? bit : 0);
      }
      begin = end;
    }
    for (std::uint64_t change = mask[word] ^ next; change != 0; change &= change - 1) {
      on_cut_.push_back(static_cast<std::uint32_t>(crossings_.size()));
      Crossing& x = crossings_.emplace_back();
      x.node = word * 64 + static_cast<std::uint32_t>(std::countr_zero(change));
      x.sign = next & change & -change ? -1 : 1;
      const Line& l = part_->nodes[x.node].edge.line;
      const double s = x.sign;
      x.h = (l.b * m.d - l.d * m.b) * s;
      x.t = (l.d * m.a - l.a * m.d) * s;
      x.w = (l.a * m.b - l.b * m.a) * s;
      x.cut = index, x.later = nothing, x.piece = nothing;
      x.done = false;
      x.place = 0;
      if (cone_ != nullptr) {
        const bool first = side(x, base_ + before, before_line, 1) != begin_turn;
        const bool last = side(x, base_ + after, after_line, 1) != end_turn;
        x.place = static_cast<std::int8_t>(forward_ ? first + 2 * last : last + 2 * first);
      }
    }
  }
}

void LoopCutter::sort_along_cut() {
  if (on_cut_.size() == 2) {
    // The line enters the face where the crossed edge's line grows.
    if (crossings_[on_cut_[0]].sign < 0) std::swap(on_cut_[0], on_cut_[1]);
  } else {
    const auto earlier = [&](const Crossing& x, const Crossing& y) {
      const Edge& edge = part_->nodes[x.node].edge;
      return side(y, edge.plane, edge.line, edge.orientation) == x.sign;
    };
    for (std::size_t i = 1; i < on_cut_.size(); ++i)
      for (std::size_t k = i; k > 0 && earlier(crossings_[on_cut_[k]], crossings_[on_cut_[k - 1]]);
           --k)
        std::swap(on_cut_[k], on_cut_[k - 1]);
  }
}

/// What the cut's line holds inside the face becomes pieces, and the crossings between the cut's
/// rays are entered with their edges.
void LoopCutter::cross_edges(std::uint32_t index) {
  find_crossings(index);
  sort_along_cut();
  const auto enter = [&](std::uint32_t number) {
    Crossing& x = crossings_[number];
    if (x.place != 0) return nothing;
    x.later = first_on_edge_[x.node];
    first_on_edge_[x.node] = number;
    if (x.later != nothing && crossings_[x.later].later == nothing) crowded_.push_back(x.node);
    if (x.sign < 0) entries_.push_back(number);
    return number;
  };
  for (std::size_t i = 0; i + 1 < on_cut_.size(); i += 2) {
    Crossing &x = crossings_[on_cut_[i]], &y = crossings_[on_cut_[i + 1]];
    if (x.place != 0 && y.place != 0 && !(x.place == 1 && y.place == 2)) continue;
    const std::uint32_t number = static_cast<std::uint32_t>(pieces_.size());
    const std::uint32_t edge = cuts_[index].edge;
    if (x.place == 0)
      x.piece = number;
    else
      piece_at_ray_[forward_ ? edge : cone_->next[edge]] = number;
    const std::uint32_t from = enter(on_cut_[i]), to = enter(on_cut_[i + 1]);
    pieces_.push_back({index, from, to, false});
  }
  if (on_cut_.size() % 2 != 0) ++broken;
}

/// Brings the crossings of the node's edge into their order along it.
void LoopCutter::sort_crossings(std::uint32_t node) {
  on_edge_.clear();
  for (std::uint32_t i = first_on_edge_[node]; i != nothing; i = crossings_[i].later)
    on_edge_.push_back(i);
  const auto earlier = [&](const Crossing& x, const Crossing& y) {
    const Cut& cut = cuts_[y.cut];
    return (side(x, cut.plane, cut.line, 1) > 0) == inner(y.cut, node);
  };
  for (std::size_t i = 1; i < on_edge_.size(); ++i)
    for (std::size_t k = i; k > 0 && earlier(crossings_[on_edge_[k]], crossings_[on_edge_[k - 1]]);
         --k)
      std::swap(on_edge_[k], on_edge_[k - 1]);
  first_on_edge_[node] = on_edge_[0];
  for (std::size_t i = 0; i < on_edge_.size(); ++i)
    crossings_[on_edge_[i]].later = i + 1 < on_edge_.size() ? on_edge_[i + 1] : nothing;
}

/// Appends the pieces from \p piece on, from ray to ray, up to one that ends at a crossing or to
/// \p last; \p piece becomes that. False if one is missing.
bool LoopCutter::follow_pieces(std::uint32_t& piece, std::uint32_t last) {
  for (;;) {
    Piece& now = pieces_[piece];
    if (now.done) return false;
    now.done = true;
    if (now.to != nothing) return last == nothing;
    const std::uint32_t edge = cuts_[now.cut].edge;
    const std::uint32_t ray = forward_ ? cone_->next[edge] : edge;
    piece = piece_at_ray_[ray];
    if (piece >= pieces_.size() || pieces_[piece].from != nothing) return false;
    const Cut& cut = cuts_[pieces_[piece].cut];
    if ((forward_ ? cut.edge : cone_->next[cut.edge]) != ray) return false;
    new_nodes_.push_back({corner_at_ray(ray), {cut.line, cut.plane, 1}});
    if (piece == last) return true;
  }
}

/// Appends the new loop that enters the cone at the crossing. False if it does not close.
bool LoopCutter::follow(std::uint32_t first) {
  for (std::uint32_t at = first;;) {
    Crossing& in = crossings_[at];
    if (in.done) return false;
    in.done = true;
    append(in, part_->nodes[in.node].edge);
    std::uint32_t out = in.later;
    for (std::uint32_t node = in.node; out == nothing; out = first_on_edge_[node]) {
      node = following(node);
      new_nodes_.push_back(part_->nodes[node]);
    }
    std::uint32_t piece = crossings_[out].piece;
    if (piece == nothing) return false;
    const Cut& cut = cuts_[pieces_[piece].cut];
    append(crossings_[out], {cut.line, cut.plane, 1});
    if (!follow_pieces(piece, nothing)) return false;
    at = pieces_[piece].to;
    if (at == first) return true;
  }
}

/// Of a loop that crosses no face of the cone: any of its corners tells, best one known well.
bool LoopCutter::loop_inside(std::uint32_t begin, std::uint32_t end) {
  if (cone_ == nullptr) return inner(0, begin);
  std::uint32_t best = begin;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Corner &v = part_->nodes[i].corner, &b = part_->nodes[best].corner;
    if (!v.apex && (b.apex || v.tolerance < b.tolerance)) best = i;
  }
  return view_.inside(part_->nodes[best]);
}

/// Whether, seen from the solid's side of the face, the cone's edges run as the chart's do.
bool LoopCutter::runs_forward() const {
  double x;
  if (chart_.cone >= 0) {
    const Cone& own = *chart_.problem->cones[chart_.cone];
    x = glm::dot(own.normals[chart_.local], cone_->centre_real - own.centre_real) * chart_.unit;
  } else {
    const int k = static_cast<int>(chart_.face - chart_.problem->cone_faces());
    x = (cone_->centre_real[k / 2] - chart_.problem->box[k]) * chart_.unit * chart_.handed;
  }
  if (!(std::abs(x) > 1e-14))
    x = chart_.problem->set.side_of_point(chart_.face, cone_->centre[0], cone_->centre[1],
                                          cone_->centre[2]);
  return (x > 0 ? 1 : -1) * chart_.handed < 0;
}

void LoopCutter::begin_cuts(Part& part, bool by_cone) {
  part_ = &part;
  cone_ = by_cone ? &view_.cone() : nullptr;
  base_ = view_.base();
  changed_ = false;
  words_ = (part_->nodes.size() + 63) / 64;
  cuts_.clear();
  masks_.clear();
  const std::size_t n = part_->nodes.size();
  packed_.resize((n + 1) / 2);
  for (std::size_t i = 0; i < n; i += 2) {
    const Corner &v = part_->nodes[i].corner, &u = part_->nodes[i + 1 < n ? i + 1 : i].corner;
    packed_[i / 2] = {Pair{v.h, u.h}, Pair{v.t, u.t}, Pair{v.w, u.w},
                      Pair{v.tolerance, u.tolerance}};
  }
}

void LoopCutter::add_cut(const Line& line, std::uint32_t edge, std::uint32_t plane) {
  const Node* nodes = part_->nodes.data();
  const std::size_t n = part_->nodes.size(), begin = masks_.size();
  const Line l = line;
  bool any = false, all = true;
  for (std::size_t first = 0; first < n; first += 64) {
    const std::size_t count = std::min<std::size_t>(64, n - first);
    std::uint64_t above = 0, sure = 0;
    const CornerPair* corners = packed_.data() + first / 2;
    for (std::size_t i = 0; i < count; i += 2, ++corners) {
      const Pair x = l.a * corners->h + l.b * corners->t + l.d * corners->w;
      above |= static_cast<std::uint64_t>(bits(x > 0.0)) << i;
      sure |= static_cast<std::uint64_t>(bits(absolute(x) > corners->tolerance)) << i;
    }
    const std::uint64_t full = ~std::uint64_t{0} >> (64 - count);
    above &= full;
    for (std::uint64_t rest = full & ~sure; rest != 0; rest &= rest - 1) {
      const std::uint64_t bit = rest & -rest;
      const bool positive =
          chart_.side_exactly(nodes[first + std::countr_zero(rest)].corner, plane, 1) > 0;
      above = positive ? above | bit : above & ~bit;
    }
    any = any || above != 0;
    all = all && above == full;
    masks_.push_back(above);
  }
  chart_.predicates += n;
  if (any && !all)
    cuts_.push_back({l, edge, plane});
  else
    masks_.resize(begin);
}

bool LoopCutter::apply() {
  const std::uint32_t n = static_cast<std::uint32_t>(part_->nodes.size());
  crossings_.clear(), pieces_.clear(), entries_.clear(), crowded_.clear();
  first_on_edge_.assign(n, nothing);
  if (!cuts_.empty()) {
    forward_ = cone_ == nullptr || runs_forward();
    for (std::uint32_t i = 0; i < cuts_.size(); ++i) cross_edges(i);
  }
  if (pieces_.empty() && part_->loop_ends.size() == 1) return loop_inside(0, n);
  for (const std::uint32_t node : crowded_) sort_crossings(node);

  new_nodes_.clear(), new_loop_ends_.clear();
  const auto close = [&](bool good) {
    const std::size_t begin = new_loop_ends_.empty() ? 0 : new_loop_ends_.back();
    if (good) {
      new_loop_ends_.push_back(static_cast<std::uint32_t>(new_nodes_.size()));
    } else {
      ++broken;
      new_nodes_.resize(begin);
    }
  };
  for (const std::uint32_t entry : entries_)
    if (!crossings_[entry].done) close(follow(entry));
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
    // Rings of the cone inside the face.
    if (pieces_[i].done || pieces_[i].from != nothing) continue;
    std::uint32_t piece = i;
    close(follow_pieces(piece, i));
  }
  std::uint32_t begin = 0;
  const bool crossed_any = !pieces_.empty();
  bool changed = crossed_any;
  for (const std::uint32_t end : part_->loop_ends) {
    bool crossed = false;
    if (crossed_any)
      for (std::uint32_t i = begin; i < end && !crossed; ++i)
        crossed = first_on_edge_[i] != nothing;
    if (!crossed && loop_inside(begin, end)) {
      new_nodes_.insert(new_nodes_.end(), part_->nodes.begin() + begin, part_->nodes.begin() + end);
      close(true);
    } else {
      changed = true;
    }
    begin = end;
  }
  if (!changed) return true;
  changed_ = true;
  part_->nodes.swap(new_nodes_);
  part_->loop_ends.swap(new_loop_ends_);
  return !part_->nodes.empty();
}

}  // namespace polyhull::hull
