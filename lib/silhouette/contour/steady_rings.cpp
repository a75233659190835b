// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/steady_rings.h"

#include <algorithm>
#include <cmath>

namespace polyhull::silhouette {
namespace {

/// Traced corners lie a pixel apart: more than this many of one line beside one edge of the other
/// are another line.
constexpr int look_ahead = 8;

/// Where the lines are apart ours is looked for beside every so manyth corner.
constexpr std::size_t look_every = 4;

constexpr float longest_edge = 2.0f;  // px, of those that find() looks for

float square_to_segment(Vec2f p, Vec2f a, Vec2f b) {
  const Vec2f along = b - a, from = p - a;
  const float length = glm::dot(along, along);
  const float t = length > 0.0f ? std::clamp(glm::dot(from, along) / length, 0.0f, 1.0f) : 0.0f;
  const Vec2f off = from - t * along;
  return glm::dot(off, off);
}

int row_of(Vec2f p) {
  return static_cast<int>(std::floor(p.y));
}

std::uint32_t begin_of(const Rings& rings, std::uint32_t ring) {
  return ring == 0 ? 0 : rings.ends[ring - 1];
}

/// Adds \p p to the ring that began at \p begin, unless it ends there already; its index.
std::uint32_t add(Rings& out, std::size_t begin, Vec2f p) {
  if (out.points.size() == begin || out.points.back() != p) out.points.push_back(p);
  return static_cast<std::uint32_t>(out.points.size() - 1);
}

}  // namespace

void SteadyRings::assign(const Rings& rings, std::span<const RingNode> nodes) {
  const std::size_t room = rings.points.capacity();  // so that few frames need more
  rings_.points.reserve(room);
  nodes_.reserve(room);
  first_node_.reserve(room + 1);
  by_row_.reserve(room);
  ring_of_.reserve(room);
  rings_ = rings;
  nodes_.assign(nodes.begin(), nodes.end());
  const auto count = static_cast<std::uint32_t>(rings.points.size());
  first_node_.resize(count + 1);
  std::uint32_t before = 0;
  for (std::uint32_t p = 0; p <= count; ++p) {
    first_node_[p] = before;
    if (before < nodes_.size() && nodes_[before].point == p) ++before;
  }
  ring_of_.resize(count);
  for (std::uint32_t ring = 0; ring < rings.size(); ++ring)
    std::fill(ring_of_.begin() + begin_of(rings, ring), ring_of_.begin() + rings.ends[ring], ring);
  int highest = lowest_ = 0;
  for (std::uint32_t p = 0; p < count; ++p) {
    const int row = row_of(rings.points[p]);
    lowest_ = p == 0 ? row : std::min(lowest_, row);
    highest = p == 0 ? row : std::max(highest, row);
  }
  row_begins_.assign(static_cast<std::size_t>(highest - lowest_) + 2, 0);
  const auto row_number = [&](std::uint32_t p) {
    return static_cast<std::size_t>(row_of(rings_.points[p]) - lowest_);
  };
  for (std::uint32_t p = 0; p < count; ++p) ++row_begins_[row_number(p) + 1];
  for (std::size_t i = 1; i < row_begins_.size(); ++i) row_begins_[i] += row_begins_[i - 1];
  by_row_.resize(count);
  for (std::uint32_t p = count; p-- > 0;) by_row_[--row_begins_[row_number(p) + 1]] = p;
  row_begins_.erase(row_begins_.begin());
  row_begins_.push_back(count);
}

// The nearest of our edges that goes the way of the edge from `from` to `to`.
bool SteadyRings::find(Vec2f from, Vec2f to, Place& place) const {
  const int rows = static_cast<int>(row_begins_.size()) - 1;
  const int reach = static_cast<int>(std::ceil(longest_edge));
  const int low = std::max(row_of(from) - reach - lowest_, 0);
  const int high = std::min(row_of(from) + reach - lowest_, rows - 1);
  float least = limit_;
  bool found = false;
  for (std::uint32_t i = low <= high ? row_begins_[low] : 0;
       low <= high && i < row_begins_[high + 1]; ++i) {
    const std::uint32_t p = by_row_[i];
    const Vec2f a = rings_.points[p];
    if (std::abs(a.x - from.x) > longest_edge) continue;
    const std::uint32_t ring = ring_of_[p], begin = begin_of(rings_, ring);
    const Vec2f b = rings_.points[p + 1 < rings_.ends[ring] ? p + 1 : begin];
    const float square = square_to_segment(from, a, b);
    if (square > least || glm::dot(b - a, to - from) <= 0.0f) continue;
    least = square;
    place = {ring, p - begin};
    found = true;
  }
  return found;
}

// Goes on with `place` beside the edge from `from` to `to`; false: there is no way.
bool SteadyRings::step(Vec2f from, Vec2f to, Place& place) const {
  const std::span<const Vec2f> ours = rings_.ring(place.ring);
  const auto at = [&](std::uint32_t edge) { return ours[edge % ours.size()]; };
  for (int steps = 0;; ++steps) {
    if (square_to_segment(to, at(place.edge), at(place.edge + 1)) <= limit_) return true;
    if (steps == look_ahead) return false;
    ++place.edge;
    if (square_to_segment(at(place.edge), from, to) > limit_) return false;
  }
}

// As far as the way goes from corner `first`, to corner `most` at the farthest; corners are counted
// from `start`.
SteadyRings::Stretch SteadyRings::walk(std::span<const Vec2f> ring, std::size_t start,
                                       std::size_t first, std::size_t most, Place place) const {
  Stretch stretch{first, first, place, place.edge};
  const std::size_t once_around = place.edge + rings_.ring(place.ring).size();
  while (stretch.last < most) {
    const Vec2f from = ring[(start + stretch.last) % ring.size()];
    const Vec2f to = ring[(start + stretch.last + 1) % ring.size()];
    if (!step(from, to, place) || place.edge > once_around) break;
    ++stretch.last;
    stretch.end = place.edge;
  }
  return stretch;
}

// Whether a walk from corner 0 has gone once around both rings.
bool SteadyRings::is_whole(std::span<const Vec2f> ring, const Stretch& stretch) const {
  if (stretch.last != ring.size()) return false;
  const std::span<const Vec2f> ours = rings_.ring(stretch.begin.ring);
  const std::size_t around = stretch.begin.edge + ours.size();
  for (std::size_t corner = stretch.end + 1; corner <= around; ++corner)
    if (square_to_segment(ours[corner % ours.size()], ring.back(), ring[0]) > limit_) return false;
  return true;
}

// How many nodes lie at corners begin.edge + 1 to end.
std::uint32_t SteadyRings::nodes_in(const Stretch& stretch) const {
  const std::uint32_t begin = begin_of(rings_, stretch.begin.ring);
  const auto size = static_cast<std::uint32_t>(rings_.ring(stretch.begin.ring).size());
  const auto before = [&](std::uint32_t corner) {
    const std::uint32_t all = first_node_[begin + size] - first_node_[begin];
    return corner / size * all + first_node_[begin + corner % size] - first_node_[begin];
  };
  return before(stretch.end + 1) - before(stretch.begin.edge + 1);
}

// Corners [begin, end) of our ring `ring`, with their nodes.
void SteadyRings::take(std::uint32_t ring, std::uint32_t begin, std::uint32_t end, Made& made,
                       Rings& out, std::vector<RingNode>& kept) const {
  const std::span<const Vec2f> ours = rings_.ring(ring);
  for (std::uint32_t corner = begin; corner < end; ++corner) {
    const auto i = static_cast<std::uint32_t>(corner % ours.size());
    const std::uint32_t point = begin_of(rings_, ring) + i;
    const std::uint32_t at = add(out, made.begin, ours[i]);
    if (first_node_[point + 1] == first_node_[point]) continue;
    if (kept.size() > made.node_begin && kept.back().point == at) continue;
    if (point < made.least_point) made.least_point = point, made.least_node = kept.size();
    kept.push_back({at, nodes_[first_node_[point]].vertex});
  }
}

void SteadyRings::splice_ring(std::span<const Vec2f> ring, Rings& out,
                              std::vector<RingNode>& kept) {
  const std::size_t n = ring.size();
  Made made{out.points.size(), kept.size(), ~0u, 0};
  Place place;
  std::size_t start = 0;
  if (n >= 3 && find(ring[0], ring[1], place)) {
    const Stretch stretch = walk(ring, 0, 0, n, place);
    if (is_whole(ring, stretch))
      return take(place.ring, 0, static_cast<std::uint32_t>(rings_.ring(place.ring).size()), made,
                  out, kept);
    start = (stretch.last + 1) % n;  // so that no stretch reaches across it
  }
  std::size_t stays = 0;
  for (std::size_t i = 0; i < n;) {
    const Vec2f from = ring[(start + i) % n], to = ring[(start + i + 1) % n];
    Stretch stretch{i, std::min(i + look_every, n) - 1, {}, 0};
    const bool found = n >= 3 && find(from, to, place);
    if (found) stretch = walk(ring, start, i, n - 1, place);
    if (found && nodes_in(stretch) >= 2) {
      add(out, made.begin, from);
      take(place.ring, stretch.begin.edge + 1, stretch.end + 1, made, out, kept);
      kept.back().run = false;
      stays += stretch.last - stretch.first;
      add(out, made.begin, ring[(start + stretch.last) % n]);
    } else {
      for (std::size_t k = i; k <= stretch.last; ++k) add(out, made.begin, ring[(start + k) % n]);
    }
    i = stretch.last + 1;
  }
  if (kept.size() == made.node_begin) return;
  if (2 * stays < n) {  // pieces of old polygons would only cost corners
    out.points.resize(made.begin);
    kept.resize(made.node_begin);
    out.points.insert(out.points.end(), ring.begin(), ring.end());
    return;
  }
  // The ring shall begin where ours did, so that what stays keeps its order.
  const auto shift = kept[made.least_node].point - static_cast<std::uint32_t>(made.begin);
  const auto first = out.points.begin() + static_cast<std::ptrdiff_t>(made.begin);
  std::rotate(first, first + shift, out.points.end());
  const auto first_node = kept.begin() + static_cast<std::ptrdiff_t>(made.node_begin);
  std::rotate(first_node, kept.begin() + static_cast<std::ptrdiff_t>(made.least_node), kept.end());
  const auto size = static_cast<std::uint32_t>(out.points.size() - made.begin);
  for (auto node = first_node; node != kept.end(); ++node)
    node->point = static_cast<std::uint32_t>(made.begin) +
                  (node->point - static_cast<std::uint32_t>(made.begin) + size - shift) % size;
}

void SteadyRings::splice(const Rings& traced, float distance, Rings& out,
                         std::vector<RingNode>& kept) {
  limit_ = distance * distance;
  out.clear();
  out.points.reserve(2 * traced.points.capacity());
  kept.clear();
  kept.reserve(traced.points.capacity());
  for (std::size_t i = 0; i < traced.size(); ++i) {
    splice_ring(traced.ring(i), out, kept);
    out.ends.push_back(static_cast<std::uint32_t>(out.points.size()));
  }
}

}  // namespace polyhull::silhouette
