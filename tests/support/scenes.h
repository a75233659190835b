// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Scenes made from a seed: rigs, polygons, figures. The same seed gives the same scene on every
/// machine (only std::mt19937_64 and own arithmetic, no std distributions).
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "hull_scene.h"

namespace polyhull::test {

/// Random numbers that do not depend on the standard library's distributions.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double unit() { return double(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  int whole(int low, int high) { return low + static_cast<int>(unit() * (high - low + 1)); }
  bool chance(double share) { return unit() < share; }
  Vec3 direction();

 private:
  std::mt19937_64 engine_;
};

/// A camera at \p centre that looks at \p target, turned by \p roll radians; square pixels, the
/// principal point in the frame's middle.
Camera look_at(const std::string& name, const Vec3& centre, const Vec3& target, double focal,
               int width = 1024, int height = 768, double roll = 0.0);

/// \p count cameras around the origin at a distance of about 4.2 units that see a body of 2 units.
Rig ring_of_cameras(int count, double distance = 4.2);

/// A simple polygon that winds once around \p centre; vertices at multiples of 1/16 px.
std::vector<Vec2f> star(Dice& dice, Vec2 centre, double smallest, double largest, int vertices);

/// Appends \p ring to \p rings.
void add_ring(Rings& rings, const std::vector<Vec2f>& ring);

/// A random region around the pixel \p centre: one to three stars, some with a hole and an island
/// in it.
Rings random_region(Dice& dice, Vec2 centre, double size);

/// Any rings at all: crossing, spiked, doubled, collinear, tiny. Only the even-odd rule makes sense
/// of it.
Rings wild_rings(Dice& dice, int width, int height);

/// 2 to 7 cameras anywhere around the origin with silhouettes of random regions around its image;
/// some seeds give special positions (coincident, collinear, coplanar, opposite, equal directions).
HullScene random_scene(std::uint64_t seed);

/// 2 or 3 cameras in general position that see one small polygon each, some with a hole: few enough
/// planes for brute force.
HullScene tiny_scene(std::uint64_t seed);

/// 2 to 5 cameras in general position with silhouettes of wild_rings().
HullScene wild_scene(std::uint64_t seed);

/// \p cameras around the walking figure at \p time; about 1600 / \p step contour vertices each.
HullScene figure_scene(int cameras, double step, double time = 0.0);

/// \p cameras around the torus knot.
HullScene knot_scene(int cameras, double step);

/// The world of \p scene scaled by \p factor and then moved by \p shift: the same pictures.
HullScene moved(const HullScene& scene, double factor, const Vec3& shift);

}  // namespace polyhull::test
