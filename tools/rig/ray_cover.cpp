// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/ray_cover.h"

#include <algorithm>
#include <cmath>

#include "base/rings.h"

namespace polyhull {
namespace {

struct Interval {
  double from, to;
};
using Intervals = std::vector<Interval>;

struct Ray {
  Vec3 origin, direction;
};

// A view as rays are held against it.
struct Judge {
  const Camera* camera;
  Rings rings;      // the silhouette or, where the unseen counts, what of the frame is not in it
  bool forbidding;  // whether the rings forbid what lies in them
};

// The frame's border, in pinhole pixels.
void add_frame(const Camera& camera, Rings& rings) {
  constexpr int steps = 16;
  const Vec2 low(-0.5), high(camera.width - 0.5, camera.height - 0.5);
  const Vec2 corners[] = {low, {low.x, high.y}, high, {high.x, low.y}, low};
  for (int side = 0; side < 4; ++side)
    for (int i = 0; i < steps; ++i)
      rings.points.emplace_back(
          camera.undistort(glm::mix(corners[side], corners[side + 1], i / double(steps))));
  rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
}

Intervals overlap(const Intervals& a, const Intervals& b) {
  Intervals both;
  for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    const double from = std::max(a[i].from, b[k].from), to = std::min(a[i].to, b[k].to);
    if (from < to) both.push_back({from, to});
    a[i].to < b[k].to ? ++i : ++k;
  }
  return both;
}

// Where on the ray, from its origin on, the view allows the subject to be.
Intervals allowed(const Judge& judge, const Ray& ray) {
  const Camera& camera = *judge.camera;
  const Vec3 start = camera.K * camera.to_camera(ray.origin);
  const Vec3 step = camera.K * (camera.R * ray.direction);
  // In front of the camera: start.z + s step.z > 0.
  double from = 0.0, to = INFINITY;
  if (step.z > 0.0)
    from = std::max(0.0, -start.z / step.z);
  else if (step.z < 0.0)
    to = -start.z / step.z;
  else if (start.z <= 0.0)
    to = -1.0;
  Intervals result;
  if (to <= from) {
    if (judge.forbidding) result.push_back({0.0, INFINITY});
    return result;
  }

  // The ray's image is a straight line; where it crosses the rings it goes in or out.
  std::vector<double> crossings;
  const Vec3 line = glm::cross(start, step);
  for (std::size_t r = 0; r < judge.rings.size(); ++r) {
    const std::span<const Vec2f> ring = judge.rings.ring(r);
    Vec2 a(ring.back());
    double side_a = glm::dot(line, Vec3(a, 1.0));
    for (const Vec2f& point : ring) {
      const Vec2 b(point);
      const double side_b = glm::dot(line, Vec3(b, 1.0));
      if ((side_a > 0.0) != (side_b > 0.0)) {
        const Vec2 q = a + (b - a) * (side_a / (side_a - side_b));
        const Vec2 below(step.x - q.x * step.z, step.y - q.y * step.z);
        const int axis = std::abs(below.x) > std::abs(below.y) ? 0 : 1;
        const double s = (q[axis] * start.z - start[axis]) / below[axis];
        if (s > from && s < to) crossings.push_back(s);
      }
      a = b;
      side_a = side_b;
    }
  }
  std::sort(crossings.begin(), crossings.end());
  // It comes from infinitely far outside, unless it begins in front of the camera.
  bool in = from == 0.0 && start.z > 0.0 && is_inside(judge.rings, Vec2(start) / start.z);
  const auto add = [&](double begin, double end) {
    if (!(begin < end)) return;
    if (!result.empty() && result.back().to == begin)
      result.back().to = end;
    else
      result.push_back({begin, end});
  };
  if (judge.forbidding) add(0.0, from);
  double begin = from;
  crossings.push_back(to);
  for (const double end : crossings) {
    if (in != judge.forbidding) add(begin, end);
    in = !in;
    begin = end;
  }
  if (judge.forbidding) add(to, INFINITY);
  return result;
}

Intervals in_bounds(const Bounds& bounds, const Ray& ray) {
  double from = 0.0, to = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = (bounds.min[axis] - ray.origin[axis]) / ray.direction[axis];
    const double high = (bounds.max[axis] - ray.origin[axis]) / ray.direction[axis];
    from = std::max(from, std::min(low, high));
    to = std::min(to, std::max(low, high));
  }
  return from < to ? Intervals{{from, to}} : Intervals{};
}

// Points well inside the rings, on a grid of about as many.
std::vector<Vec2> points_inside(const Camera& camera, const Rings& rings, int samples) {
  double area = 0.0;
  Vec2 low(INFINITY), high(-INFINITY);
  for (std::size_t r = 0; r < rings.size(); ++r) {
    Vec2 a(rings.ring(r).back());
    for (const Vec2f& point : rings.ring(r)) {
      const Vec2 b(point);
      area += 0.5 * cross(a, b);  // holes run the other way
      low = glm::min(low, b);
      high = glm::max(high, b);
      a = b;
    }
  }
  std::vector<Vec2> points;
  if (area == 0.0) return points;
  const double margin = std::max(2.0, 0.003 * camera.width);
  const double step = std::max(1.0, std::sqrt(std::abs(area) / samples));
  for (double y = low.y + 0.5 * step; y < high.y; y += step)
    for (double x = low.x + 0.5 * step; x < high.x; x += step) {
      const Vec2 p(x, y);
      if (is_inside(rings, p) && is_inside(rings, p - Vec2(margin, 0)) &&
          is_inside(rings, p + Vec2(margin, 0)) && is_inside(rings, p - Vec2(0, margin)) &&
          is_inside(rings, p + Vec2(0, margin)))
        points.push_back(p);
    }
  return points;
}

}  // namespace

std::vector<Unexplained> find_unexplained(const std::vector<SeenSubject>& views,
                                          const std::vector<PicturePart>& parts,
                                          const std::optional<Bounds>& bounds, int samples) {
  std::vector<Judge> judges;
  for (const SeenSubject& view : views) {
    judges.push_back({view.camera, view.rings, bounds.has_value()});
    if (bounds) add_frame(*view.camera, judges.back().rings);
  }
  std::vector<Unexplained> all;
  for (const PicturePart& part : parts) {
    const Camera& camera = *views[part.view].camera;
    const std::vector<Vec2> points = points_inside(camera, part.rings, samples);
    std::size_t count = 0;
    Unexplained& found = all.emplace_back(Unexplained{0.0, Vec2(INFINITY), Vec2(-INFINITY)});
    for (const Vec2& point : points) {
      const Ray ray{camera.centre(), camera.ray(point)};
      Intervals left = bounds ? in_bounds(*bounds, ray) : Intervals{{0.0, INFINITY}};
      for (std::size_t k = 0; k < judges.size() && !left.empty(); ++k)
        if (k != part.view) left = overlap(left, allowed(judges[k], ray));
      if (!left.empty()) continue;
      ++count;
      found.low = glm::min(found.low, point);
      found.high = glm::max(found.high, point);
    }
    if (!points.empty()) found.share = double(count) / double(points.size());
  }
  return all;
}

std::vector<Unexplained> find_unexplained(const std::vector<SeenSubject>& views,
                                          const std::optional<Bounds>& bounds, int samples) {
  std::vector<PicturePart> silhouettes;
  for (std::size_t i = 0; i < views.size(); ++i) silhouettes.push_back({i, views[i].rings});
  return find_unexplained(views, silhouettes, bounds, samples);
}

}  // namespace polyhull
