// SPDX-License-Identifier: LGPL-2.1-or-later
// polyhull-rig level: the world stands on the floor, whatever it was before.
#include "rig/level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "base/error.h"
#include "base/picture.h"
#include "base/rotation.h"
#include "builtin/default_rig.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "mask_contours.h"
#include "rig/check.h"
#include "rig/floor.h"
#include "studio/cameras/camera_picture.h"
#include "studio/figure/figure.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

/// default_rig() in a world that knows no floor: turned, moved, in millimetres.
struct Tilted {
  Frame frame;  ///< from the floor's world, metres, to it, metres
  Rig rig;
  Tilted() {
    const Vec3 x = glm::normalize(Vec3(0.6, -0.5, 0.4)),
               z = glm::normalize(glm::cross(x, Vec3(0.2, 1.0, -0.3)));
    frame = {Mat3(x, glm::cross(z, x), z), Vec3(0.4, -2.0, 7.0)};
    rig = moved_rig(default_rig(), frame);
    rig.up = frame.R * Vec3(0, 1, 0);
    for (Camera& camera : rig.cameras) camera.t *= 1000.0;
    rig.unit = "mm";
  }
  Vec3 there(const Vec3& p) const { return 1000.0 * (frame.R * p + frame.t); }
};

void expect_cameras(const Rig& found, const Rig& truth, double metres) {
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    const Vec3 off =
        found.metres_per_unit() * found.cameras[i].centre() - truth.cameras[i].centre();
    EXPECT_LT(glm::length(off), metres) << i;
    EXPECT_LT(orthonormal_error(found.cameras[i].R), 1e-12);
  }
  EXPECT_EQ(found.up, Vec3(0, 1, 0));
}

std::vector<CameraPictureRings> standing_in(const Rig& rig, double seconds) {
  static const auto figure = open_subject("figure");
  const auto file = (std::filesystem::temp_directory_path() / "polyhull_rig_level.png").string();
  std::vector<CameraPictureRings> pictures;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    CameraPicture drawn(rig, static_cast<int>(i), figure);
    drawn.set_time(seconds);
    Picture picture{camera.width, camera.height, 1, {}};
    picture.pixels.resize(static_cast<std::size_t>(camera.width) * camera.height);
    drawn.matte(picture.row(0), camera.width);
    save_picture(picture, file);
    pictures.push_back({i, contours_of_picture(file, camera, {})});
  }
  return pictures;
}

std::string refused(const Rig& rig, const LevelRequest& request) {
  return test::refusal_of([&] { level_rig(rig, request); });
}

/// The least height of the hull of \p pictures, metres.
double hull_floor(const Rig& rig, const std::vector<CameraPictureRings>& pictures) {
  std::vector<CameraContours> contours;
  for (const auto& picture : pictures)
    contours.push_back({&rig.cameras[picture.camera], &picture.rings});
  HullOptions options;
  options.bounds = rig.bounds;
  HullStage stage;
  const Hull& hull = stage.build(contours, options, 0.0);
  double lowest = INFINITY;
  for (const Vec3f& vertex : hull.vertices)
    lowest = std::min(lowest, glm::dot(glm::normalize(rig.up), hull.origin + Vec3(vertex)));
  return lowest * rig.metres_per_unit();
}

TEST(RigLevel, PointsOfTheFloorMakeTheWorld) {
  const Tilted tilted;
  LevelRequest request;
  // In no order around.
  for (const Vec3& point :
       {Vec3(0.0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(-1, 0, -1), Vec3(1, 0, 1)})
    request.points.push_back(tilted.there(point));
  request.stage = "2.4x2.0x2.3";
  const LevelledRig found = level_rig(tilted.rig, request);
  expect_cameras(found.rig, default_rig(), 1e-9);
  ASSERT_TRUE(found.rig.bounds);
  EXPECT_LT(glm::length(found.rig.bounds->min - Vec3(-1200, 0, -1000)), 1e-9);
  EXPECT_LT(glm::length(found.rig.bounds->max - Vec3(1200, 2300, 1000)), 1e-9);
  EXPECT_EQ(found.rig.unit, "mm");
  EXPECT_TRUE(examine_rig(found.rig).warnings.empty());
  EXPECT_NE(found.text.find("5 points, up to 0.0 mm"), std::string::npos) << found.text;
  EXPECT_NE(found.text.find("cam0           1.4 m above the floor"), std::string::npos)
      << found.text;
}

TEST(RigLevel, UpSaysWhichSideOfThePointsTheRoomIsOn) {
  const Tilted tilted;
  LevelRequest request;
  for (const Vec3& point : {Vec3(0.0), Vec3(1, 0, 0), Vec3(0, 0, 1)})
    request.points.push_back(tilted.there(point));
  request.up = -tilted.rig.up;
  for (const Camera& camera : level_rig(tilted.rig, request).rig.cameras)
    EXPECT_LT(camera.centre().y, -1000.0);
}

TEST(RigLevel, AHeightAlongUpIsEnough) {
  const Tilted tilted;
  LevelRequest request;
  const Vec3 origin = tilted.there(Vec3(0.0));
  request.height = glm::dot(glm::normalize(tilted.rig.up), origin);
  request.origin = origin + 500.0 * tilted.rig.up;
  const LevelledRig found = level_rig(tilted.rig, request);
  const Rig truth = default_rig();
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    const Vec3 a = 0.001 * found.rig.cameras[i].centre(), b = truth.cameras[i].centre();
    EXPECT_NEAR(a.y, b.y, 1e-9);
    EXPECT_NEAR(glm::length(a), glm::length(b), 1e-9);
  }
  // Without an origin it lies below where the cameras look; another unit leaves the lengths.
  request.origin.reset();
  request.unit = "cm";
  const LevelledRig middle = level_rig(tilted.rig, request);
  EXPECT_EQ(middle.rig.unit, "cm");
  EXPECT_NEAR(middle.rig.cameras[0].centre().y, 1400.0, 1e-6);
  EXPECT_NEAR(glm::length(middle.rig.cameras[0].centre() - Vec3(0, 1400, 0)), 3000.0, 30.0);
}

// The hull reaches 2 to 4 cm below the soles, the points that outlines touch do not.
TEST(RigLevel, WhoStandsThereShowsTheFloor) {
  for (const double seconds : {0.0, 2.8, 7.0}) {
    const Tilted tilted;
    LevelRequest request;
    request.standing = standing_in(default_rig(), seconds);
    request.origin = tilted.there(Vec3(0.0));
    const LevelledRig found = level_rig(tilted.rig, request);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(0.001 * found.rig.cameras[i].centre().y, default_rig().cameras[i].centre().y,
                  0.012);
    Rig open = found.rig;
    open.bounds.reset();
    EXPECT_LT(hull_floor(open, request.standing), -0.015);
    EXPECT_GE(hull_floor(found.rig, request.standing), -1e-6);
  }
}

TEST(RigLevel, AMatteWithoutFeetIsNoFloor) {
  std::vector<CameraPictureRings> pictures = standing_in(default_rig(), 0.0);
  for (CameraPictureRings& picture : pictures)
    for (Vec2f& point : picture.rings.points) point.y += 500.0f;
  EXPECT_NE(refused(default_rig(), {{}, {}, pictures, {}, {}, "", ""})
                .find("No two cameras see the lowest"),
            std::string::npos);
}

TEST(RigLevel, RequestsThatSayNothingAreRefused) {
  const Rig rig = default_rig();
  LevelRequest request;
  EXPECT_NE(refused(rig, request).find("in one way, 0 were given"), std::string::npos);
  request.height = 0.0;
  request.points = {Vec3(0.0), Vec3(1, 0, 0), Vec3(2, 0, 0)};
  EXPECT_NE(refused(rig, request).find("in one way, 2 were given"), std::string::npos);
  request.height.reset();
  EXPECT_NE(refused(rig, request).find("lie on a line"), std::string::npos);
  request.points.pop_back();
  EXPECT_NE(refused(rig, request).find("needs 3 points"), std::string::npos);
  request.points.clear();
  request.height = 0.0;
  request.stage = "2x2";
  EXPECT_NE(refused(rig, request).find("--stage is '2x2'"), std::string::npos);
  request.stage = "2x-1x2";
  EXPECT_NE(refused(rig, request).find("--stage"), std::string::npos);
  request.stage.clear();
  request.up = Vec3(0.0);
  EXPECT_NE(refused(rig, request).find("--up must be a direction"), std::string::npos);
  request.up.reset();
  request.unit = "parsec";
  EXPECT_NE(refused(rig, request).find("parsec"), std::string::npos);
}

}  // namespace
}  // namespace polyhull
