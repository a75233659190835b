// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene's light on a part of a lattice, and on surfaces there by the way they face.
///
/// The irradiance of a surface of normal n is the sum, over directions w_i from which light comes that
/// gives E_i to what faces it, of E_i max(0, n.w_i). For what surfaces and the sky send it is kept to the
/// second order of its spherical harmonics, which hold 99 % of it (R. Ramamoorthi and P. Hanrahan, "An
/// efficient representation for irradiance environment maps", 2001):
/// max(0, c) = 1/4 + c/2 + 5/16 (3 c^2 - 1)/2, so that moments are enough,
///   E(n) = 3/8 M + v.n / 2 + 15/32 n.Q n,  v = sum E_i w_i,  Q = sum E_i w_i w_i^T,  M = trace Q / 4,
/// M being the mean over all orientations. A lamp would come out below 0 on what is turned away from it:
/// of each the E_i is kept, which comes from all parts of it alike.
#pragma once

#include <array>
#include <vector>

#include "base/vector.h"
#include "scene/scene.h"

namespace polyhull {

struct PlacedSubject;

/// v and Q, by channel.
struct LightMoments {
  std::array<Vec3f, 3> first{};   ///< v's x, y, z
  std::array<Vec3f, 6> second{};  ///< Q's xx, yy, zz, xy, yz, zx

  /// Adds light from \p way (unit length) that gives a surface which faces it \p irradiance.
  void add(const Vec3f& way, const Vec3f& irradiance);
  /// Adds light from all sides alike that gives \p irradiance.
  void add_even(const Vec3f& irradiance);
  void add(const LightMoments& other, float share);
  /// M.
  Vec3f mean() const { return 0.25f * (second[0] + second[1] + second[2]); }
  /// E at a surface of \p normal (unit length), at least 0.
  Vec3f irradiance(const Vec3f& normal) const;
};

/// f (subject_light.h) at the nodes of a part of the lattice, x fastest, and what it is made of.
struct LightLattice {
  Vec3f origin{0.0f};         ///< the first node, scene coordinates
  float cell = 1.0f;          ///< metres from node to node
  std::array<int, 3> size{};  ///< nodes, at least 2 each
  std::vector<Vec3f> factors;
  std::vector<Light> lamps;
  std::vector<LightMoments> indirect;
  std::vector<float> direct;  ///< by node and lamp: what faces it gets, per power

  /// f at \p point, in cells from the first node; beyond the lattice as at its border.
  Vec3f at(const Vec3f& point) const;
  /// How many times the mean over all orientations a surface of \p normal (unit length) at \p point, as
  /// of at(), gets.
  Vec3f form_at(const Vec3f& point, const Vec3f& normal) const;
};

/// form_at() at each vertex of the subject's mesh: 1 where \p amount is 0, all of it where it is 1. Of
/// an image-based subject it is empty.
std::vector<Vec3f> find_form(const PlacedSubject& subject, const LightLattice& light, float amount);

}  // namespace polyhull
