// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What all faces of one hull share: the cones in their canonical order and the planes by number.
///
/// Numbers of planes: the cones' faces one cone after the other (a face's number is its plane's),
/// six faces of the box (-x +x -y +y -z +z), the plane at infinity, and for each cone a near and a
/// far plane that bound the part of it where the hull can be.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hull/cones/cone.h"
#include "hull/exact/planes.h"

namespace polyhull::hull {

/// The cones, their planes, and what limits them; coordinates are the lattice's.
struct ClippingProblem {
  std::vector<const Cone*> cones;
  std::vector<std::uint32_t> first_face;  ///< of each cone, and one past the last
  PlaneSet set;
  std::array<double, 6> box{};       ///< min and max per axis on the lattice, whole numbers
  std::array<bool, 6> box_active{};  ///< which of its faces may touch the hull
  std::vector<double> near, far;     ///< along each cone's axis; near 0: from the centre on
  std::vector<double> reach;  ///< from each cone's centre to the furthest of what its faces meet
  /// For each cone the others, the most telling first.
  std::vector<std::vector<std::uint32_t>> order;
  std::vector<std::uint32_t> box_order;  ///< all cones, for the box
  Vec3 low{0.0}, high{0.0};              ///< a box around the hull

  /// Sets up everything but the cones themselves. \p limits is the bounds or the working box in the
  /// lattice. False if the hull is certainly empty.
  bool set_up(std::span<const Cone* const> all, const std::array<double, 6>& limits);

  std::uint32_t cone_faces() const { return first_face.back(); }
  std::uint32_t box_face(int k) const { return cone_faces() + static_cast<std::uint32_t>(k); }
  std::uint32_t infinity() const { return cone_faces() + 6; }
  std::uint32_t near_plane(std::uint32_t cone) const { return cone_faces() + 7 + 2 * cone; }
  std::uint32_t far_plane(std::uint32_t cone) const { return cone_faces() + 8 + 2 * cone; }
  std::uint32_t face_count() const { return cone_faces() + 6; }
};

}  // namespace polyhull::hull
