// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/board_guide.h"

#include <gtest/gtest.h>

namespace polyhull::calibration {
namespace {

std::vector<TakeCamera> cameras() {
  return {{"a", 1600, 900, {}}, {"b", 1600, 900, {}}};
}

/// A flat grid of 5x4 corners with its middle at (x, y), \p side px from corner to corner.
View grid(std::size_t camera, double x, double y, double side) {
  View view;
  view.camera = camera;
  for (int i = 0; i < 20; ++i) {
    view.ids.push_back(i);
    view.corners.emplace_back(x + side * (i % 5 - 2), y + side * (i / 5 - 1.5));
  }
  return view;
}

TEST(BoardGuide, KeepsWhatIsNew) {
  BoardGuide guide(cameras(), {});
  EXPECT_TRUE(guide.add({grid(0, 800, 450, 50)}));
  EXPECT_FALSE(guide.add({grid(0, 810, 455, 51)}));
  EXPECT_TRUE(guide.add({grid(0, 900, 450, 50)}));  // elsewhere
  EXPECT_TRUE(guide.add({grid(0, 800, 450, 90)}));  // nearer
  View slanted = grid(0, 800, 450, 50);
  for (Vec2& corner : slanted.corners) corner.y += 0.8 * (corner.x - 800.0);
  EXPECT_TRUE(guide.add({slanted}));
  EXPECT_FALSE(guide.add({slanted}));
  EXPECT_EQ(guide.views(0), 4u);
  EXPECT_EQ(guide.views(1), 0u);
  // An old place, but together with another camera.
  EXPECT_TRUE(guide.add({grid(0, 800, 450, 50), grid(1, 300, 300, 50)}));
  EXPECT_EQ(guide.instants(), 5u);
  EXPECT_FALSE(guide.add({}));
  EXPECT_FALSE(guide.add({View{}}));
}

TEST(BoardGuide, SaysWhereToHoldTheBoard) {
  BoardGuide guide(cameras(), {3, 0.8, 2});
  EXPECT_EQ(guide.coverage(0), 0.0);
  EXPECT_FALSE(guide.wish(0).empty());
  // All but the lower right.
  for (const Vec2 at : {Vec2(260, 150), Vec2(800, 150), Vec2(1340, 150), Vec2(260, 450),
                        Vec2(800, 450), Vec2(1340, 450), Vec2(260, 750), Vec2(800, 750)})
    EXPECT_TRUE(guide.add({grid(0, at.x, at.y, 100)}));
  EXPECT_TRUE(guide.covered(0, 0, 0));
  EXPECT_FALSE(guide.covered(0, 15, 8));
  EXPECT_EQ(guide.next_place(0).column, 2);
  EXPECT_EQ(guide.next_place(0).row, 2);
  BoardGuide strict(cameras(), {3, 1.0, 2});
  for (const Vec2 at : {Vec2(260, 150), Vec2(800, 150), Vec2(1340, 150), Vec2(260, 450),
                        Vec2(800, 450), Vec2(1340, 450), Vec2(260, 750), Vec2(800, 750)})
    strict.add({grid(0, at.x, at.y, 100)});
  EXPECT_EQ(strict.wish(0), "lower right");
  strict.add({grid(0, 1340, 750, 100)});
  EXPECT_EQ(strict.coverage(0), 1.0);
  EXPECT_EQ(strict.wish(0), "where 'b' sees it, too");
  EXPECT_FALSE(strict.enough());
}

TEST(BoardGuide, EnoughIsAllCamerasCoveredAndLinked) {
  BoardGuide guide(cameras(), {6, 1.0, 2});
  for (const double y : {150.0, 450.0, 750.0})
    for (const double x : {260.0, 800.0, 1340.0}) {
      EXPECT_FALSE(guide.enough());
      EXPECT_TRUE(guide.add({grid(0, x, y, 100), grid(1, x, y, 100)}));
    }
  EXPECT_TRUE(guide.enough()) << guide.wish(0) << ", " << guide.wish(1);
}

}  // namespace
}  // namespace polyhull::calibration
