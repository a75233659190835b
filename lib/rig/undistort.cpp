// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/undistort.h"

#include <numeric>

#include "rig/lens.h"

namespace polyhull {
namespace {

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double square = glm::dot(along, along);
  const double t = square > 0.0 ? glm::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0.0;
  return glm::length(p - (a + t * along));
}

class Subdivision {
 public:
  Subdivision(const Lens& lens, double max_deviation, UndistortedRings& out)
      : lens_(lens), max_deviation_(max_deviation), out_(out) {}

  // Adds the vertices strictly between the ends.
  void add_between(const Vec2& a, const Vec2& b, const Vec2& ideal_a, const Vec2& ideal_b,
                   std::uint32_t source, int depth) {
    if (depth == 0) return;
    const Vec2 middle = 0.5 * (a + b);
    const Vec2 ideal_middle = lens_.undistort(middle);
    if (!bent(a, b, ideal_a, ideal_b, ideal_middle, depth)) return;
    add_between(a, middle, ideal_a, ideal_middle, source, depth - 1);
    out_.rings.points.emplace_back(ideal_middle);
    out_.source.push_back(source);
    add_between(middle, b, ideal_middle, ideal_b, source, depth - 1);
  }

 private:
  bool bent(const Vec2& a, const Vec2& b, const Vec2& ideal_a, const Vec2& ideal_b,
            const Vec2& ideal_middle, int depth) const {
    if (distance_to_segment(ideal_middle, ideal_a, ideal_b) > max_deviation_) return true;
    // A long edge across the optical axis can be bent both ways and straight in its middle.
    if (depth < 6 || glm::length(b - a) < 64.0) return false;
    for (const double t : {0.25, 0.75})
      if (distance_to_segment(lens_.undistort(glm::mix(a, b, t)), ideal_a, ideal_b) >
          max_deviation_)
        return true;
    return false;
  }

  const Lens& lens_;
  double max_deviation_;
  UndistortedRings& out_;
};

}  // namespace

UndistortedRings undistort_rings(const Camera& camera, const Rings& rings, double max_deviation) {
  UndistortedRings out;
  const Lens lens(camera);
  if (!lens.active()) {
    out.rings = rings;
    out.source.resize(rings.points.size());
    std::iota(out.source.begin(), out.source.end(), 0u);
    return out;
  }
  std::vector<Vec2> ideal;
  ideal.reserve(rings.points.size());
  for (const Vec2f& p : rings.points) ideal.push_back(lens.undistort(Vec2(p)));
  out.rings.points.reserve(rings.points.size() * 5 / 4);
  Subdivision subdivision(lens, max_deviation, out);
  std::uint32_t begin = 0;
  for (const std::uint32_t end : rings.ends) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t next = i + 1 == end ? begin : i + 1;
      out.rings.points.emplace_back(ideal[i]);
      out.source.push_back(i);
      subdivision.add_between(Vec2(rings.points[i]), Vec2(rings.points[next]), ideal[i],
                              ideal[next], i, 6);
    }
    begin = end;
    out.rings.ends.push_back(static_cast<std::uint32_t>(out.rings.points.size()));
  }
  return out;
}

}  // namespace polyhull
