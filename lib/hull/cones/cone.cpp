// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/cones/cone.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "hull/cones/clean_region.h"
#include "hull/cones/simple_rings.h"
#include "hull/cones/view_contours.h"

namespace polyhull::hull {
namespace {

Plane plane_through(const IntVec& u, const IntVec& v) {
  Plane p;
  p.a = static_cast<Int128>(u[1]) * v[2] - static_cast<Int128>(u[2]) * v[1];
  p.b = static_cast<Int128>(u[2]) * v[0] - static_cast<Int128>(u[0]) * v[2];
  p.c = static_cast<Int128>(u[0]) * v[1] - static_cast<Int128>(u[1]) * v[0];
  return p;
}

Vec3 unit_normal(const Plane& p) {
  const Vec3 n(static_cast<double>(p.a), static_cast<double>(p.b), static_cast<double>(p.c));
  const double length = glm::length(n);
  return length > 0 ? n / length : Vec3(0.0);
}

/// Where rounding a ray moves its pixel by more, the ray's own pixel is taken, which fits it 2^11
/// times better: as well as doubles can tell.
constexpr double coarse_pixels = 1e-6;
constexpr double own_pixel_error = 0x1p-11;

/// Pictures whose rays fit their pixels less well are refused: the grid over the pixels, and what
/// is decided there, would not hold for the rays. (At 1,000 px focal length that is a point 15
/// million px away.)
constexpr double largest_pixel_error = 0.1 * grid_margin;
/// The same of rays that are less deep than this, of 2^38 units: at 2^-18 to right angles.
constexpr double least_depth = 0x1p20;

/// The power of two that brings every ray below 2^38, a bit in reserve.
double ray_scale(const Contours& contours, const Mat3& to_ray) {
  double largest = 1e-300;
  for (const Vec2& p : contours.points) {
    const Vec3 d = glm::abs(to_ray * Vec3(p, 1.0));
    largest = std::max({largest, d.x, d.y, d.z});
  }
  return std::ldexp(1.0, 38 - std::ilogb(largest) - 1);
}

/// Fills the cone's rings from contours, without repeated and straight vertices.
class ConeBuilder {
 public:
  ConeBuilder(Cone& cone, const Contours& contours) : cone_(cone), contours_(contours) {}

  /// False: the rings are not simple and disjoint (cone is unfinished).
  bool build(bool clean) {
    clean_ = clean;
    rings();
    if (folded_) return false;
    if (!clean)
      orient();
    else if (glm::determinant(cone_.camera.to_ray) < 0)
      for (std::uint32_t r = 0; r < cone_.rings; ++r) reverse(begins_[r], begins_[r + 1]);
    cone_.grid.build(cone_.pixels, cone_.next, cone_.pixel_error);
    if (!are_simple(cone_, clean)) return false;
    finish();
    return true;
  }

  /// Of a cone that was built: whether a whole-numbered axis has all rays before it.
  bool all_in_front() const { return all_in_front_; }

 private:
  void rings() {
    Cone& c = cone_;
    c.pixels.clear(), c.rays.clear(), c.next.clear(), c.previous.clear(), c.ring.clear();
    c.source.clear(), c.source_view.clear(), c.planes.clear(), c.normals.clear();
    c.rings = 0;
    const double scale = ray_scale(contours_, c.camera.to_ray);
    std::uint32_t begin = 0;
    for (std::uint32_t end : contours_.ends) {
      points_.clear();
      for (std::uint32_t i = begin; i < end; ++i) {
        const Vec3 d = c.camera.to_ray * Vec3(contours_.points[i], 1.0) * scale;
        const IntVec ray{std::llrint(d.x), std::llrint(d.y), std::llrint(d.z)};
        // A repeated point gives way to the later one, whose edge is the real one.
        if (!points_.empty() && points_.back().ray == ray) points_.pop_back();
        points_.push_back({contours_.points[i], ray, contours_.source[i], contours_.view[i]});
      }
      while (points_.size() > 1 && points_.front().ray == points_.back().ray) points_.pop_back();
      straighten();
      if (points_.size() >= 3) append();
      begin = end;
    }
    begins_.clear();
    for (std::uint32_t i = 0; i < c.size(); ++i)
      if (c.ring[i] == begins_.size()) begins_.push_back(i);
    begins_.push_back(static_cast<std::uint32_t>(c.size()));
  }

  /// Takes out vertices on the straight line between their neighbours; notes folds.
  void straighten() {
    for (bool again = true; again && points_.size() >= 3;) {
      again = false;
      std::size_t kept = 0;
      for (std::size_t i = 0; i < points_.size(); ++i) {
        const Point& v = points_[i];
        const Point& u = kept > 0 ? points_[kept - 1] : points_.back();
        const Point& w = i + 1 < points_.size() ? points_[i + 1] : points_.front();
        const Plane plane = plane_through(u.ray, v.ray);
        // Straight in the picture counts, too: rounding the rays bends it by a hair, and the ray of
        // such a bend is where two planes meet at no angle to speak of. (Clean rings keep theirs:
        // another ring may touch there.)
        const Vec2 before = v.pixel - u.pixel, after = w.pixel - v.pixel;
        const bool straight = !clean_ && before.x * after.y == before.y * after.x;
        if (!straight && dot(plane, w.ray) != 0) {
          points_[kept++] = v;
          continue;
        }
        if (glm::dot(v.pixel - u.pixel, w.pixel - v.pixel) <= 0) folded_ = true;
        again = true;
        if (folded_) return;
      }
      points_.resize(kept);
    }
  }

  void append() {
    Cone& c = cone_;
    const std::uint32_t base = static_cast<std::uint32_t>(c.rays.size());
    const std::uint32_t n = static_cast<std::uint32_t>(points_.size());
    for (std::uint32_t i = 0; i < n; ++i) {
      const Point& p = points_[i];
      c.pixels.push_back(c.own_pixels ? pixel_of(p.ray) : p.pixel);
      c.rays.push_back(p.ray);
      c.next.push_back(base + (i + 1) % n);
      c.previous.push_back(base + (i + n - 1) % n);
      c.ring.push_back(c.rings);
      c.source.push_back(p.source);
      c.source_view.push_back(p.view);
      c.planes.push_back(plane_through(p.ray, points_[(i + 1) % n].ray));
      c.normals.push_back(unit_normal(c.planes.back()));
    }
    ++c.rings;
  }

  Vec2 pixel_of(const IntVec& ray) const {
    const Vec3 q = cone_.camera.to_pixel * real(ray);
    return Vec2(q) / q.z;
  }

  /// Turns rings so that the region lies on the positive side of each plane.
  void orient() {
    Cone& c = cone_;
    for (std::uint32_t r = 0; r < c.rings; ++r) {
      std::uint32_t lowest = begins_[r];
      for (std::uint32_t i = begins_[r]; i < begins_[r + 1]; ++i)
        if (c.pixels[i].y < c.pixels[lowest].y ||
            (c.pixels[i].y == c.pixels[lowest].y && c.pixels[i].x < c.pixels[lowest].x))
          lowest = i;
      const int turn = side_of(c, c.previous[lowest], c.next[lowest]);
      const Vec2 p = c.pixels[lowest];
      bool outer = true;
      for (std::uint32_t i = 0; i < c.size() && c.rings > 1; ++i) {
        if (c.ring[i] == r) continue;
        const Vec2 a = c.pixels[i], b = c.pixels[c.next[i]];
        if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x)
          outer = !outer;
      }
      const bool positive = turn > 0;
      if (positive != (outer != c.complement)) reverse(begins_[r], begins_[r + 1]);
    }
  }

  void reverse(std::uint32_t begin, std::uint32_t end) {
    Cone& c = cone_;
    const auto turn = [&](auto& values) {
      std::reverse(values.begin() + begin, values.begin() + end);
    };
    turn(c.pixels), turn(c.rays);
    // Edges now begin at what was their end: shift them by one against the vertices.
    const auto shift = [&](auto& values) {
      turn(values);
      std::rotate(values.begin() + begin, values.begin() + begin + 1, values.begin() + end);
    };
    shift(c.source), shift(c.source_view), shift(c.planes), shift(c.normals);
    for (std::uint32_t i = begin; i < end; ++i) {
      Plane& p = c.planes[i];
      p.a = -p.a, p.b = -p.b, p.c = -p.c;
      c.normals[i] = -c.normals[i];
    }
  }

  void finish() {
    Cone& c = cone_;
    c.turn.resize(c.size());
    for (std::uint32_t i = 0; i < c.size(); ++i)
      c.turn[i] = static_cast<std::int8_t>(side_of(c, c.previous[i], c.next[i]));
    const Int128 x = c.centre[0], y = c.centre[1], z = c.centre[2];
    for (Plane& p : c.planes) p.o = -(p.a * x + p.b * y + p.c * z);
    choose_axis();
  }

  /// A forward direction with a little noise of its own, so that the focal planes of different
  /// cameras never run parallel or through each other's centres by construction of the rig.
  void choose_axis() {
    Cone& c = cone_;
    std::uint64_t h = 0x9e3779b97f4a7c15u;
    const auto mix = [&](std::int64_t v) {
      h = (h ^ static_cast<std::uint64_t>(v)) * 0xbf58476d1ce4e5b9u;
      h ^= h >> 29;
    };
    for (std::int64_t v : c.centre) mix(v);
    for (int k = 0; k < 3; ++k) mix(std::llrint(c.camera.forward[k] * 1048576.0));
    IntVec noisy;
    for (int k = 0; k < 3; ++k) {
      mix(k);
      const std::int64_t noise = static_cast<std::int64_t>(h >> 50) - 8192;
      c.axis[k] = std::llrint(c.camera.forward[k] * 1048576.0);
      noisy[k] = c.axis[k] + noise;
    }
    const auto in_front = [&](const IntVec& axis) {
      const Plane plane{axis[0], axis[1], axis[2]};
      return std::all_of(c.rays.begin(), c.rays.end(),
                         [&](const IntVec& d) { return dot(plane, d) > 0; });
    };
    if (in_front(noisy)) c.axis = noisy;
    all_in_front_ = in_front(c.axis);
  }

  struct Point {
    Vec2 pixel;
    IntVec ray;
    std::uint32_t source;
    std::int32_t view;
  };
  Cone& cone_;
  const Contours& contours_;
  std::vector<Point> points_;
  std::vector<std::uint32_t> begins_;  // first vertex of each ring, and the end
  bool clean_ = false;
  bool folded_ = false;
  bool all_in_front_ = true;  // Cone::axis is what it should be
};

/// How far rounding moves pixels. A ray of the depth \p scale, which is the pixel's homogeneous
/// coordinate, is off by half a unit in each component.
void measure_pixels(Cone& cone, std::span<const Contours> layers) {
  const Mat3& m = cone.camera.to_pixel;
  const auto row = [&](int k) { return glm::length(Vec3(m[0][k], m[1][k], m[2][k])); };
  cone.pixel_scale = std::max(row(0), row(1)), cone.depth_scale = row(2);
  cone.pixel_error = 0.0;
  for (const Contours& layer : layers) {
    double furthest = 0.0;
    for (const Vec2& p : layer.points)
      furthest = std::max({furthest, std::abs(p.x), std::abs(p.y)});
    const double scale = ray_scale(layer, cone.camera.to_ray);
    const double error = scale < least_depth * cone.depth_scale
                             ? 1e300
                             : (cone.pixel_scale + furthest * cone.depth_scale) / scale;
    if (!layer.points.empty()) cone.pixel_error = std::max(cone.pixel_error, error);
  }
  cone.own_pixels = cone.pixel_error > coarse_pixels;
  if (cone.own_pixels) cone.pixel_error *= own_pixel_error;
}

}  // namespace

void build_cone(Cone& cone, std::span<const ConeInput> inputs, const Lattice& lattice,
                Unseen unseen) {
  cone.camera = *inputs[0].camera;
  cone.centre = lattice_centre(cone.camera, lattice);
  for (int k = 0; k < 3; ++k) cone.centre_real[k] = static_cast<double>(cone.centre[k]);
  cone.complement = unseen == Unseen::keep;
  cone.input_vertices = 0;
  std::vector<Contours> layers;
  for (const ConeInput& input : inputs) {
    layers.push_back(view_contours(input, cone.camera, cone.complement));
    cone.input_vertices += static_cast<std::uint32_t>(input.silhouette->rings->points.size());
  }
  const auto refuse_unless = [&](bool possible) {
    if (!possible)
      throw Error(Error::Kind::unsupported,
                  "The silhouette of camera '{}' reaches too far to the side for its focal length "
                  "(rays almost at right angles to the view): check K in the rig, and that the "
                  "contours are in its pixels.",
                  inputs[0].silhouette->camera->name);
  };
  measure_pixels(cone, layers);
  refuse_unless(cone.pixel_error < largest_pixel_error);
  const auto build = [&](const Contours& contours, bool clean) {
    ConeBuilder builder(cone, contours);
    const bool built = builder.build(clean);
    refuse_unless(!built || builder.all_in_front());
    return built;
  };
  if (layers.size() == 1 && build(layers[0], false)) return;
  for (double step = 1.0; step < 1e6; step *= 8.0)
    if (build(clean_region(layers, cone.complement, step), true)) return;
  throw Error(Error::Kind::unsupported,
              "The silhouette of camera '{}' could not be made into simple rings; look at its "
              "contours, and at K in the rig.",
              inputs[0].silhouette->camera->name);
}

}  // namespace polyhull::hull
