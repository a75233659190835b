// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/garbage_matte.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/error.h"
#include "builtin/default_rig.h"
#include "rig/rig.h"

namespace polyhull {
namespace {

TEST(GarbageMatte, PolygonsAreRead) {
  const Rings rings = parse_polygons(" 1,2 3.5,4\t-5,6.25 ;; 0,0 10,0 10,10 0,10;");
  ASSERT_EQ(rings.size(), 2u);
  EXPECT_EQ(rings.ring(0).size(), 3u);
  EXPECT_EQ(rings.ring(0)[1], Vec2f(3.5f, 4.0f));
  EXPECT_EQ(rings.ring(0)[2], Vec2f(-5.0f, 6.25f));
  EXPECT_EQ(rings.ring(1).size(), 4u);
  EXPECT_TRUE(parse_polygons("").empty());
  EXPECT_TRUE(parse_polygons(" ; ").empty());
}

TEST(GarbageMatte, WrongPolygonsAreRefused) {
  for (const char* text :
       {"1,2 3,4", "1,2 3,4 five,6", "1 2 3 4 5 6", "1,2 3,4 nan,5", "1,2 3,4 inf,5", "1,2 3,4 5,",
        "1,2 3,4 5,6x", "1,2 3,4 2000000,6", "1,2 3,4 5,6; 1,1"}) {
    EXPECT_THROW(parse_polygons(text), Error) << text;
  }
}

/// Whether the ray through the real pixel meets the box in front of the camera.
bool ray_meets(const Camera& camera, const Bounds& bounds, const Vec2& real) {
  const Vec3 origin = camera.centre();
  const Vec3 direction = camera.ray(camera.undistort(real));
  double from = 0.0;
  double to = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (bounds.min[axis] - origin[axis]) / direction[axis];
    const double b = (bounds.max[axis] - origin[axis]) / direction[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from < to;
}

/// Pixels where the mask of the outline and the rays disagree, of all pixels looked at.
double disagreement(const Camera& camera, const Bounds& bounds) {
  const int step = camera.has_distortion() ? 4 : 1;  // undistorting every pixel takes seconds
  const Picture mask =
      polygon_mask(bounds_outline(camera, bounds), camera.width, camera.height, false);
  int wrong = 0;
  for (int y = 0; y < camera.height; y += step) {
    for (int x = 0; x < camera.width; x += step) {
      wrong += (mask.row(y)[x] != 0) != ray_meets(camera, bounds, Vec2(x, y));
    }
  }
  return static_cast<double>(wrong) * step * step / (camera.width * camera.height);
}

TEST(GarbageMatte, OutlineOfTheBoundsIsWhereRaysMeetThem) {
  const Rig rig = default_rig();
  for (Camera camera : rig.cameras) {
    EXPECT_EQ(disagreement(camera, *rig.bounds), 0.0) << camera.name;
    camera.distortion = {-0.25, 0.06, 0.001, -0.002};
    EXPECT_LE(disagreement(camera, *rig.bounds), 5e-5) << camera.name << " with distortion";
  }
}

TEST(GarbageMatte, BoxThatReachesBehindTheCamera) {
  const Rig rig = default_rig();
  const Camera& camera = rig.cameras[0];
  Bounds wide = *rig.bounds;
  // The camera stands outside, but the floor slab passes below it and behind it.
  wide.min = camera.centre() - Vec3(20.0, 2.5, 20.0);
  wide.max = camera.centre() + Vec3(20.0, -0.5, 20.0);
  EXPECT_LE(disagreement(camera, wide), 1e-5);
}

TEST(GarbageMatte, CameraInsideTheBoxRulesNothingOut) {
  const Rig rig = default_rig();
  const Vec3 centre = rig.cameras[1].centre();
  EXPECT_TRUE(bounds_outline(rig.cameras[1], {centre - Vec3(1.0), centre + Vec3(1.0)}).empty());
}

TEST(GarbageMatte, BoxBehindTheCameraRulesEverythingOut) {
  const Rig rig = default_rig();
  const Camera& camera = rig.cameras[2];
  const Vec3 behind = camera.centre() * 2.0;
  const Rings outline = bounds_outline(camera, {behind - Vec3(0.5), behind + Vec3(0.5)});
  ASSERT_FALSE(outline.empty());
  const Picture mask = polygon_mask(outline, camera.width, camera.height, false);
  for (const std::uint8_t value : mask.pixels) ASSERT_EQ(value, 0);
}

TEST(GarbageMatte, MaskIsEvenOddAtPixelCentres) {
  const Rings rings =
      parse_polygons("0.5,0.5 6.5,0.5 6.5,6.5 0.5,6.5; 2.5,2.5 4.5,2.5 4.5,4.5 2.5,4.5");
  const Picture mask = polygon_mask(rings, 8, 8, false);
  const Picture inverted = polygon_mask(rings, 8, 8, true);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const bool outer = x >= 1 && x <= 6 && y >= 1 && y <= 6;
      const bool hole = x >= 3 && x <= 4 && y >= 3 && y <= 4;
      EXPECT_EQ(mask.row(y)[x] != 0, outer && !hole) << x << "," << y;
      EXPECT_NE(mask.row(y)[x], inverted.row(y)[x]);
    }
  }
}

}  // namespace
}  // namespace polyhull
