// SPDX-License-Identifier: LGPL-2.1-or-later
// HullBuilder on what breaks programs in floating point. POLYHULL_STRESS multiplies the counts: 1
// (default) takes seconds, 100 gives ten thousand random rigs and ten thousand silhouettes of
// random polygons. Seeds are counted from POLYHULL_SEED (default 0) and named in each failure; with
// POLYHULL_STRESS_DUMP=FOLDER the failing scenes are written there for polyhull-hull.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "base/error.h"
#include "hull/build/hull_builder.h"
#include "support/degenerate_scenes.h"
#include "support/hull_expectations.h"
#include "support/run_kind.h"
#include "support/scene_from_bytes.h"

namespace polyhull::test {
namespace {

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

std::uint64_t scaled(std::uint64_t count) {
  return count * number_from("POLYHULL_STRESS", 1);
}

HullOptions options_of(const HullScene& scene, Unseen unseen = Unseen::carve) {
  HullOptions options;
  options.bounds = scene.rig.bounds;
  options.unseen = unseen;
  return options;
}

/// Tells whether the test has failed since construction, and then writes the scene.
class Watch {
 public:
  ~Watch() {
    if (!scene_ || ::testing::Test::HasFailure() == failed_before_) return;
    if (const char* folder = std::getenv("POLYHULL_STRESS_DUMP")) {
      std::string name = scene_->name;
      std::replace(name.begin(), name.end(), ' ', '_');
      std::ofstream(std::string(folder) + "/" + name + ".json") << hull_scene_to_json(*scene_);
    }
  }
  explicit Watch(const HullScene& scene)
      : scene_(&scene), failed_before_(::testing::Test::HasFailure()) {}

 private:
  const HullScene* scene_;
  bool failed_before_;
};

/// Runs \p make over \p count seeds until ten have failed; each hull must be right.
template <class Make>
void expect_all_right(const char* name, std::uint64_t count, Make&& make, Expectation expect,
                      Unseen unseen) {
  const std::uint64_t first = number_from("POLYHULL_SEED", 0);
  HullBuilder builder;
  std::size_t empty = 0, triangles = 0, slivers = 0, flat = 0;
  std::uint64_t predicates = 0, exact = 0, hash = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const HullScene scene = make(seed);
    const Watch watch(scene);
    const auto views = scene.views();
    const HullOptions options = options_of(scene, unseen);
    expect.seed = seed;
    try {
      const Hull& hull = builder.build(views, options);
      expect_right(hull, views, options, scene.name, expect);
      const MeshReport mesh = check_mesh(hull);
      empty += hull.empty();
      triangles += mesh.triangles;
      slivers += mesh.slivers;
      flat += mesh.flat_triangles;
      hash = hash * 31 + fingerprint(hull);
      predicates += builder.statistics().predicates;
      exact += builder.statistics().exact_predicates;
    } catch (const Error& error) {
      ADD_FAILURE() << scene.name << " refused: " << error.what();
    }
    if (::testing::Test::HasFailure() &&
        ::testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count() >
            20) {
      ADD_FAILURE() << "stopped after seed " << seed;
      break;
    }
  }
  std::printf(
      "%s: seeds %llu..%llu, %zu empty, %zu triangles, %zu slivers, %zu flat, %.3f %% exact, bytes "
      "%016llx\n",
      name, static_cast<unsigned long long>(first),
      static_cast<unsigned long long>(first + count - 1), empty, triangles, slivers, flat,
      100.0 * double(exact) / double(std::max<std::uint64_t>(predicates, 1)),
      static_cast<unsigned long long>(hash));
}

TEST(HullStress, SpecialPositions) {
  HullBuilder builder;
  for (const DegenerateScene& degenerate : degenerate_scenes()) {
    const HullScene& scene = degenerate.scene;
    SCOPED_TRACE(degenerate.name);
    const Watch watch(scene);
    const auto views = scene.views();
    for (Unseen unseen : {Unseen::carve, Unseen::keep}) {
      const HullOptions options = options_of(scene, unseen);
      const std::string what = degenerate.name + (unseen == Unseen::keep ? ", keep" : ", carve");
      try {
        expect_right(builder.build(views, options), views, options, what,
                     {.points = 20000, .simple = degenerate.simple && unseen == Unseen::carve});
      } catch (const Error& error) {
        ADD_FAILURE() << what << " refused: " << error.what();
      }
    }
    try {
      EXPECT_TRUE(check_mesh(builder.build(views)).sound())
          << degenerate.name << ", no bounds: " << check_mesh(builder.build(views)).describe();
    } catch (const Error& error) {
      ADD_FAILURE() << degenerate.name << ", no bounds, refused: " << error.what();
    }
  }
}

TEST(HullStress, SpecialPositionsInAnyOrder) {
  for (const DegenerateScene& degenerate : degenerate_scenes()) {
    const HullScene& scene = degenerate.scene;
    auto views = scene.views();
    if (views.size() > 6) continue;
    HullBuilder builder;
    const double volume = check_mesh(builder.build(views, options_of(scene))).volume;
    const Vec3 size = scene.rig.bounds->max - scene.rig.bounds->min;
    Dice dice(7);
    for (int round = 0; round < 4; ++round) {
      for (std::size_t i = views.size(); i > 1; --i)
        std::swap(views[i - 1], views[std::size_t(dice.whole(0, int(i) - 1))]);
      const MeshReport mesh = check_mesh(builder.build(views, options_of(scene)));
      EXPECT_TRUE(mesh.sound()) << degenerate.name << ": " << mesh.describe();
      EXPECT_NEAR(mesh.volume, volume, 1e-6 * volume + 1e-9 * size.x * size.y * size.z)
          << degenerate.name;
    }
  }
}

TEST(HullStress, RandomRigs) {
  expect_all_right("random rigs", scaled(100), random_scene, {.points = 1000, .snapped = true},
                   Unseen::carve);
}

// Cameras at one place whose views are far apart: in the picture of the one, the other's silhouette
// lies up to 50 focal lengths to the side, where rounded rays miss their pixels by up to a pixel.
TEST(HullStress, ViewsFromOneCentreFarToTheSide) {
  HullBuilder builder;
  for (std::uint64_t seed : {3159, 5985, 5997, 7107, 9230}) {
    const HullScene scene = random_scene(seed);
    const auto views = scene.views();
    const HullOptions options = options_of(scene);
    expect_right(builder.build(views, options), views, options, scene.name,
                 {.points = 5000, .seed = seed, .snapped = true});
  }
}

TEST(HullStress, RandomRigsThatKeepWhatIsUnseen) {
  expect_all_right("random rigs, keep", scaled(50), random_scene, {.points = 1000, .simple = false},
                   Unseen::keep);
}

TEST(HullStress, RandomPolygons) {
  expect_all_right("random polygons", scaled(100), wild_scene, {.points = 1000, .simple = false},
                   Unseen::carve);
}

TEST(HullStress, RandomPolygonsThatKeepWhatIsUnseen) {
  expect_all_right("random polygons, keep", scaled(30), wild_scene,
                   {.points = 1000, .simple = false}, Unseen::keep);
}

TEST(HullStress, RandomRigsAtAnyScale) {
  const auto make = [](std::uint64_t seed) {
    Dice dice(seed ^ 0x5ca1e);
    HullScene scene = moved(random_scene(seed), std::pow(10.0, dice.whole(-9, 9)), Vec3(0.0));
    scene.name += " scaled";
    return scene;
  };
  expect_all_right("random rigs, scaled", scaled(30), make, {.points = 500, .snapped = true},
                   Unseen::carve);
}

/// 10^3 to 10^9 units from the origin.
HullScene far_scene(std::uint64_t seed) {
  Dice dice(seed ^ 0xfa2);
  HullScene scene =
      moved(random_scene(seed), 1.0, dice.direction() * std::pow(10.0, dice.whole(3, 9)));
  scene.name += " far";
  return scene;
}

TEST(HullStress, RandomRigsFarAway) {
  expect_all_right("random rigs, far", scaled(30), far_scene, {.points = 0, .snapped = true},
                   Unseen::carve);
}

// Features as small as a float's steps: turned triangles that need several vertices to move, other
// diagonals, a finer grid (keep 1714, 3435), and parts that shrink to a point (far 431, 2149).
TEST(HullStress, NoTriangleStaysTurnedOrFlat) {
  HullBuilder builder;
  const auto expect = [&](const HullScene& scene, Unseen unseen) {
    const auto views = scene.views();
    const HullOptions options = options_of(scene, unseen);
    const bool keep = unseen == Unseen::keep;
    expect_right(builder.build(views, options), views, options, scene.name,
                 {.points = 0, .simple = !keep, .snapped = true});
  };
  for (std::uint64_t seed : {2725, 5463}) expect(random_scene(seed), Unseen::carve);
  for (std::uint64_t seed : {1714, 3435, 4581}) expect(random_scene(seed), Unseen::keep);
  for (std::uint64_t seed : {431, 1375, 2149, 2204, 2725}) expect(far_scene(seed), Unseen::carve);
}

TEST(HullStress, RandomOrderOfRandomRigs) {
  const std::uint64_t first = number_from("POLYHULL_SEED", 0);
  for (std::uint64_t seed = first; seed < first + scaled(30); ++seed) {
    HullScene scene = random_scene(seed);
    const HullOptions options = options_of(scene);
    HullBuilder builder;
    const double volume = check_mesh(builder.build(scene.views(), options)).volume;
    Dice dice(seed);
    for (Rings& rings : scene.silhouettes) {  // another first vertex in each ring
      std::uint32_t begin = 0;
      for (std::uint32_t end : rings.ends) {
        const int turn = dice.whole(0, int(end - begin) - 1);
        std::rotate(rings.points.begin() + begin, rings.points.begin() + begin + turn,
                    rings.points.begin() + end);
        begin = end;
      }
    }
    auto views = scene.views();
    for (std::size_t i = views.size(); i > 1; --i)
      std::swap(views[i - 1], views[std::size_t(dice.whole(0, int(i) - 1))]);
    const MeshReport mesh = check_mesh(builder.build(views, options));
    const Vec3 size = scene.rig.bounds->max - scene.rig.bounds->min;
    EXPECT_TRUE(mesh.sound()) << scene.name << ": " << mesh.describe();
    EXPECT_NEAR(mesh.volume, volume, 1e-6 * volume + 1e-9 * size.x * size.y * size.z) << scene.name;
  }
}

TEST(HullStress, RandomBytes) {
  HullBuilder builder;
  const std::uint64_t first = number_from("POLYHULL_SEED", 0);
  std::size_t refused = 0, full = 0;
  for (std::uint64_t seed = first; seed < first + scaled(500); ++seed) {
    Dice dice(seed);
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(dice.whole(0, 300)));
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(dice.whole(0, 255));
    const ScenePlan plan = scene_from_bytes(bytes);
    try {
      const MeshReport mesh = check_mesh(builder.build(plan.scene.views(), plan.options));
      EXPECT_TRUE(mesh.sound()) << "bytes of seed " << seed << ": " << mesh.describe();
      full += mesh.triangles > 0;
    } catch (const Error&) {
      ++refused;
    }
  }
  std::printf("random bytes: %zu refused, %zu with a hull\n", refused, full);
  EXPECT_GT(full, 0u);
}

/// Bytes of memory the process holds now.
std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  file >> total >> resident;
  return resident * 4096;
}

TEST(HullStress, AMovingFigureWithCamerasThatComeAndGo) {
  const int frames = static_cast<int>(scaled(200));
  const int cameras = 6;
  HullBuilder builder;
  std::size_t after_a_quarter = 0;
  std::size_t worst_triangles = 0;
  // A walk of 40 pictures per camera, there and back: what the builder keeps must not grow with
  // time.
  std::vector<HullScene> walk;
  for (int i = 0; i < 40; ++i) walk.push_back(figure_scene(cameras, 20, 0.1 * i));
  Dice dice(11);
  std::vector<bool> present(cameras, true);
  for (int frame = 0; frame < frames; ++frame) {
    if (dice.chance(0.05)) {
      const auto which = static_cast<std::size_t>(dice.whole(0, cameras - 1));
      present[which] = !present[which];
    }
    const HullScene& scene = walk[static_cast<std::size_t>(std::abs(frame % 78 - 39))];
    std::vector<Silhouette> views;
    for (std::size_t i = 0; i < present.size(); ++i) {
      if (present[i]) views.push_back(scene.views()[i]);
    }
    const Hull& hull = builder.build(views, options_of(scene));
    worst_triangles = std::max(worst_triangles, hull.triangles.size() / 3);
    if (frame % 10 == 0 || frames <= 1000) {
      const MeshReport mesh = check_mesh(hull);
      ASSERT_TRUE(mesh.sound()) << "frame " << frame << ": " << mesh.describe();
    }
    if (frame == frames / 4) after_a_quarter = resident_bytes();
  }
  const std::size_t end = resident_bytes();
  std::printf(
      "%d frames, up to %zu triangles; memory %.1f MB after a quarter, %.1f MB at the end\n",
      frames, worst_triangles, double(after_a_quarter) / 1e6, double(end) / 1e6);
  // The sanitizers hold freed memory back; there the leak check judges.
  if (!sanitized()) {
    EXPECT_LT(end, after_a_quarter + after_a_quarter / 20 + 4000000);
  }
}

}  // namespace
}  // namespace polyhull::test
