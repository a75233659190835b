// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene's light where subjects are, relative to the stage's middle: SubjectLighting::shade.
///
/// A subject's pictures hold the light of the studio, which is even and has shaded the body already. In
/// the scene it is as much darker, lighter or more coloured as the scene's light is at its place:
///   f(x) = Phi(x) / Phi_0(x_0), by channel, at most 4,
/// Phi the irradiance of a surface at x, averaged over all its orientations (a quarter of the fluence
/// rate), so that f has no part in the body's own shading:
///   Phi(x) = sum over lights of mean over their places p of V(x, p) I(p, x) / (4 |x - p|^2)
///            + pi times the mean over all directions of L_1 + E_rest
/// V 1 where nothing of the scene lies between and else 0, I what the light would send from p towards x
/// (W/sr), L_1 what the surface seen from x scatters of the lights (one bounce, as scenesrc has it) or the
/// sky, E_rest by how much the announced ambient light is more than the second term at x_0, and x_0 a metre
/// above the scene's origin. Phi_0 is Phi with the lights undimmed (RenderFrame::undimmed), E_rest in
/// proportion to the second term, so that who dims or colours a lamp does it to the subject, too. Where nearly all that is seen from x are backs of surfaces, x lies within a body
/// (furniture), and the nearest place out of it counts.
///
/// Phi is found at the nodes of a lattice that is fixed in the scene and kept there, so that a subject
/// that walks asks for few new ones, and one that stands still for none of its lattice; between nodes f is linear. Below half a cell over a subject's lowest
/// point, where nodes may lie under the floor, f goes on as it does above.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/frame.h"
#include "render/light_lattice.h"

namespace polyhull {

class TracedScene;

class SubjectLight {
 public:
  /// f around \p subject (its points, scene coordinates); null where nothing lights the stage. Throws
  /// Error as RayCaster.
  std::shared_ptr<const LightLattice> around(const PlacedSubject& subject, const RenderFrame& frame,
                                             const TracedScene& scene);

  /// Phi_0(x_0) of the last call.
  const Vec3f& stage() const { return stage_; }

  /// How many nodes the last call had to find.
  std::size_t found() const { return found_; }

 private:
  using Node = std::array<int, 4>;  // of the lattice, and which of its cell lengths
  struct Hash {
    std::size_t operator()(const Node& node) const;
  };
  struct Found {
    Vec3f factor;
    LightMoments indirect;
    std::vector<float> direct;
  };
  /// The nodes that a subject asks for.
  struct Part {
    std::array<int, 3> first{}, size{};
    int floor = 0;    // the lowest layer that is found
    int doubled = 0;  // how often the cell's length is
    bool operator==(const Part&) const = default;
  };
  static Part part_around(const Bounds& box);
  LightLattice lattice(const Part& part, const RenderFrame& frame, const TracedScene& scene);

  std::shared_ptr<const Scene> scene_;
  std::vector<Light> lights_, undimmed_;
  Vec3f ambient_{0.0f}, sky_{0.0f};
  std::optional<Vec3f> undimmed_sky_;
  // Whether surfaces that show their backs enclose bodies: not in a room that itself shows them.
  bool bodies_ = true;
  Vec3f rest_{0.0f}, stage_{0.0f};  // E_rest, Phi_0(x_0)
  std::unordered_map<Node, Found, Hash> nodes_;
  std::vector<std::pair<Part, std::shared_ptr<const LightLattice>>> lattices_;  // the latest first
  std::size_t found_ = 0;
};

}  // namespace polyhull
