// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/tangency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "base/median.h"

namespace polyhull {
namespace {

/// Nearer to the picture's border (px) an outline is not the subject's.
constexpr double margin = 2.0;
/// tan(70°): outlines that reach further to either side surround the epipole, or nearly.
constexpr double widest = 2.75;

/// A camera's error, px, of which sound silhouettes stay below a half.
constexpr double noticed = 1.0;
constexpr double apart = 3.0;  // px: cameras of one rig, had none been moved, are nearer

/// The frame of a pair's planes.
struct Pencil {
  Vec3 e, u, v;
};

/// Where a silhouette touches the first and the last plane of a pencil.
struct Touch {
  Vec2 pixel{0.0};
  double tangent = 0.0;  ///< of theta
};

struct MeanSquare {
  double sum = 0.0;
  int count = 0;
  void add(double x) { sum += x * x, ++count; }
  double root() const { return count > 0 ? std::sqrt(sum / count) : 0.0; }
};

MeanSquare of_pairs(std::span<const PairTangency> pairs, std::size_t view, bool with) {
  MeanSquare sum;
  for (const PairTangency& pair : pairs)
    if ((pair.first == view || pair.second == view) == with) sum.add(pair.error);
  return sum;
}

Vec2 middle_of(const Rings& rings) {
  Vec2 least(rings.points.front()), greatest = least;
  for (const Vec2f& p : rings.points) {
    least = glm::min(least, Vec2(p));
    greatest = glm::max(greatest, Vec2(p));
  }
  return 0.5 * (least + greatest);
}

/// The planes through both cameras, those of theta 0 through the middle of the first silhouette.
std::optional<Pencil> pencil_of(const Silhouette& a, const Silhouette& b) {
  const Vec3 along = b.camera->centre() - a.camera->centre();
  const double length = glm::length(along);
  if (!(length > 0.0)) return std::nullopt;
  const Vec3 e = along / length, d = a.camera->ray(middle_of(*a.rings));
  const Vec3 aside = d - glm::dot(d, e) * e;
  // Under 2 degrees from the middle to the other camera: no plane is better than another.
  if (glm::length(aside) < 0.035 * glm::length(d)) return std::nullopt;
  const Vec3 u = glm::normalize(aside);
  return Pencil{e, u, glm::cross(e, u)};
}

/// The two touching points; nothing where the outline goes too far around.
std::optional<std::array<Touch, 2>> touches(const Silhouette& view, const Pencil& pencil) {
  const Mat3 to_ray = glm::transpose(view.camera->R) * glm::inverse(view.camera->K);
  const Vec3 x = glm::transpose(to_ray) * pencil.u, y = glm::transpose(to_ray) * pencil.v;
  std::array<Touch, 2> found{Touch{{}, widest}, Touch{{}, -widest}};
  for (const Vec2f& p : view.rings->points) {
    const double cosine = x.x * p.x + x.y * p.y + x.z;
    const double sine = y.x * p.x + y.y * p.y + y.z;
    if (!(cosine > 0.0) || !(std::abs(sine) < widest * cosine)) return std::nullopt;
    const double tangent = sine / cosine;
    if (tangent < found[0].tangent) found[0] = {Vec2(p), tangent};
    if (tangent > found[1].tangent) found[1] = {Vec2(p), tangent};
  }
  return found;
}

bool inside_picture(const Camera& camera, const Vec2& ideal) {
  const Vec2 real = camera.distort(ideal);
  return real.x > margin - 0.5 && real.y > margin - 0.5 && real.x < camera.width - 0.5 - margin &&
         real.y < camera.height - 0.5 - margin;
}

/// By how much theta changes a pixel beside the epipolar line; radians.
double radians_per_pixel(const Camera& camera, const Pencil& pencil, const Touch& touch) {
  const double cosine = 1.0 / std::sqrt(1.0 + touch.tangent * touch.tangent);
  const Vec3 n = cosine * (pencil.v - touch.tangent * pencil.u);
  const Vec3 line = glm::transpose(glm::inverse(camera.K)) * (camera.R * n);
  return glm::length(Vec2(line)) /
         std::abs(glm::dot(glm::cross(pencil.e, n), camera.ray(touch.pixel)));
}

void add_pair(std::span<const Silhouette> silhouettes, std::size_t first, std::size_t second,
              std::vector<Tangency>& found) {
  const Silhouette &a = silhouettes[first], &b = silhouettes[second];
  if (a.rings->empty() || b.rings->empty()) return;
  const std::optional<Pencil> pencil = pencil_of(a, b);
  if (!pencil) return;
  const auto in_a = touches(a, *pencil), in_b = touches(b, *pencil);
  if (!in_a || !in_b) return;
  for (std::size_t i = 0; i < 2; ++i) {
    const Touch &p = (*in_a)[i], &q = (*in_b)[i];
    if (!inside_picture(*a.camera, p.pixel) || !inside_picture(*b.camera, q.pixel)) continue;
    const double difference = std::atan(p.tangent) - std::atan(q.tangent);
    const double error = std::sqrt(2.0) * difference /
                         std::hypot(radians_per_pixel(*a.camera, *pencil, p),
                                    radians_per_pixel(*b.camera, *pencil, q));
    if (std::isfinite(error)) found.push_back({first, second, i == 1, p.pixel, q.pixel, error});
  }
}

}  // namespace

std::vector<Tangency> find_tangencies(std::span<const Silhouette> silhouettes,
                                      std::size_t most_pairs, std::uint32_t round) {
  std::vector<Tangency> found;
  const std::size_t views = silhouettes.size();
  if (views < 2) return found;
  const std::size_t pairs = views * (views - 1) / 2, asked = std::min(pairs, most_pairs);
  const std::size_t begin = (static_cast<std::size_t>(round) * asked) % pairs;
  for (std::size_t a = 0, number = 0; a < views; ++a)
    for (std::size_t b = a + 1; b < views; ++b, ++number)
      if ((number + pairs - begin) % pairs < asked) add_pair(silhouettes, a, b, found);
  return found;
}

std::vector<PairTangency> median_by_pair(std::span<const Tangency> tangencies) {
  std::map<std::pair<std::size_t, std::size_t>, std::array<std::vector<double>, 2>> errors;
  for (const Tangency& tangency : tangencies)
    errors[{tangency.first, tangency.second}][tangency.greatest].push_back(tangency.error);
  std::vector<PairTangency> medians;
  for (auto& [pair, of_planes] : errors) {
    MeanSquare sum;
    for (std::vector<double>& of_plane : of_planes)
      if (!of_plane.empty()) sum.add(median(std::move(of_plane)));
    medians.push_back({pair.first, pair.second, sum.root()});
  }
  return medians;
}

double error_with(std::span<const PairTangency> pairs, std::size_t view) {
  return of_pairs(pairs, view, true).root();
}

double error_without(std::span<const PairTangency> pairs, std::size_t view) {
  return of_pairs(pairs, view, false).root();
}

int camera_off(std::span<const PairTangency> pairs, std::size_t views) {
  int worst = -1;
  double largest = 0.0;
  for (std::size_t k = 0; k < views; ++k) {
    const MeanSquare with = of_pairs(pairs, k, true), without = of_pairs(pairs, k, false);
    // Two pairs at least on one side, one on the other: three cameras can tell.
    if (with.count < 2 || without.count < 1) continue;
    const double times = with.root() / std::max(without.root(), 1e-9);
    if (with.root() < noticed || times < 3.0 || times <= largest) continue;
    worst = static_cast<int>(k);
    largest = times;
  }
  return worst;
}

std::size_t agreeing_views(std::span<const PairTangency> pairs, std::size_t views) {
  std::vector<bool> left_out(views);
  for (std::size_t agreeing = views;; --agreeing) {
    std::vector<std::size_t> against(views);
    for (const PairTangency& pair : pairs)
      if (pair.error >= apart && !left_out[pair.first] && !left_out[pair.second])
        ++against[pair.first], ++against[pair.second];
    const auto worst = std::max_element(against.begin(), against.end());
    if (worst == against.end() || *worst == 0) return agreeing;
    left_out[static_cast<std::size_t>(worst - against.begin())] = true;
  }
}

}  // namespace polyhull
