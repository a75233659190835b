// SPDX-License-Identifier: LGPL-2.1-or-later
// Sizes in metres of what hangs together, and which of them no subject has.
#include "hull/subject_size.h"

#include <gtest/gtest.h>

#include "rig/rig.h"

namespace polyhull {
namespace {

void add_box(Hull& hull, const Vec3& middle, const Vec3& size) {
  const auto first = static_cast<std::uint32_t>(hull.vertices.size());
  for (int i = 0; i < 8; ++i)
    hull.vertices.emplace_back(
        Vec3f(middle + 0.5 * size * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  for (const std::uint32_t corner : {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                     2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5})
    hull.triangles.push_back(first + corner);
  HullFace face;
  face.view = 0;
  hull.faces.push_back(face);
}

/// Cameras at \p distance to four sides, by a rig of so many metres per unit.
SubjectSize size_of(const Hull& hull, double distance, double metres = 1.0, bool bounded = true) {
  const Vec3 centres[] = {Vec3(distance, 0, 0), Vec3(-distance, 0, 0), Vec3(0, 0, distance),
                          Vec3(0, 0, -distance)};
  return subject_size(hull, centres, Vec3(0, 2, 0), metres, bounded);
}

TEST(SubjectSize, IsInMetres) {
  Hull hull;
  add_box(hull, Vec3(0.0), Vec3(40, 160, 30));
  const SubjectSize size = size_of(hull, 300.0, 0.01);
  EXPECT_TRUE(size.known);
  EXPECT_NEAR(size.height, 1.6, 1e-6);
  EXPECT_NEAR(size.extent, 1.6, 1e-6);
  EXPECT_NEAR(size.distance, 3.0, 1e-6);
  EXPECT_FALSE(is_implausible(size));
}

TEST(SubjectSize, IsUnknownWhereNothingEndsTheHull) {
  EXPECT_FALSE(size_of(Hull(), 3.0).known);
  Hull hull;
  add_box(hull, Vec3(0.0), Vec3(0.4, 9000.0, 0.4));
  hull.faces[0].view = -1;
  EXPECT_FALSE(size_of(hull, 3.0, 1.0, false).known);
  EXPECT_FALSE(is_implausible(size_of(hull, 3.0, 1.0, false)));
  EXPECT_TRUE(is_implausible(size_of(hull, 3.0, 1.0, true)));
}

TEST(SubjectSize, WrongUnitsAreImplausible) {
  Hull person;
  add_box(person, Vec3(0.0), Vec3(0.5, 1.7, 0.3));
  for (const double wrong : {1000.0, 100.0, 39.37, 10.0, 3.281, 0.01, 0.001})
    EXPECT_TRUE(is_implausible(size_of(person, 3.0, wrong))) << wrong;
  // A doll's.
  for (const double right : {1.0, 0.1}) EXPECT_FALSE(is_implausible(size_of(person, 3.0, right)));
}

TEST(SubjectSize, SeveralSubjectsAreNotOneLargeOne) {
  Hull crowd;
  for (int i = 0; i < 9; ++i) add_box(crowd, Vec3(2.0 * i, 0.0, 0.0), Vec3(0.5, 1.7, 0.3));
  add_box(crowd, Vec3(1.0, 8.0, 1.0), Vec3(0.2, 0.2, 0.2));  // a ball that they have thrown
  const SubjectSize size = size_of(crowd, 20.0);
  EXPECT_NEAR(size.height, 8.95, 1e-5);
  EXPECT_NEAR(size.part, 1.7, 1e-5);
  EXPECT_NEAR(size.extent, 1.7, 1e-5);
  EXPECT_FALSE(is_implausible(size));
}

TEST(SubjectSize, TheLikeliestUnitIsNamed) {
  SubjectSize size{true, 17.0, 17.0, 17.0, 30.0};
  const std::string text = about_size(size, "cm");
  for (const char* part : {"17 m high", "30 m away", "unit is cm", "in mm", "1.7 m high"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " not in: " << text;
  // Where no other unit fits better none is named.
  size.distance = 4.0;
  EXPECT_EQ(about_size(size, "m").find("\"unit\""), std::string::npos);
}

}  // namespace
}  // namespace polyhull
