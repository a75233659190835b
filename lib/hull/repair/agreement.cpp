// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/agreement.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace polyhull::hull {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Centres nearer than this, relative to their distance from the origin, are one: there is no
/// epipolar line.
constexpr double same_centre = 1e-9;

/// Of depths, relative.
constexpr double rounding = 1e-9;

/// A ray in another camera's picture: homogeneous pixels a + s b, and the part of it that lies
/// before both cameras.
struct PictureLine {
  Vec3 a, b;
  Vec2 e{0.0};
  double s_begin = 0.0, s_end = infinite;
  double w_begin = -infinite, w_end = infinite;

  /// Cuts it to what lies before the other camera; false: nothing does.
  bool limit() {
    if (a.z > 0.0) {
      w_begin = glm::dot(e, Vec2(a)) / a.z;
      if (b.z < 0.0) s_end = -a.z / b.z;
    } else {
      if (!(b.z > 0.0)) return false;
      s_begin = -a.z / b.z;
    }
    if (b.z > 0.0) w_end = glm::dot(e, Vec2(b)) / b.z;
    return true;
  }

  /// The depth at coordinate \p w.
  double depth(double w) const {
    if (w <= w_begin) return s_begin;
    if (w >= w_end) return s_end;
    const double s = (glm::dot(e, Vec2(a)) - w * a.z) / (w * b.z - glm::dot(e, Vec2(b)));
    return std::clamp(s, s_begin, s_end);
  }
};

/// Sets scratch.crossings to where the line of normal \p L and direction \p e meets \p edges, along
/// it.
void cross_edges(std::span<const Agreement::Edges> edges, const Vec3& L, const Vec2& e,
                 Agreement::Scratch& scratch) {
  scratch.crossings.clear();
  const Vec2 normal(L), reach = glm::abs(normal);
  for (const Agreement::Edges& some : edges) {
    const double along = glm::dot(reach, some.half);
    const double size = glm::dot(reach, glm::abs(some.middle)) + std::abs(L.z) + along;
    if (std::abs(glm::dot(normal, some.middle) + L.z) > along + rounding * size) continue;
    double side = glm::dot(normal, some.points[0]) + L.z;
    for (std::size_t i = 1; i < some.count; ++i) {
      const double last = side;
      side = glm::dot(normal, some.points[i]) + L.z;
      if ((last < 0.0) == (side < 0.0)) continue;
      scratch.crossings.push_back(
          glm::dot(e, glm::mix(some.points[i - 1], some.points[i], last / (last - side))));
    }
  }
  std::sort(scratch.crossings.begin(), scratch.crossings.end());
}

/// The longest stretch where the sum of votes, 0 before the first end, is at least \p needed. A
/// silhouette that is cut off by the frame ends where the frame does, but for rounding: nothing is
/// rejected in between.
Agreement::Stretch longest_with(std::vector<Agreement::Scratch::End>& ends, int needed) {
  std::sort(ends.begin(), ends.end(),
            [](const auto& p, const auto& q) { return p.s != q.s ? p.s < q.s : p.step < q.step; });
  ends.push_back({infinite, -(1 << 30)});
  int votes = 0;
  double begin = 0.0, last = -1.0;
  Agreement::Stretch longest;
  for (const Agreement::Scratch::End& end : ends) {
    const bool was_enough = votes >= needed;
    votes += end.step;
    if (votes >= needed && !was_enough && end.s > last * (1.0 + rounding)) begin = end.s;
    if (votes >= needed || !was_enough) continue;
    last = end.s;
    if (!(begin < end.s)) continue;
    const double across = std::isinf(end.s) ? 1.0 : (end.s - begin) / end.s;
    if (across > longest.across) longest = {across, 0.5 * (begin + end.s)};
  }
  return longest;
}

}  // namespace

Agreement::Agreement(std::span<const Silhouette> views, Unseen unseen) : unseen_(unseen) {
  for (const Silhouette& silhouette : views) {
    View& view = views_.emplace_back();
    view.camera = silhouette.camera;
    view.M = silhouette.camera->K * silhouette.camera->R;
    view.m = silhouette.camera->K * silhouette.camera->t;
    view.centre = silhouette.camera->centre();
    replace(views_.size() - 1, *silhouette.rings);
  }
}

void Agreement::add_ring(View& view, std::span<const Vec2f> ring) {
  for (std::size_t first = 0; first < ring.size(); first += Edges::most) {
    Edges& some = view.edges.emplace_back();
    some.count = std::min(Edges::most, ring.size() - first) + 1;
    Vec2 low(1e300), high(-1e300);
    for (std::size_t i = 0; i < some.count; ++i) {
      some.points[i] = Vec2(ring[(first + i) % ring.size()]);
      low = glm::min(low, some.points[i]), high = glm::max(high, some.points[i]);
    }
    some.middle = 0.5 * (low + high), some.half = 0.5 * (high - low);
  }
}

void Agreement::replace(std::size_t number, const Rings& rings) {
  View& view = views_[number];
  view.edges.clear();
  for (std::size_t i = 0; i < rings.size(); ++i) add_ring(view, rings.ring(i));
  view.silhouette_edges = view.edges.size();
  if (unseen_ != Unseen::keep) return;
  const float right = static_cast<float>(view.camera->width) - 0.5f;
  const float bottom = static_cast<float>(view.camera->height) - 0.5f;
  const Vec2f border[] = {{-0.5f, -0.5f}, {-0.5f, bottom}, {right, bottom}, {right, -0.5f}};
  add_ring(view, border);
}

/// Gives \p step votes to the stretches of the ray that are inside by the even-odd rule of \p edges,
/// which are of \p seen. False: there are none.
bool Agreement::add_stretches(const View& from, const Vec3& direction, const View& seen,
                              std::span<const Edges> edges, int step, Scratch& scratch) const {
  PictureLine line{seen.M * from.centre + seen.m, seen.M * direction};
  const std::size_t known = scratch.ends.size();
  const auto add = [&](double begin, double end) {
    if (!(begin < end)) return;
    scratch.ends.push_back({begin, step});
    scratch.ends.push_back({end, -step});
  };
  if (glm::length(from.centre - seen.centre) <=
      same_centre * (glm::length(from.centre) + glm::length(seen.centre))) {
    // The whole ray is one pixel: any line through it tells whether that is inside.
    if (!(line.b.z > 0.0)) return false;
    const Vec2 p = Vec2(line.b) / line.b.z;
    cross_edges(edges, Vec3(0.0, 1.0, -p.y), Vec2(1.0, 0.0), scratch);
    for (std::size_t k = 0; k + 1 < scratch.crossings.size(); k += 2)
      if (scratch.crossings[k] <= p.x && p.x < scratch.crossings[k + 1]) add(0.0, infinite);
    return scratch.ends.size() > known;
  }
  const Vec3 L = glm::cross(line.a, line.b);
  const double length = glm::length(Vec2(L));
  if (!(length > 0.0) || !std::isfinite(length)) return false;
  line.e = Vec2(L.y, -L.x) / length;
  if (!line.limit()) return false;
  cross_edges(edges, L, line.e, scratch);
  for (std::size_t k = 0; k + 1 < scratch.crossings.size(); k += 2)
    if (scratch.crossings[k + 1] > line.w_begin && scratch.crossings[k] < line.w_end)
      add(line.depth(scratch.crossings[k]), line.depth(scratch.crossings[k + 1]));
  return scratch.ends.size() > known;
}

Agreement::Stretch Agreement::longest(std::size_t view, const Vec2& pixel, std::size_t fewest,
                                      Scratch& scratch) const {
  const View& from = views_[view];
  const Vec3 direction = from.camera->ray(pixel);
  const int others = static_cast<int>(views_.size()) - 1;
  scratch.ends.clear();
  for (std::size_t j = 0; j < views_.size(); ++j) {
    if (j == view) continue;
    const View& seen = views_[j];
    const std::span<const Edges> silhouette(seen.edges.data(), seen.silhouette_edges);
    const bool any = add_stretches(from, direction, seen, silhouette, 1, scratch);
    if (unseen_ == Unseen::keep) {
      // One that rejects outvotes all others.
      add_stretches(from, direction, seen, seen.edges, -others - 1, scratch);
    } else if (!any) {
      return {};
    }
  }
  if (unseen_ == Unseen::carve && others < static_cast<int>(fewest)) return {};
  Stretch longest =
      longest_with(scratch.ends, unseen_ == Unseen::keep ? static_cast<int>(fewest) : others);
  longest.across *= from.camera->K[0][0];
  return longest;
}

/// Calls visit(missing, sum, across) for each part of the ray, from the camera on, until it returns
/// false: how many of the others do not accept the part, the sum of their numbers (of one: which it
/// is), and the part's length over the depth of its far end.
template <class Visit>
void Agreement::visit_parts(std::size_t view, const Vec2& pixel, Scratch& scratch,
                            Visit visit) const {
  const View& from = views_[view];
  const Vec3 direction = from.camera->ray(pixel);
  scratch.ends.clear();
  const bool keep = unseen_ == Unseen::keep;
  int missing = 0;
  std::size_t sum = 0;
  for (std::size_t j = 0; j < views_.size(); ++j) {
    if (j == view) continue;
    const View& seen = views_[j];
    const std::span<const Edges> edges(seen.edges.data(),
                                       keep ? seen.edges.size() : seen.silhouette_edges);
    add_stretches(from, direction, seen, edges, static_cast<int>(j) + 1, scratch);
    if (!keep) ++missing, sum += j;
  }
  std::sort(scratch.ends.begin(), scratch.ends.end(),
            [](const auto& p, const auto& q) { return p.s < q.s; });
  scratch.ends.push_back({infinite, 0});
  double begin = 0.0;
  for (const Scratch::End& end : scratch.ends) {
    if (begin < end.s) {
      const double across = std::isinf(end.s) ? 1.0 : (end.s - begin) / end.s;
      if (!visit(missing, sum, across)) return;
    }
    begin = end.s;
    if (end.step == 0) continue;
    // Under Unseen::keep stretches are what is rejected.
    const auto j = static_cast<std::size_t>(std::abs(end.step)) - 1;
    if ((end.step > 0) == keep)
      ++missing, sum += j;
    else
      --missing, sum -= j;
  }
}

int Agreement::objector(std::size_t view, const Vec2& pixel, Scratch& scratch) const {
  double longest = 0.0;
  int found = several;
  visit_parts(view, pixel, scratch, [&](int missing, std::size_t sum, double across) {
    if (missing == 0) found = nobody;
    if (missing == 1 && across > longest) longest = across, found = static_cast<int>(sum);
    return missing > 0;
  });
  return found;
}

bool Agreement::is_only_objector(std::size_t view, const Vec2& pixel, std::size_t objector,
                                 Scratch& scratch) const {
  bool one = false, another = false;
  visit_parts(view, pixel, scratch, [&](int missing, std::size_t sum, double) {
    if (missing <= 1) (missing == 1 && sum == objector ? one : another) = true;
    return !another;
  });
  return one && !another;
}

bool Agreement::near_outline(std::size_t view, const Vec2& pixel, double distance) const {
  const View& seen = views_[view];
  for (const Edges& some : std::span(seen.edges.data(), seen.silhouette_edges)) {
    const Vec2 beyond = glm::abs(pixel - some.middle) - some.half;
    if (beyond.x > distance || beyond.y > distance) continue;
    for (std::size_t i = 1; i < some.count; ++i) {
      const Vec2 along = some.points[i] - some.points[i - 1], to = pixel - some.points[i - 1];
      const double square = glm::dot(along, along);
      const double t = square > 0.0 ? std::clamp(glm::dot(to, along) / square, 0.0, 1.0) : 0.0;
      const Vec2 gap = to - t * along;
      if (glm::dot(gap, gap) <= distance * distance) return true;
    }
  }
  return false;
}

}  // namespace polyhull::hull
