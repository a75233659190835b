// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One face of the hull: what of a cone's face, or of the bounds', lies inside all other cones.
///
/// The face starts as the strip between its two rays, from the far to the near plane
/// (face_chart.h), and is cut by one cone after the other: those that may have edges on it
/// (cone_view.h) cut its loops (loop_cutter.h). All of it rests on one predicate, on which side of
/// a plane a corner lies: in doubles with an error bound first, else exactly by
/// PlaneSet::orientation.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hull/faces/loop_cutter.h"

namespace polyhull::hull {

/// The loops of faces; corners by their three planes in rising order. A cone's apex is (cone, ring,
/// apex_mark).
using CornerKey = std::array<std::uint32_t, 3>;
inline constexpr std::uint32_t apex_mark = 0xffffffffu;
/// Equality without the call to memcmp() that == of arrays is.
inline bool same(const CornerKey& a, const CornerKey& b) {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

struct FaceLoops {
  std::vector<CornerKey> corners;
  std::vector<std::uint32_t> loop_ends;  ///< into corners
  std::vector<std::uint32_t> faces;      ///< numbers of faces that have loops
  std::vector<std::uint32_t> face_ends;  ///< into loop_ends
  std::uint64_t predicates = 0, exact = 0, broken = 0;
  void clear() {
    corners.clear(), loop_ends.clear(), faces.clear(), face_ends.clear();
    predicates = exact = broken = 0;
  }
};

/// Clips faces and keeps the memory. For one thread.
class FaceClipper {
 public:
  /// Before the first face of \p problem, which must stay alive.
  void begin(const ClippingProblem& problem);

  /// Appends the loops of the faces [begin, end), seen counter-clockwise from outside. The result
  /// depends on the block only, not on what was clipped before.
  void clip(std::uint32_t begin, std::uint32_t end, FaceLoops& out);

 private:
  struct Loop {
    Extent extent;
    std::uint32_t begin, end;
  };

  void start();
  void cut_by_box();
  void cut_by_cones(const std::vector<std::uint32_t>& order);
  bool cut_part(std::size_t part);
  void divide(std::size_t part);
  void to_front(std::vector<std::uint32_t>& order);
  CornerKey key_of(const Corner& corner) const;
  void emit(FaceLoops& out);

  FaceChart chart_;
  ConeView view_{chart_};
  LoopCutter cutter_{chart_, view_};
  std::vector<Part> parts_;  ///< the first part_count_ are in use
  std::size_t part_count_ = 0;
  std::vector<std::uint32_t> order_, new_order_;
  std::vector<std::uint8_t> bounds_face_;  ///< of each cone, whether the last face has its planes
  std::vector<Loop> loops_;
  std::vector<Node> divided_;
};

}  // namespace polyhull::hull
