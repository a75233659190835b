// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene's light on a part of a lattice, and on surfaces there by the way they face and by what bodies
/// leave of it.
///
/// The irradiance of a surface of normal n is the sum, over directions w_i from which light comes that
/// gives E_i to what faces it, of E_i max(0, n.w_i). For what surfaces and the sky send it is kept to the
/// second order of its spherical harmonics, which hold 99 % of it (R. Ramamoorthi and P. Hanrahan, "An
/// efficient representation for irradiance environment maps", 2001):
/// max(0, c) = 1/4 + c/2 + 5/16 (3 c^2 - 1)/2, so that moments are enough,
///   E(n) = 3/8 M + v.n / 2 + 15/32 n.Q n,  v = sum E_i w_i,  Q = sum E_i w_i w_i^T,  M = trace Q / 4,
/// M being the mean over all orientations. A lamp would come out below 0 on what is turned away from it:
/// of each the E_i is kept, which comes from all parts of it alike.
///
/// What bodies hide is found by rays from each place. Of a lamp they go to as many parts of it as it looks
/// large, and it counts what other bodies hide, too. What comes from all sides a body hides from itself: in
/// each of 32 directions w spread evenly over the sphere E(n) loses 4 pi / 32 max(0, n.w) times the radiance
/// that the moments say comes from there, where the body is seen, which sends what it gets itself, albedo / pi
/// times the mean of all light over all orientations.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/vector.h"
#include "render/bodies/body_trees.h"
#include "scene/scene.h"

namespace polyhull {

struct RenderPlan;

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
  /// The radiance from \p way (unit length), of the same order, at least 0.
  Vec3f radiance(const Vec3f& way) const;
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
};

/// Which bodies keep light from a body.
struct Hiding {
  const BodyTrees* trees = nullptr;  ///< null: none does
  std::optional<std::size_t> own;    ///< its own number there; none: it does not
  struct Other {
    std::size_t number;
    Bounds box;
  };
  std::vector<Other> others;  ///< bodies that may hide lamps from it
  float lift = 0.0f;  ///< metres over the surface that rays start from, out of its own facets
};

/// By what the light f of shade is multiplied on surfaces of \p normals (unit length; 0: 1) at \p places
/// (scene coordinates): for \p amount 0 what others leave of the mean over all orientations, for 1 what
/// falls on the surface past all bodies relative to that mean, between them a mix.
std::vector<Vec3f> find_form(const LightLattice& light, std::span<const Vec3f> places,
                             std::span<const Vec3f> normals, float amount, const Hiding& hiding);

/// Sets PlacedSubject::form of those that have PlacedSubject::shade: of relit ones, and of shaded ones that
/// others can stand in the light of. \p trees are those of the frame before, and become this one's. Throws Error as BodyTrees.
void find_forms(RenderPlan& plan, BodyTrees& trees);

}  // namespace polyhull
