// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/approximate.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "silhouette/contour/crossings.h"
#include "silhouette/contour/ring_fit.h"
#include "silhouette/contour/trace.h"

namespace polyhull {

struct Approximator::State {
  ApproximateCounts counts;
  std::vector<double> areas;
  std::vector<std::int32_t> found_parents;
  std::vector<std::uint8_t> kept;
  std::vector<std::uint32_t> order;       // outer rings by area
  std::vector<std::uint32_t> list;        // rings that are approximated
  std::vector<silhouette::RingFit> fits;  // fits[i] for list[i]; more than needed are kept
  silhouette::FitMemory memory;
  std::vector<silhouette::CheckedEdge> edges;
  silhouette::EdgeBands bands;
  std::vector<RingNode> nodes;  // of the rings made
  bool clean = true;            // no edges meet

  void choose(const Rings& traced, std::span<const std::int32_t> parents,
              const ApproximateSettings& settings);
  void drop_inside_dropped(std::span<const std::int32_t> parents);
  bool mend(const Rings& traced, std::span<const std::int32_t> parents, double tolerance);
  void fit(const Rings& traced, std::span<const std::int32_t> parents,
           const ApproximateSettings& settings, std::span<const RingNode> kept_nodes, Rings& rings);
  void copy(const Rings& traced, std::span<const std::int32_t> parents,
            const ApproximateSettings& settings, Rings& rings);
};

Approximator::Approximator() : state_(std::make_unique<State>()) {}
Approximator::~Approximator() = default;
Approximator::Approximator(Approximator&&) noexcept = default;
Approximator& Approximator::operator=(Approximator&&) noexcept = default;

const ApproximateCounts& Approximator::counts() const {
  return state_->counts;
}

std::span<const RingNode> Approximator::nodes() const {
  return state_->nodes;
}

namespace {

bool inside_ring(std::span<const Vec2f> ring, Vec2f p) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vec2f a = ring[j], b = ring[i];
    if ((a.y <= p.y) == (b.y <= p.y)) continue;
    const double x = a.x + (static_cast<double>(p.y) - a.y) / (static_cast<double>(b.y) - a.y) *
                               (static_cast<double>(b.x) - a.x);
    if (x > p.x) inside = !inside;
  }
  return inside;
}

// The smallest ring around each, for callers without a tracer's answer.
void find_parents(const Rings& rings, const std::vector<double>& areas,
                  std::vector<std::int32_t>& parents) {
  parents.assign(rings.size(), -1);
  struct Box {
    Vec2f low, high;
  };
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    Box box{{1e9f, 1e9f}, {-1e9f, -1e9f}};
    for (const Vec2f p : rings.ring(i)) {
      box.low = glm::min(box.low, p);
      box.high = glm::max(box.high, p);
    }
    boxes.push_back(box);
  }
  for (std::size_t i = 0; i < rings.size(); ++i)
    for (std::size_t j = 0; j < rings.size(); ++j) {
      if (i == j || rings.ring(i).empty() || std::abs(areas[j]) <= std::abs(areas[i])) continue;
      const Vec2f p = rings.ring(i)[0];
      if (p.x < boxes[j].low.x || p.x > boxes[j].high.x || p.y < boxes[j].low.y ||
          p.y > boxes[j].high.y)
        continue;
      if (parents[i] >= 0 && std::abs(areas[parents[i]]) <= std::abs(areas[j])) continue;
      if (inside_ring(rings.ring(j), p)) parents[i] = static_cast<std::int32_t>(j);
    }
}

void check(const ApproximateSettings& s) {
  const auto require = [](bool good, const char* name, double value, const char* expected) {
    if (!good)
      throw Error(Error::Kind::bad_input, "The contours' {} is {:g}; give {}.", name, value,
                  expected);
  };
  require(s.tolerance >= 0.0 && s.tolerance <= 100.0, "tolerance", s.tolerance, "0 to 100 px");
  require(s.min_edges >= 3 && s.min_edges <= 1000, "min-edges", s.min_edges, "3 to 1000");
  require(s.min_area >= 0.0, "min-area", s.min_area, "0 px² or more");
  require(s.min_hole_area >= 0.0, "min-hole-area", s.min_hole_area, "0 px² or more");
  require(s.keep_largest >= 0, "keep-largest", s.keep_largest, "0 or more");
}

}  // namespace

// By area; a ring goes with what is around it.
void Approximator::State::choose(const Rings& traced, std::span<const std::int32_t> parents,
                                 const ApproximateSettings& settings) {
  kept.assign(traced.size(), 1);
  order.clear();
  for (std::size_t i = 0; i < traced.size(); ++i) {
    const bool hole = areas[i] < 0.0;
    if (std::abs(areas[i]) < (hole ? settings.min_hole_area : settings.min_area) ||
        traced.ring(i).size() < 3)
      kept[i] = 0;
    if (!hole && kept[i]) order.push_back(static_cast<std::uint32_t>(i));
  }
  const auto most = static_cast<std::size_t>(settings.keep_largest);
  if (most > 0 && order.size() > most) {
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return areas[a] != areas[b] ? areas[a] > areas[b] : a < b;
    });
    for (std::size_t i = most; i < order.size(); ++i) kept[order[i]] = 0;
  }
  drop_inside_dropped(parents);
}

void Approximator::State::drop_inside_dropped(std::span<const std::int32_t> parents) {
  for (std::size_t i = 0; i < kept.size(); ++i)
    for (std::int32_t p = parents[i]; kept[i] && p >= 0; p = parents[p])
      if (!kept[p]) kept[i] = 0;
}

// Refines where edges meet, rings have turned over or have come to lie on the wrong side of
// another. True when nothing was found, or nothing more can be done.
bool Approximator::State::mend(const Rings& traced, std::span<const std::int32_t> parents,
                               double tolerance) {
  edges.clear();
  const auto unit = [](float v) {
    return static_cast<std::int32_t>(std::lround(v * silhouette::vertex_unit));
  };
  clean = true;
  for (std::uint32_t i = 0; i < list.size(); ++i) {
    const auto& nodes = fits[i].nodes();
    fits[i].marked.assign(nodes.size(), 0);
    double area = 0.0;
    for (std::uint32_t r = 0; r < nodes.size(); ++r) {
      const Vec2f a = nodes[r].vertex, b = nodes[r + 1 < nodes.size() ? r + 1 : 0].vertex;
      edges.push_back({unit(a.x), unit(a.y), unit(b.x), unit(b.y), i, r});
      area += static_cast<double>(b.x) * a.y - static_cast<double>(a.x) * b.y;
    }
    if ((area > 0.0) != (areas[list[i]] > 0.0) || area == 0.0) {
      std::fill(fits[i].marked.begin(), fits[i].marked.end(), 1);
      clean = false;
    }
  }
  bands.build(edges);
  bands.find_crossings([&](const silhouette::CheckedEdge& e, const silhouette::CheckedEdge& f) {
    fits[e.ring].marked[e.run] = 1;
    fits[f.ring].marked[f.run] = 1;
    ++counts.crossings;
    clean = false;
  });
  if (clean) {
    // Without crossings a ring lies on one side of another as a whole.
    const auto reach = static_cast<std::int32_t>(2.0 * tolerance * silhouette::vertex_unit);
    for (std::uint32_t i = 0; i < list.size(); ++i) {
      bool odd = false;
      for (std::int32_t p = parents[list[i]]; p >= 0; p = parents[p]) odd = !odd;
      const Vec2f at = fits[i].nodes()[0].vertex;
      const std::int32_t x = unit(at.x), y = unit(at.y);
      if ((bands.crossings_right_of(x, y, i) % 2 != 0) == odd) continue;
      clean = false;
      std::fill(fits[i].marked.begin(), fits[i].marked.end(), 1);
      for (const auto& e : edges)
        if (std::min(e.ax, e.bx) - reach <= x && x <= std::max(e.ax, e.bx) + reach &&
            std::min(e.ay, e.by) - reach <= y && y <= std::max(e.ay, e.by) + reach)
          fits[e.ring].marked[e.run] = 1;
    }
  }
  if (clean) return true;
  // Where nothing can be refined any more, the traced rings themselves meet.
  bool progress = false;
  for (std::uint32_t i = 0; i < list.size(); ++i)
    if (std::find(fits[i].marked.begin(), fits[i].marked.end(), 1) != fits[i].marked.end())
      progress |= fits[i].refine_marked();
  return !progress;
}

// The chosen rings as polygons.
void Approximator::State::fit(const Rings& traced, std::span<const std::int32_t> parents,
                              const ApproximateSettings& settings,
                              std::span<const RingNode> kept_nodes, Rings& rings) {
  list.clear();
  for (std::uint32_t i = 0; i < traced.size(); ++i)
    if (kept[i]) list.push_back(i);
  if (fits.size() < list.size()) fits.resize(list.size());
  const auto begin_of = [&](std::uint32_t ring) { return ring == 0 ? 0 : traced.ends[ring - 1]; };
  const auto before = [](const RingNode& node, std::uint32_t point) { return node.point < point; };
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::uint32_t begin = begin_of(list[i]);
    const auto low = std::lower_bound(kept_nodes.begin(), kept_nodes.end(), begin, before);
    const auto high = std::lower_bound(low, kept_nodes.end(), traced.ends[list[i]], before);
    fits[i].fit(traced.ring(list[i]), settings.tolerance, memory, {low, high}, begin);
    if (fits[i].nodes().size() < static_cast<std::size_t>(settings.min_edges)) kept[list[i]] = 0;
  }
  drop_inside_dropped(parents);
  std::size_t out = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (!kept[list[i]]) continue;
    if (out != i) {
      std::swap(fits[out], fits[i]);
      list[out] = list[i];
    }
    ++out;
  }
  list.resize(out);
  while (!mend(traced, parents, settings.tolerance)) {
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::uint32_t begin = begin_of(list[i]);
    for (const auto& node : fits[i].nodes()) {
      rings.points.push_back(node.vertex);
      nodes.push_back({begin + static_cast<std::uint32_t>(node.point), node.vertex});
    }
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
}

// The chosen rings as they are.
void Approximator::State::copy(const Rings& traced, std::span<const std::int32_t> parents,
                               const ApproximateSettings& settings, Rings& rings) {
  for (std::size_t i = 0; i < traced.size(); ++i)
    if (traced.ring(i).size() < static_cast<std::size_t>(settings.min_edges)) kept[i] = 0;
  drop_inside_dropped(parents);
  for (std::size_t i = 0; i < traced.size(); ++i) {
    if (!kept[i]) continue;
    const auto ring = traced.ring(i);
    rings.points.insert(rings.points.end(), ring.begin(), ring.end());
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
}

bool Approximator::approximate(const Rings& traced, std::span<const std::int32_t> parents,
                               const ApproximateSettings& settings, Rings& rings,
                               std::span<const RingNode> nodes) {
  check(settings);
  State& s = *state_;
  s.counts = {};
  s.counts.traced_points = static_cast<std::uint32_t>(traced.points.size());
  s.counts.traced_rings = static_cast<std::uint32_t>(traced.size());
  s.areas.resize(traced.size());
  for (std::size_t i = 0; i < traced.size(); ++i) s.areas[i] = ring_area(traced.ring(i));
  if (parents.size() != traced.size()) {
    find_parents(traced, s.areas, s.found_parents);
    parents = s.found_parents;
  }
  s.choose(traced, parents, settings);
  rings.clear();
  s.nodes.clear();
  s.clean = true;
  if (settings.tolerance > 0.0)
    s.fit(traced, parents, settings, nodes, rings);
  else
    s.copy(traced, parents, settings, rings);
  s.counts.points = static_cast<std::uint32_t>(rings.points.size());
  s.counts.rings = static_cast<std::uint32_t>(rings.size());
  s.counts.dropped_rings = s.counts.traced_rings - s.counts.rings;
  return s.clean;
}

}  // namespace polyhull
