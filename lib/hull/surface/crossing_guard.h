// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Whether a new triangle would cross others of the mesh.
///
/// Boxes of all triangles in a binary tree. When a triangle changes, the boxes above it grow.
/// Two triangles cross when an edge of one passes through the inside of the other, by the signs of
/// tetrahedra's volumes; what only touches, or is too near to tell in double precision (coordinates
/// are floats), does not count.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"

namespace polyhull::hull {

using Corners = std::array<std::uint32_t, 3>;

/// Whether the two triangles (indices into \p vertices) cross. Triangles with a common edge do not.
bool triangles_cross(std::span<const Vec3f> vertices, const Corners& a, const Corners& b);

class CrossingGuard {
 public:
  /// \p triangles: three indices into \p vertices each. Both are looked at again in each query.
  void build(std::span<const Vec3f> vertices, std::span<const std::uint32_t> triangles);
  /// The triangle has new corners.
  void update(std::uint32_t triangle);
  /// Whether \p corners cross a triangle for which \p skip is false.
  template <class Skip>
  bool crosses(const Corners& corners, Skip&& skip);

 private:
  struct Box {
    Vec3f low, high;
  };
  struct Node {
    Box box;
    std::uint32_t parent;
    std::uint32_t first, second;  ///< children, or the triangle and `leaf`
  };
  static constexpr std::uint32_t leaf = 0xffffffffu;
  Box box_of(const Corners& corners) const;
  Corners corners_of(std::uint32_t t) const {
    return {triangles_[3 * t], triangles_[3 * t + 1], triangles_[3 * t + 2]};
  }
  std::uint32_t grow_tree(std::uint32_t begin, std::uint32_t end, std::uint32_t parent);
  static bool meet(const Box& a, const Box& b);

  std::span<const Vec3f> vertices_;
  std::span<const std::uint32_t> triangles_;
  std::vector<Node> nodes_;
  std::vector<std::uint64_t> order_;  ///< a place along the curve, and the triangle
  std::vector<std::uint32_t> leaf_of_, stack_;
};

template <class Skip>
bool CrossingGuard::crosses(const Corners& corners, Skip&& skip) {
  if (nodes_.empty()) return false;
  const Box box = box_of(corners);
  stack_.assign(1, 0);
  while (!stack_.empty()) {
    const Node& node = nodes_[stack_.back()];
    stack_.pop_back();
    if (!meet(node.box, box)) continue;
    if (node.second != leaf) {
      stack_.push_back(node.first);
      stack_.push_back(node.second);
    } else if (!skip(node.first) && triangles_cross(vertices_, corners, corners_of(node.first))) {
      return true;
    }
  }
  return false;
}

}  // namespace polyhull::hull
