// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/garbage_matte.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

#include "base/convex_hull.h"
#include "base/error.h"
#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

constexpr double largest_coordinate = 1e6;
constexpr double sample_distance = 4.0;  // px between points along a bent edge

[[noreturn]] void refuse(std::string_view part, const char* why) {
  throw Error(Error::Kind::bad_input,
              "The polygon '{}' {}; write corners as 'x,y x,y x,y' in pixels and put a semicolon "
              "between polygons.",
              part, why);
}

float parse_number(std::string_view text, std::string_view part) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    refuse(part, "holds something that is not a number");
  if (std::abs(value) > largest_coordinate) refuse(part, "reaches further than 1000000 px");
  return static_cast<float>(value);
}

void parse_polygon(std::string_view part, Rings& rings) {
  constexpr std::string_view blank = " \t\r\n";
  const std::size_t before = rings.points.size();
  std::size_t at = part.find_first_not_of(blank);
  if (at == std::string_view::npos) return;
  while (at != std::string_view::npos) {
    const std::size_t end = std::min(part.find_first_of(blank, at), part.size());
    const std::string_view corner = part.substr(at, end - at);
    const std::size_t comma = corner.find(',');
    if (comma == std::string_view::npos) refuse(part, "has a corner without a comma");
    rings.points.emplace_back(parse_number(corner.substr(0, comma), part),
                              parse_number(corner.substr(comma + 1), part));
    at = part.find_first_not_of(blank, end);
  }
  if (rings.points.size() - before < 3) refuse(part, "has fewer than three corners");
  rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
}

/// The part of a convex polygon where normal . p <= limit.
std::vector<Vec2> clip(const std::vector<Vec2>& polygon, const Vec2& normal, double limit) {
  std::vector<Vec2> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[(i + 1) % polygon.size()];
    const double da = glm::dot(normal, a) - limit;
    const double db = glm::dot(normal, b) - limit;
    if (da <= 0.0) kept.push_back(a);
    if ((da < 0.0 && db > 0.0) || (da > 0.0 && db < 0.0))
      kept.push_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

/// Pinhole pixels of the corners of the part of the box in front of the camera.
std::vector<Vec2> visible_corners(const Camera& camera, const Bounds& bounds) {
  std::array<Vec3, 8> corners;
  double farthest = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Vec3 world((i & 1) != 0 ? bounds.max.x : bounds.min.x,
                     (i & 2) != 0 ? bounds.max.y : bounds.min.y,
                     (i & 4) != 0 ? bounds.max.z : bounds.min.z);
    corners[i] = camera.to_camera(world);
    farthest = std::max(farthest, glm::length(corners[i]));
  }
  const double near = 1e-4 * farthest;
  std::vector<Vec2> points;
  const auto project = [&](const Vec3& p) {
    const Vec3 u = camera.K * (p / p.z);
    points.emplace_back(u.x, u.y);
  };
  for (int i = 0; i < 8; ++i) {
    if (corners[i].z >= near) project(corners[i]);
    for (const int axis : {1, 2, 4}) {
      const int j = i | axis;
      if (j == i || (corners[i].z < near) == (corners[j].z < near)) continue;
      const double s = (near - corners[i].z) / (corners[j].z - corners[i].z);
      Vec3 crossing = corners[i] + s * (corners[j] - corners[i]);
      crossing.z = near;
      project(crossing);
    }
  }
  return points;
}

/// The frame with a margin, as a box of pinhole pixels.
Bounds ideal_frame(const Camera& camera) {
  Bounds box{Vec3(1e30), Vec3(-1e30)};
  const auto take = [&](double x, double y) {
    const Vec2 p = camera.undistort(Vec2(x, y));
    box.min = glm::min(box.min, Vec3(p, 0.0));
    box.max = glm::max(box.max, Vec3(p, 0.0));
  };
  const double left = -2.0, top = -2.0, right = camera.width + 1.0, bottom = camera.height + 1.0;
  for (int i = 0; i <= 64; ++i) {
    const double s = i / 64.0;
    take(left + s * (right - left), top);
    take(left + s * (right - left), bottom);
    take(left, top + s * (bottom - top));
    take(right, top + s * (bottom - top));
  }
  return box;
}

Rings ring_of(const std::vector<Vec2>& points) {
  Rings rings;
  for (const Vec2& p : points) rings.points.emplace_back(static_cast<Vec2f>(p));
  rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  return rings;
}

}  // namespace

Rings parse_polygons(std::string_view text) {
  Rings rings;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(';'), text.size());
    parse_polygon(text.substr(0, end), rings);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return rings;
}

Rings bounds_outline(const Camera& camera, const Bounds& bounds) {
  const Vec3 centre = camera.centre();
  if (glm::all(glm::greaterThanEqual(centre, bounds.min)) &&
      glm::all(glm::lessThanEqual(centre, bounds.max)))
    return {};
  const std::vector<Vec2> nowhere{{-30.0, -30.0}, {-20.0, -30.0}, {-20.0, -20.0}};
  const std::vector<Vec2> corners = visible_corners(camera, bounds);
  if (corners.size() < 3) return ring_of(nowhere);

  const Bounds frame = ideal_frame(camera);
  std::vector<Vec2> outline;
  for (const std::uint32_t corner : convex_hull(corners)) outline.push_back(corners[corner]);
  outline = clip(outline, Vec2(1, 0), frame.max.x);
  outline = clip(outline, Vec2(-1, 0), -frame.min.x);
  outline = clip(outline, Vec2(0, 1), frame.max.y);
  outline = clip(outline, Vec2(0, -1), -frame.min.y);
  if (outline.size() < 3) return ring_of(nowhere);
  if (!camera.has_distortion()) return ring_of(outline);

  std::vector<Vec2> bent;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2& a = outline[i];
    const Vec2 edge = outline[(i + 1) % outline.size()] - a;
    const int pieces = std::max(1, static_cast<int>(glm::length(edge) / sample_distance));
    for (int k = 0; k < pieces; ++k)
      bent.push_back(camera.distort(a + edge * (double(k) / pieces)));
  }
  return ring_of(bent);
}

Picture polygon_mask(const Rings& rings, int width, int height, bool invert) {
  std::vector<std::uint8_t> plane;
  silhouette::fill_polygon(rings, width, height, plane);
  const std::size_t length = static_cast<std::size_t>(blocks_across(width)) * matte_block;
  Picture mask{width, height, 1, {}};
  mask.pixels.resize(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      mask.row(y)[x] = plane[length * static_cast<std::size_t>(y) + x] ^ (invert ? 255 : 0);
  return mask;
}

}  // namespace polyhull
