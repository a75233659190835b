// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hull/build/stage.h"
#include "hull/measure.h"
#include "hull/repair/agreement.h"
#include "support/camera_contours.h"
#include "support/figure.h"
#include "support/matte_damage.h"
#include "support/membership.h"
#include "support/scenes.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// A person before cameras: the walking figure, or every third time the studio's.
struct Stage {
  Rig rig;
  std::vector<Matte> mattes;
  std::vector<Rings> truth, contours;

  Stage(int cameras, int number) : rig(ring_around_person(cameras, number)) {
    if (number % 3 == 0) {
      mattes = mattes_of(open_subject(""), rig, 0.9 * number);
    } else {
      for (const Camera& camera : rig.cameras)
        mattes.push_back(
            matte_of(standing_silhouette(camera, 0.9 * number), camera.width, camera.height));
    }
    for (const Matte& matte : mattes) truth.push_back(contours_of(matte));
    contours = truth;
  }

  /// \p count blobs of 5 to 60 px in mattes taken at random.
  int spoil(Damage kind, int count, std::uint64_t seed) {
    Dice dice(seed);
    int done = 0;
    const int last = static_cast<int>(mattes.size()) - 1;
    for (int i = 0; i < count; ++i)
      done += damage(mattes[dice.whole(0, last)], kind, dice.between(5.0, 60.0), dice);
    for (std::size_t i = 0; i < mattes.size(); ++i) contours[i] = contours_of(mattes[i]);
    return done;
  }

  std::vector<Silhouette> views(const std::vector<Rings>& rings) const {
    std::vector<Silhouette> result;
    for (std::size_t i = 0; i < rings.size(); ++i) result.push_back({&rig.cameras[i], &rings[i]});
    return result;
  }

  std::vector<Rings> mended(const RepairOptions& options) const {
    const auto repairs = find_repairs(views(contours), options);
    std::vector<Rings> rings;
    for (std::size_t i = 0; i < contours.size(); ++i)
      rings.push_back(without_rings(contours[i], repairs[i].leave_out));
    return rings;
  }

  /// How many of the points are in the one hull and not in the other.
  std::size_t difference(const std::vector<Rings>& a, const std::vector<Rings>& b,
                         std::span<const Vec3> points) const {
    const auto views_a = views(a), views_b = views(b);
    const auto in_a = SilhouetteMembership(views_a, {}).ask(points);
    const auto in_b = SilhouetteMembership(views_b, {}).ask(points);
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); ++i) count += in_a[i] != in_b[i];
    return count;
  }
};

std::vector<Vec3> points_around(std::size_t count) {
  Dice dice(7);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(dice.between(-0.8, 0.8), dice.between(-0.05, 2.0), dice.between(-0.8, 0.8));
  return points;
}

struct Outcome {
  std::size_t before = 0, after = 0;
  double undone() const { return 1.0 - static_cast<double>(after) / static_cast<double>(before); }
};

Outcome mend_stages(int cameras, int stages, Damage kind, int blobs, const RepairOptions& options) {
  const std::vector<Vec3> points = points_around(30000);
  Outcome outcome;
  for (int number = 0; number < stages; ++number) {
    Stage stage(cameras, number);
    stage.spoil(kind, blobs, 100 + number);
    outcome.before += stage.difference(stage.truth, stage.contours, points);
    outcome.after += stage.difference(stage.truth, stage.mended(options), points);
  }
  return outcome;
}

constexpr RepairOptions both{.repair = Repair::both};
constexpr RepairOptions holes{.repair = Repair::holes};

TEST(Repair, HolesInRandomMattesOfEightCamerasAreFilled) {
  const Outcome outcome = mend_stages(8, 3, Damage::hole, 3, holes);
  EXPECT_GT(outcome.before, 100u);
  EXPECT_GT(outcome.undone(), 0.5)
      << outcome.before << " points lost, " << outcome.after << " left";
}

TEST(Repair, HolesInAllMattesOfEightCamerasAreFilled) {
  const Outcome outcome = mend_stages(8, 3, Damage::hole, 8, holes);
  EXPECT_GT(outcome.undone(), 0.25)
      << outcome.before << " points lost, " << outcome.after << " left";
}

TEST(Repair, FewCamerasFillLittle) {
  const Outcome outcome = mend_stages(4, 3, Damage::hole, 2, holes);
  EXPECT_GT(outcome.undone(), 0.1)
      << outcome.before << " points lost, " << outcome.after << " left";
}

TEST(Repair, UndamagedSilhouettesStayToTheByte) {
  std::size_t gaps = 0;
  for (const int cameras : {4, 8})
    for (int number = 0; number < 4; ++number) {
      const Stage stage(cameras, number);
      EXPECT_EQ(stage.mended(both), stage.truth) << cameras << " cameras, " << number;
      for (const Rings& rings : stage.truth) gaps += rings.size() - 1;
    }
  EXPECT_GT(gaps, 30u);
}

/// What a bite takes of one camera's arm leaves others' arms uncovered, too, and a gap behind which
/// all others see something would cover them: so would the bite.
TEST(Repair, BitesProveNoGapWrong) {
  for (const int number : {1, 2, 4}) {
    Stage stage(8, number);
    stage.spoil(Damage::bite, 12, 300 + number);
    EXPECT_EQ(stage.mended(holes), stage.contours) << number;
  }
}

TEST(Repair, SpecksAreDroppedAndNothingElse) {
  int specks = 0, dropped = 0;
  for (int number = 0; number < 6; ++number) {
    Stage stage(8, number);
    const std::vector<Rings> undamaged = stage.mended(both);
    specks += stage.spoil(Damage::speck, 5, 200 + number);
    EXPECT_EQ(stage.mended(both), undamaged) << number;
    for (const ViewRepair& repair : find_repairs(stage.views(stage.contours), both))
      dropped += static_cast<int>(repair.pieces);
    for (const ViewRepair& repair : find_repairs(stage.views(stage.contours), holes))
      EXPECT_EQ(repair.pieces, 0u);
  }
  EXPECT_EQ(dropped, specks);
  EXPECT_GT(specks, 20);
}

/// A person's silhouettes with a hole in the middle of the chest of one camera.
Stage with_a_hole(int cameras, std::size_t camera, float size) {
  Stage stage(cameras, 1);
  const Vec2 middle = *stage.rig.cameras[camera].project(Vec3(0.0, 1.25, 0.0));
  const Vec2f m(middle);
  // Clockwise on screen, y down.
  add_ring(stage.contours[camera], {m + Vec2f(-size, -size), m + Vec2f(size, -size),
                                    m + Vec2f(size, size), m + Vec2f(-size, size)});
  return stage;
}

TEST(Repair, TheHoleAndItsIslandGo) {
  Stage stage = with_a_hole(8, 3, 18.0f);
  const Vec2f corner = stage.contours[3].points.back();
  // In the hole: foreground with a hole of its own, all of which is the subject.
  const Vec2f m = corner + Vec2f(18.0f, -18.0f);
  add_ring(stage.contours[3],
           {m + Vec2f(-6, -6), m + Vec2f(-6, 6), m + Vec2f(6, 6), m + Vec2f(6, -6)});
  add_ring(stage.contours[3],
           {m + Vec2f(-3, -3), m + Vec2f(3, -3), m + Vec2f(3, 3), m + Vec2f(-3, 3)});
  const auto repairs = find_repairs(stage.views(stage.contours), holes);
  EXPECT_EQ(repairs[3].holes, 1u);
  // The hole in the island is too small to be proven.
  const Rings mended = stage.mended(holes)[3];
  ASSERT_EQ(mended.size(), stage.truth[3].size() + 1);
  EXPECT_EQ(without_rings(mended, {{static_cast<std::uint32_t>(mended.size() - 1)}}),
            stage.truth[3]);
}

TEST(Repair, WhatSomeCamerasDoNotSeeIsNotProven) {
  Stage stage = with_a_hole(8, 3, 18.0f);
  const auto filled = [&](Unseen unseen) {
    return find_repairs(stage.views(stage.contours), {Repair::holes, unseen})[3].holes;
  };
  EXPECT_EQ(filled(Unseen::carve), 1u);
  EXPECT_EQ(filled(Unseen::keep), 1u);
  const auto show_legs_only = [&](std::size_t i) {
    Camera& camera = stage.rig.cameras[i];
    const double v = camera.project(Vec3(0.0, 0.8, 0.0))->y;
    camera.K[2][1] -= v;
    for (Vec2f& p : stage.contours[i].points) p.y = std::max(p.y - static_cast<float>(v), -0.5f);
  };
  // The one that looks against the hole: a ray above its picture is no witness.
  show_legs_only(7);
  EXPECT_EQ(filled(Unseen::keep), 0u);
  stage = with_a_hole(8, 3, 18.0f);
  for (const std::size_t i : {4u, 6u}) show_legs_only(i);
  EXPECT_EQ(filled(Unseen::carve), 0u);
  EXPECT_EQ(filled(Unseen::keep), 0u);
}

TEST(Repair, TheSameForAnyNumberOfThreads) {
  Stage stage(8, 2);
  stage.spoil(Damage::hole, 8, 5);
  stage.spoil(Damage::speck, 8, 6);
  RepairOptions options = both;
  const auto one = find_repairs(stage.views(stage.contours), options);
  for (const int threads : {2, 3, 8}) {
    options.threads = threads;
    EXPECT_EQ(find_repairs(stage.views(stage.contours), options), one);
  }
}

TEST(Repair, NothingToJudgeByNothingMended) {
  const auto untouched = [](std::span<const Silhouette> views) {
    for (const ViewRepair& repair : find_repairs(views, both))
      if (repair != ViewRepair{}) return false;
    return true;
  };
  EXPECT_TRUE(find_repairs({}, both).empty());
  Stage stage = with_a_hole(8, 0, 18.0f);
  std::vector<Silhouette> views = stage.views(stage.contours);
  EXPECT_TRUE(untouched({views.data(), 1}));
  EXPECT_TRUE(untouched({views.data(), 2}));
  for (const ViewRepair& repair : find_repairs(views, {})) EXPECT_EQ(repair, ViewRepair{});
  // The same camera eight times confirms its own hole.
  EXPECT_TRUE(untouched(std::vector<Silhouette>(8, views[0])));
  // One sees nothing: there is no hull, and all that the others see stays.
  const Rings empty;
  views[5].rings = &empty;
  EXPECT_TRUE(untouched(views));
  EXPECT_TRUE(untouched(std::vector<Silhouette>(8, Silhouette{views[0].camera, &empty})));
}

TEST(Repair, RingsOfNoAreaAreNoPieces) {
  Stage stage = with_a_hole(8, 0, 18.0f);
  for (const std::vector<Vec2f>& ring :
       {std::vector<Vec2f>{}, {{5.0f, 5.0f}}, {{5.0f, 5.0f}, {9.0f, 9.0f}}})
    add_ring(stage.contours[0], ring);
  const auto repairs = find_repairs(stage.views(stage.contours), both);
  EXPECT_EQ(repairs[0].pieces, 0u);
  EXPECT_EQ(repairs[0].holes, 1u);
}

TEST(Repair, NumbersThatAreNoneAndRingsBeyondMeasureDoNoHarm) {
  Stage stage = with_a_hole(8, 0, 18.0f);
  for (const float value : {1e9f, -1e30f}) {
    Rings& rings = stage.contours[4];
    add_ring(rings, {{0.0f, 0.0f}, {0.5f, 1.0f}, {value, value}});
    find_repairs(stage.views(stage.contours), both);
  }
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    stage.contours[4].points[3].x = value;
    for (const ViewRepair& repair : find_repairs(stage.views(stage.contours), both))
      EXPECT_EQ(repair, ViewRepair{});
  }
}

/// The longest run of points on the ray that none of the others rejects and fewest see, by asking
/// point by point.
hull::Agreement::Stretch by_points(std::span<const Silhouette> views, std::size_t view,
                                   const Vec2& pixel, std::size_t fewest, Unseen unseen,
                                   double step) {
  const Camera& from = *views[view].camera;
  hull::Agreement::Stretch longest;
  double begin = -1.0;
  const double last = 12.0;
  for (double s = 0.5 * step; s < last; s += step) {
    const Vec3 X = from.centre() + s * from.ray(pixel);
    std::size_t seen = 0;
    bool rejected = false;
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (j == view) continue;
      const Camera& camera = *views[j].camera;
      const auto p = camera.project_ideal(X);
      bool inside = false;
      if (p)
        for (std::size_t r = 0; r < views[j].rings->size(); ++r) {
          const auto ring = views[j].rings->ring(r);
          Vec2 a(ring.back());
          for (const Vec2f& point : ring) {
            const Vec2 b(point);
            if ((a.y <= p->y) != (b.y <= p->y) &&
                p->x < a.x + (p->y - a.y) * (b.x - a.x) / (b.y - a.y))
              inside = !inside;
            a = b;
          }
        }
      const bool in_frame = p && p->x > -0.5 && p->y > -0.5 && p->x < camera.width - 0.5 &&
                            p->y < camera.height - 0.5;
      seen += inside;
      rejected = rejected || (!inside && (unseen == Unseen::carve || in_frame));
    }
    const bool good = !rejected && seen >= fewest;
    if (good && begin < 0.0) begin = s - 0.5 * step;
    if (good && (s - begin) / s > longest.across) longest = {(s - begin) / s, 0.5 * (begin + s)};
    if (!good) begin = -1.0;
  }
  longest.across *= from.K[0][0];
  return longest;
}

TEST(Agreement, IsThatOfPointsOnTheRay) {
  constexpr double step = 0.002;
  int met = 0, missed = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Stage stage(3 + static_cast<int>(seed % 4), 1);
    Dice dice(seed);
    // Behind other cameras, too, and with one that sees the half of it.
    stage.rig.cameras[1].K[2][0] -= 480.0;
    for (Vec2f& p : stage.contours[1].points) p.x = std::max(p.x - 480.0f, -0.5f);
    const auto views = stage.views(stage.contours);
    for (const Unseen unseen : {Unseen::carve, Unseen::keep}) {
      const hull::Agreement agreement(views, unseen);
      hull::Agreement::Scratch scratch;
      for (int i = 0; i < 20; ++i) {
        const auto view =
            static_cast<std::size_t>(dice.whole(0, static_cast<int>(views.size()) - 1));
        const Vec2 pixel(dice.between(380.0, 640.0), dice.between(150.0, 600.0));
        const std::size_t fewest = dice.whole(1, 2);
        const auto found = agreement.longest(view, pixel, fewest, scratch);
        auto slow = by_points(views, view, pixel, fewest, unseen, step);
        const double slack = 4.0 * step * 700.0 / std::max(0.5, slow.depth);
        // Between two points there may be a sliver that is rejected.
        if (std::abs(found.across - slow.across) > slack)
          slow = by_points(views, view, pixel, fewest, unseen, step / 32.0);
        if (slow.depth > 6.0) continue;  // beyond the stage, where the slow one ends
        EXPECT_NEAR(found.across, slow.across, slack) << seed << " " << i;
        ++(slow.across > 0.0 ? met : missed);
      }
    }
  }
  EXPECT_GT(met, 50);
  EXPECT_GT(missed, 25);
}

TEST(HullStage, FacesLieOnTheEdgesOfTheMendedContours) {
  Stage stage = with_a_hole(8, 0, 18.0f);
  for (Camera& camera : stage.rig.cameras) camera.distortion = {-0.05, 0.01, 0.001, -0.001};
  for (std::size_t i = 0; i < 8; ++i) {
    // The hole first, so that leaving it out moves the numbers of all others.
    Rings turned;
    for (std::size_t r = stage.contours[i].size(); r-- > 0;) {
      const auto ring = stage.contours[i].ring(r);
      std::vector<Vec2f> bent;
      for (const Vec2f& p : ring) bent.emplace_back(stage.rig.cameras[i].distort(Vec2(p)));
      add_ring(turned, bent);
    }
    stage.contours[i] = turned;
  }
  const auto views = camera_contours(stage.rig.cameras, stage.contours);
  HullStage torn_stage, mended_stage;
  HullOptions options;
  options.bounds = stage.rig.bounds;
  const double torn = enclosed_volume(torn_stage.build(views, options, 0.0));
  EXPECT_EQ(&torn_stage.contours(0), &stage.contours[0]);
  for (int again = 0; again < 2; ++again) {
    const Hull& hull = mended_stage.build(views, options, 0.0, Repair::holes);
    EXPECT_EQ(mended_stage.repair(0).holes, 1u);
    EXPECT_EQ(mended_stage.statistics().reused, again == 1);
    ASSERT_EQ(mended_stage.contours(0).points.size() + 4, stage.contours[0].points.size());
    EXPECT_GT(enclosed_volume(hull), torn * 1.005);
    for (const HullFace& face : hull.faces) {
      if (face.view < 0) continue;
      const Camera& camera = stage.rig.cameras[static_cast<std::size_t>(face.view)];
      const Rings& rings = mended_stage.contours(static_cast<std::size_t>(face.view));
      std::uint32_t begin = 0;
      for (const std::uint32_t end : rings.ends) {
        if (face.edge >= begin && face.edge < end) {
          const Vec2f a = rings.points[face.edge];
          const Vec2f b = rings.points[face.edge + 1 == end ? begin : face.edge + 1];
          const Vec3 normal = glm::normalize(glm::cross(camera.ray(camera.undistort(Vec2(a))),
                                                        camera.ray(camera.undistort(Vec2(b)))));
          for (std::uint32_t k = 0; k < 3 * face.triangle_count; ++k) {
            const Vec3 X =
                hull.origin + Vec3(hull.vertices[hull.triangles[3 * face.first_triangle + k]]);
            EXPECT_LT(std::abs(glm::dot(normal, X - camera.centre())), 2e-3);
          }
        }
        begin = end;
      }
    }
  }
  // Without repair again: the hull with the hole.
  EXPECT_EQ(enclosed_volume(mended_stage.build(views, options, 0.0)), torn);
}

TEST(HullStage, WhereNothingIsWrongTheHullIsTheSame) {
  const Stage stage(4, 1);
  const auto views = camera_contours(stage.rig.cameras, stage.contours);
  HullStage off, on;
  const Hull& a = off.build(views, {}, 0.0);
  const Hull& b = on.build(views, {}, 0.0, Repair::both);
  EXPECT_FALSE(a.empty());
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(&on.contours(2), &stage.contours[2]);
}

}  // namespace
