// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/colour/local_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include "base/thread_pool.h"
#include "texture/colour/motion_equations.h"

namespace polyhull {
namespace {

// In pixels.
constexpr float spacing = 16.0f;  // of nodes
constexpr float touch = 5.0f;     // of points
constexpr double place_noise = 2.0;
constexpr float search = 8.0f;
/// s of one round after the other; 0: all as one body.
constexpr float windows[] = {0.0f, 0.0f, 0.0f, 0.0f, 50.0f, 50.0f, 25.0f, 25.0f, 15.0f};
constexpr float reach = 2.4f;  // of the window, in s

constexpr double colour_noise = 8.0;  // codes
constexpr std::size_t most_compared = 3000;

struct Node {
  Vec3 middle{0.0};
  double count = 0.0;
  PartMotion motion;
  std::vector<std::uint32_t> links;
  std::vector<std::uint32_t> members;  // the points compared
  std::vector<std::pair<std::uint32_t, float>>
      around;  // nodes with their distances along the links
};

struct Nodes {
  std::vector<Node> list;
  std::vector<std::uint32_t> of;  // by point
};

/// A node is what lies in one cube.
Nodes gather(const ColouredPoints& points, float pixel) {
  Nodes out;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::uint64_t key = 0;
    for (int c = 0; c < 3; ++c) {
      const float cubes = std::floor(points.positions[i][c] / (spacing * pixel));
      key = key << 20 | static_cast<std::uint64_t>(std::clamp(cubes, -5e5f, 5e5f) + 5e5f);
    }
    keys[i] = {key, i};
  }
  std::sort(keys.begin(), keys.end());
  out.of.resize(points.size());
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (k == 0 || keys[k].first != keys[k - 1].first) out.list.emplace_back();
    const std::uint32_t i = keys[k].second;
    out.of[i] = static_cast<std::uint32_t>(out.list.size() - 1);
    out.list.back().middle += Vec3(points.positions[i]);
    out.list.back().count += 1.0;
  }
  for (Node& node : out.list) node.middle /= node.count;
  return out;
}

/// Links nodes whose points touch.
void link(Nodes& nodes, const ColouredPoints& points, float pixel) {
  const PointGrid grid(points.positions, touch * pixel);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    grid.near(points.positions[i], touch * pixel, [&](std::uint32_t k, float) {
      const std::uint32_t a = nodes.of[i], b = nodes.of[k];
      if (a == b || !alike(points.normals[i], points.normals[k])) return;
      auto& links = nodes.list[a].links;
      if (std::find(links.begin(), links.end(), b) == links.end()) links.push_back(b);
    });
  }
}

/// Finds the nodes around each within \p most along the links.
void measure(Nodes& nodes, float most, int threads) {
  using Entry = std::pair<float, std::uint32_t>;
  parallel_for(nodes.list.size(), 8, threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> way(nodes.list.size());
    for (std::size_t n = begin; n < end; ++n) {
      std::fill(way.begin(), way.end(), std::numeric_limits<float>::infinity());
      std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
      way[n] = 0.0f;
      queue.emplace(0.0f, static_cast<std::uint32_t>(n));
      while (!queue.empty()) {
        const auto [length, at] = queue.top();
        queue.pop();
        if (length > way[at]) continue;
        const Node& node = nodes.list[at];
        nodes.list[n].around.emplace_back(at, length);
        for (const std::uint32_t to : node.links) {
          const auto next =
              length + static_cast<float>(glm::distance(node.middle, nodes.list[to].middle));
          if (next > most || !(next < way[to])) continue;
          way[to] = next;
          queue.emplace(next, to);
        }
      }
    }
  });
}

/// The place and the normal of point \p i by its node's motion and those linked to it.
std::pair<Vec3f, Vec3f> moved(const Nodes& nodes, const ColouredPoints& points, std::size_t i,
                              float pixel) {
  const double width = spacing * pixel;
  const Vec3 p(points.positions[i]), n(points.normals[i]);
  Vec3 place(0.0), normal(0.0);
  double sum = 0.0;
  const auto add = [&](const Node& node) {
    const Vec3 way = p - node.middle;
    const double weight = std::exp(-glm::dot(way, way) / (width * width));
    place += weight * node.motion(p);
    normal += weight * (node.motion.turn * n);
    sum += weight;
  };
  const Node& own = nodes.list[nodes.of[i]];
  add(own);
  for (const std::uint32_t to : own.links) add(nodes.list[to]);
  return {Vec3f(place / sum), Vec3f(glm::normalize(normal))};
}

/// How what view \p k shows changes over the surface at \p place: codes per unit, columns by channel.
std::optional<glm::mat3> slopes_at(const SeenSurface& now, std::size_t k, const Vec3f& place,
                                   const Vec3f& normal) {
  const float step = 1.5f * now.pixel;
  const Vec3f beside = std::abs(normal.y) < 0.9f ? Vec3f(0, 1, 0) : Vec3f(1, 0, 0);
  const Vec3f across = glm::normalize(glm::cross(normal, beside));
  glm::mat3 slopes(0.0f);
  for (const Vec3f& way : {across, glm::cross(normal, across)}) {
    const std::optional<Vec3f> ahead = now.shown(k, place + step * way);
    const std::optional<Vec3f> back = now.shown(k, place - step * way);
    if (!ahead || !back) return std::nullopt;
    for (int c = 0; c < 3; ++c) slopes[c] += ((*ahead)[c] - (*back)[c]) / (2.0f * step) * way;
  }
  return slopes;
}

/// Adds what a point at \p place tells.
void compare(MotionEquations& equations, const Vec3f& place, const Vec3f& normal,
             const Vec3f& colour, const PointGrid& grid, const SeenSurface& now) {
  const double noise = place_noise * now.pixel;
  const std::uint32_t i =
      nearest_point(grid, now.points.normals, place, normal, search * now.pixel, 0.7f);
  if (i == no_point) return;
  const Vec3f facing = now.points.normals[i];
  const float height = glm::dot(facing, place - now.points.positions[i]);
  const double off = height / noise;
  equations.add(Vec3(place), Vec3(facing) / noise, off, huber_weight(off));
  const Vec3f on = place - height * facing;
  const std::size_t view = now.views[i];
  const std::optional<Vec3f> here = now.shown(view, on);
  if (!here) return;
  const std::optional<glm::mat3> slopes = slopes_at(now, view, on, facing);
  if (!slopes) return;
  for (int c = 0; c < 3; ++c) {
    const double differs = ((*here)[c] - colour[c]) / colour_noise;
    equations.add(Vec3(place), Vec3((*slopes)[c]) / colour_noise, differs, huber_weight(differs));
  }
}

/// One round: all nodes' motions by the equations \p own of each.
void solve(Nodes& nodes, const std::vector<MotionEquations>& own, float window, float pixel,
           int threads) {
  const double one = 1.0 / (place_noise * pixel * place_noise * pixel);  // point's weight
  if (window == 0.0f) {
    MotionEquations whole;
    for (const MotionEquations& equations : own) whole.add(equations, 1.0);
    const Node& any = nodes.list.front();
    whole.hold(any.motion(any.middle), 100.0 * pixel, 0.2 * one);
    const PartMotion motion = whole.solved(any.motion);
    for (Node& node : nodes.list) node.motion = motion;
    return;
  }
  const float s = window * pixel;
  parallel_each(nodes.list.size(), 8, threads, [&](std::size_t n) {
    Node& node = nodes.list[n];
    MotionEquations sum;
    for (const auto& [other, way] : node.around)
      if (way < reach * s) sum.add(own[other], std::exp(-way * way / (s * s)));
    sum.hold(node.motion(node.middle), 25.0 * pixel, 35.0 * one);
    node.motion = sum.solved(node.motion);
  });
}

}  // namespace

void carry(ColouredPoints& points, std::span<const std::uint8_t> seen, const SeenSurface& now,
           int threads) {
  if (points.size() == 0 || now.points.size() == 0) return;
  const float pixel = now.pixel;
  Nodes nodes = gather(points, pixel);
  link(nodes, points, pixel);
  measure(nodes, reach * *std::max_element(std::begin(windows), std::end(windows)) * pixel,
          threads);
  const auto all = static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 1));
  const std::size_t stride = (all + most_compared - 1) / most_compared;
  std::size_t met = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (seen[i] && met++ % stride == 0) nodes.list[nodes.of[i]].members.push_back(i);
  const PointGrid grid(now.points.positions, 6.0f * pixel);
  std::vector<MotionEquations> own(nodes.list.size());
  for (const float window : windows) {
    parallel_each(nodes.list.size(), 8, threads, [&](std::size_t n) {
      own[n] = {};
      for (const std::uint32_t i : nodes.list[n].members) {
        const auto [place, normal] = moved(nodes, points, i, pixel);
        compare(own[n], place, normal, points.colours[i], grid, now);
      }
    });
    solve(nodes, own, window, pixel, threads);
  }
  ColouredPoints out = points;
  parallel_each(points.size(), 1024, threads, [&](std::size_t i) {
    const auto [place, normal] = moved(nodes, points, i, pixel);
    out.positions[i] = place;
    out.normals[i] = normal;
  });
  points = std::move(out);
}

}  // namespace polyhull
