// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The loops of all faces made into one indexed polygon mesh.
#pragma once

#include <span>
#include <vector>

#include "hull/faces/face_clipper.h"
#include "hull/hull.h"

namespace polyhull::hull {

/// Numbers corners by their planes and finds their places. Memory is kept from call to call.
class Assembler {
 public:
  /// Fills the hull's origin, vertices, faces (without triangles) and loops; \p normals gets the
  /// unit normal of each face, out of the solid.
  void assemble(const ClippingProblem& problem, const Lattice& lattice,
                std::span<const FaceLoops> pieces, Hull& hull, std::vector<Vec3>& normals);

  /// The planes of each vertex of the last hull.
  std::span<const CornerKey> keys() const { return keys_; }

  /// The corner's place on the lattice, from its planes in doubles, or exactly where these meet at
  /// small angles.
  static Vec3 place(const ClippingProblem& problem, const CornerKey& key);

 private:
  std::uint32_t number(const CornerKey& key);
  void grow();
  std::vector<CornerKey> keys_;
  std::vector<std::uint32_t> table_;
  std::vector<Vec3> places_;
};

}  // namespace polyhull::hull
