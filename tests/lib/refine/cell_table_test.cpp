// SPDX-License-Identifier: LGPL-2.1-or-later
// Marching cubes' table: wherever on their edges the vertices lie, a cell's triangles do not cross,
// and each side of one that is not on a face of the cell has its partner.
#include "refine/field/cell_table.h"

#include <gtest/gtest.h>

#include <map>

#include "base/vector.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::refine {
namespace {

int crossings(std::span<const std::uint8_t> corners, const Vec3 (&points)[12]) {
  int count = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint8_t a = corners[i], b = corners[i % 3 == 2 ? i - 2 : i + 1];
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      bool shared = false;
      for (std::size_t k = t; k < t + 3; ++k) shared |= corners[k] == a || corners[k] == b;
      count += !shared && test::pierces(points[a], points[b], points[corners[t]],
                                        points[corners[t + 1]], points[corners[t + 2]]);
    }
  }
  return count;
}

TEST(CellTable, TrianglesOfACellDoNotCross) {
  test::Dice dice(1);
  for (unsigned corners = 0; corners < 256; ++corners)
    for (int round = 0; round < 2000; ++round) {
      Vec3 points[12];
      for (std::uint8_t e = 0; e < 12; ++e) {
        const CellEdge& edge = cell_table().edge(e);
        points[e] = Vec3(edge.x, edge.y, edge.z);
        points[e][edge.axis] +=
            dice.chance(0.3) ? (dice.chance(0.5) ? 0.01 : 0.99) : dice.between(0.01, 0.99);
      }
      ASSERT_EQ(crossings(cell_table().triangles(corners), points), 0) << corners;
    }
}

TEST(CellTable, SidesHavePartnersWithinTheCell) {
  for (unsigned corners = 0; corners < 256; ++corners) {
    const auto triangles = cell_table().triangles(corners);
    std::map<std::pair<int, int>, int> sides;
    for (std::size_t i = 0; i < triangles.size(); ++i)
      ++sides[{triangles[i], triangles[i % 3 == 2 ? i - 2 : i + 1]}];
    for (const auto& [side, count] : sides) {
      ASSERT_EQ(count, 1) << corners;
      if (sides.count({side.second, side.first})) continue;
      // Then a neighbour has it: both edges are on one face.
      const CellEdge &a = cell_table().edge(static_cast<std::uint8_t>(side.first)),
                     &b = cell_table().edge(static_cast<std::uint8_t>(side.second));
      bool on_face = false;
      for (int axis = 0; axis < 3; ++axis) {
        const int of_a[3] = {a.x, a.y, a.z}, of_b[3] = {b.x, b.y, b.z};
        on_face |= a.axis != axis && b.axis != axis && of_a[axis] == of_b[axis];
      }
      ASSERT_TRUE(on_face) << corners;
    }
  }
}

}  // namespace
}  // namespace polyhull::refine
