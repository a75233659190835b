// SPDX-License-Identifier: LGPL-2.1-or-later
// Several mirrors in one picture, and mirrors seen in mirrors, against a plain ray tracer and against
// what each of them shows alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "backend.h"
#include "builtin/shapes.h"
#include "environment/environment.h"
#include "figure_stage.h"
#include "raytrace/ray_caster.h"
#include "raytrace/traced_scene.h"
#include "shot.h"
#include "simple_trace.h"

namespace polyhull {
namespace {

using Stage = synthetic::FigureStage;
using MirrorsTest = testing::BackendTest;

void keep(const Picture& picture, const std::string& name) {
  if (const char* folder = std::getenv("POLYHULL_PICTURES"))
    save_picture(picture, std::string(folder) + "/" + name + ".png");
}

/// A standing pane of metal, from \p corner along \p u and up.
void add_pane(Scene& scene, const Vec3f& corner, const Vec3f& u, float height) {
  Material metal;
  metal.base_colour = {0.9f, 0.85f, 0.8f};
  metal.metallic = 1.0f;
  metal.roughness = 0.0f;
  scene.materials.push_back(metal);
  SceneMesh mesh;
  const Vec3f v(0.0f, height, 0.0f);
  mesh.material = static_cast<int>(scene.materials.size()) - 1;
  mesh.positions = {corner, corner + u, corner + u + v, corner + v};
  mesh.normals.assign(4, glm::normalize(glm::cross(u, v)));
  mesh.triangles = {0, 1, 2, 0, 2, 3};
  scene.meshes.push_back(mesh);
  scene.mirrors = find_mirrors(scene);
}

/// The small room with a polished floor and a pane before its back wall.
Scene floor_and_pane() {
  Scene scene = synthetic::small_room(true);
  add_pane(scene, {-0.3f, 0.15f, -1.6f}, {1.6f, 0.0f, 0.0f}, 2.2f);
  return scene;
}

/// The small room with a dull floor and two panes that meet in a corner behind the figure.
Scene corner() {
  Scene scene = synthetic::small_room(false);
  scene.meshes.resize(4);  // no pillar
  add_pane(scene, {-1.5f, 0.0f, 1.6f}, {0.0f, 0.0f, -2.8f}, 2.3f);
  add_pane(scene, {-1.5f, 0.0f, -1.2f}, {2.6f, 0.0f, 0.0f}, 2.3f);
  return scene;
}

/// The figure in \p scene over its traced picture.
std::unique_ptr<Stage> stage_of(Scene scene, const Vec3& eye, const Vec3& target) {
  auto stage = std::make_unique<Stage>(224, 126);
  stage->scene = stage->frame.scene = std::make_shared<const Scene>(std::move(scene));
  stage->frame.lights = stage->scene->lights;
  stage->frame.viewport = synthetic::look_at(eye, target, 224, 126, 50.0);
  stage->background =
      synthetic::SimpleTrace(*stage->scene, stage->frame.ambient).draw(stage->frame.viewport, 2, 3);
  return stage;
}

std::unique_ptr<Stage> floor_stage() {
  return stage_of(floor_and_pane(), {1.3, 1.5, 4.2}, {-0.2, 0.8, 0.0});
}
std::unique_ptr<Stage> corner_stage() {
  return stage_of(corner(), {1.8, 1.5, 3.4}, {-0.4, 1.0, 0.0});
}

double seen_apart(const Picture& a, const Picture& b, int x, int y) {
  double apart = 0.0;
  for (int c = 0; c < 3; ++c)
    apart += std::abs(static_cast<double>(a.row(y)[4 * x + c]) - b.row(y)[4 * x + c]);
  return apart;
}

/// Of the pixels that the subject changes without standing there.
double around(const Stage& stage, const RenderPlan& plan, const Picture& picture,
              const Picture& truth) {
  return synthetic::psnr(picture, truth, [&](int x, int y) {
    const Rectangle& r = plan.subject;
    const bool inside = x >= r.x && x < r.x + r.width && y >= r.y && y < r.y + r.height;
    return !inside && seen_apart(stage.background, truth, x, y) > 6;
  });
}

/// Checks \p stage against the truth around the figure, and against the processor's picture.
void check(Renderer& renderer, const Stage& stage, const Picture& truth, int depth,
           const std::string& name, double least) {
  RenderSettings settings;
  settings.mirror_depth = depth;
  const Picture picture = stage.composite(renderer, settings);
  const RenderPlan plan = renderer.plan(stage.frame, settings);
  keep(picture, name);
  keep(truth, name + "-truth");
  keep(stage.background, name + "-empty");
  ProcessorRenderer processor;
  const Picture other = stage.composite(processor, settings);
  const double found = around(stage, plan, picture, truth);
  const double alike = synthetic::psnr(picture, other);
  std::printf(
      "%s: %zu mirrors, around the figure %.2f dB (background %.2f), whole %.2f, of the "
      "processor's %.2f\n",
      name.c_str(), plan.mirrors.size(), found, around(stage, plan, stage.background, truth),
      synthetic::psnr(picture, truth), alike);
  EXPECT_GT(found, least) << name;
  EXPECT_GT(alike, 42.0) << name;
}

/// As check() with one mirror on the way, and with two.
void check_depths(Renderer& renderer, const Stage& stage, const Picture& one, const Picture& two,
                  const std::string& name, double least) {
  check(renderer, stage, one, 1, name, least);
  check(renderer, stage, two, 2, name + "-2", least);
}

TEST_P(MirrorsTest, TwoStandInTheSceneLikeTheTruth) {
  static const std::unique_ptr<Stage> stage = floor_stage();
  static const Picture one = stage->truth(2, 3, 1), two = stage->truth(2, 3, 2);
  check_depths(*make_renderer(), *stage, one, two, "floor-and-pane", 34.5);
}

TEST_P(MirrorsTest, TheyStandInACornerLikeTheTruth) {
  static const std::unique_ptr<Stage> stage = corner_stage();
  static const Picture one = stage->truth(2, 3, 1), two = stage->truth(2, 3, 2);
  check_depths(*make_renderer(), *stage, one, two, "corner", 31.3);
}

// In its own pixels each mirror shows what it shows where there is no other.
TEST_P(MirrorsTest, EachShowsWhatItShowsAlone) {
  // OpenGL puts one after the other into a picture of whole codes.
  const int most_apart = processor() ? 0 : 1;
  const auto renderer = make_renderer();
  for (const bool metal : {false, true}) {
    Stage stage(240, 135);
    stage.fill_background(150);
    stage.frame.viewport =
        metal ? synthetic::look_at({1.8, 1.5, 3.4}, {-0.4, 1.0, 0.0}, 240, 135, 50)
              : synthetic::look_at({1.3, 1.5, 4.2}, {-0.2, 0.8, 0.0}, 240, 135, 50);
    const Scene scene = metal ? corner() : floor_and_pane();
    ASSERT_EQ(scene.mirrors.size(), 2u);
    Picture pictures[4];  // by the mirrors, a bit each
    for (unsigned set = 0; set < 4; ++set) {
      Scene some = scene;
      some.mirrors.clear();
      for (unsigned m = 0; m < 2; ++m)
        if (set >> m & 1) some.mirrors.push_back(scene.mirrors[m]);
      stage.frame.scene = std::make_shared<const Scene>(std::move(some));
      pictures[set] = stage.composite(*renderer, {});
      EXPECT_EQ(renderer->statistics().mirrors, set == 3 ? 2u : set > 0 ? 1u : 0u);
      // A mirror that is left out shows what one shows that is not there.
      stage.frame.scene = std::make_shared<const Scene>(scene);
      stage.frame.mirrors_left_out = {(set & 1) == 0, (set & 2) == 0};
      EXPECT_EQ(stage.composite(*renderer, {}).pixels, pictures[set].pixels) << set;
      EXPECT_EQ(renderer->statistics().mirrors, set == 3 ? 2u : set > 0 ? 1u : 0u);
      stage.frame.mirrors_left_out.clear();
    }
    int own[2] = {}, shared = 0;
    for (int y = 0; y < 135; ++y) {
      for (int x = 0; x < 240; ++x) {
        const bool first = seen_apart(pictures[1], pictures[0], x, y) > 0;
        const bool second = seen_apart(pictures[2], pictures[0], x, y) > 0;
        shared += first && second;
        if (first && second) continue;
        own[0] += first;
        own[1] += second;
        const Picture& alone = pictures[second ? 2 : 1];
        for (int c = 0; c < 4; ++c)
          ASSERT_LE(std::abs(alone.row(y)[4 * x + c] - pictures[3].row(y)[4 * x + c]), most_apart)
              << x << " " << y << " metal " << metal;
      }
    }
    EXPECT_GT(own[0], 300);
    EXPECT_GT(own[1], 300);
    EXPECT_LT(shared, 100) << "pixels at the edge between them";
  }
}

// One mesh may be several mirrors: each of its faces shows what that face reflects, and no other's.
TEST_P(MirrorsTest, EachFaceOfAMeshIsAMirror) {
  Scene apart = corner(), together = apart;
  SceneMesh& mesh = together.meshes[together.meshes.size() - 2];
  const SceneMesh second = together.meshes.back();
  mesh.positions.insert(mesh.positions.end(), second.positions.begin(), second.positions.end());
  mesh.normals.insert(mesh.normals.end(), second.normals.begin(), second.normals.end());
  for (const std::uint32_t index : second.triangles) mesh.triangles.push_back(4 + index);
  together.meshes.pop_back();
  together.mirrors = find_mirrors(together);
  ASSERT_EQ(together.mirrors.size(), 2u);
  Stage stage(160, 90);
  stage.fill_background(150);
  stage.frame.viewport = synthetic::look_at({1.8, 1.5, 3.4}, {-0.4, 1.0, 0.0}, 160, 90, 50);
  RenderSettings settings;
  settings.mirror_depth = 2;
  stage.frame.scene = std::make_shared<const Scene>(std::move(apart));
  const auto renderer = make_renderer();
  const Picture wanted = stage.composite(*renderer, settings);
  stage.frame.scene = std::make_shared<const Scene>(std::move(together));
  EXPECT_EQ(stage.composite(*renderer, settings).pixels, wanted.pixels);
}

// Tiles of a mesh each show what one pane shows.
TEST_P(MirrorsTest, TilesAreOneMirror) {
  Scene whole, tiles;
  add_pane(whole, {-1.2f, 0.0f, -1.0f}, {2.4f, 0.0f, 0.0f}, 2.4f);
  for (int i = 0; i < 16; ++i)
    add_pane(tiles,
             {-1.2f + 0.6f * static_cast<float>(i % 4), 0.6f * static_cast<float>(i / 4), -1.0f},
             {0.6f, 0.0f, 0.0f}, 0.6f);
  ASSERT_EQ(tiles.mirrors.size(), 1u);
  Stage stage(160, 90);
  stage.fill_background(150);
  stage.frame.viewport = synthetic::look_at({1.0, 1.2, 3.2}, {0.2, 1.0, 0.0}, 160, 90, 50);
  const auto renderer = make_renderer();
  stage.frame.scene = std::make_shared<const Scene>(std::move(whole));
  stage.frame.lights.clear();
  const Picture wanted = stage.composite(*renderer, {});
  stage.frame.scene = std::make_shared<const Scene>(std::move(tiles));
  const Picture shown = stage.composite(*renderer, {});
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 160; ++x) EXPECT_LE(seen_apart(shown, wanted, x, y), 1) << x << " " << y;
}

// By way of a mirror the eye sees farther than anything is from it.
TEST_P(MirrorsTest, FarImagesAreNotCutOff) {
  Scene scene;
  add_pane(scene, {-1.2f, 0.0f, -3.4f}, {2.4f, 0.0f, 0.0f}, 2.4f);
  Stage stage(160, 90);
  stage.fill_background(150);
  stage.frame.scene = std::make_shared<const Scene>(std::move(scene));
  stage.frame.lights.clear();
  stage.frame.viewport = synthetic::look_at({1.0, 1.2, 3.2}, {0.2, 1.0, 0.0}, 160, 90, 50);
  RenderSettings settings, without;
  without.mirror = MirrorMode::off;
  const auto renderer = make_renderer();
  const Picture shown = stage.composite(*renderer, settings);
  const Picture bare = stage.composite(*renderer, without);
  int image = 0;
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 160; ++x) image += seen_apart(shown, bare, x, y) > 6;
  EXPECT_GT(image, 100);
}

// Whatever of the mirrors comes into view, goes, or is hidden by the other.
TEST_P(MirrorsTest, SkippingChangesNoBit) {
  Stage stage(160, 90);
  stage.fill_background(150);
  stage.frame.scene = std::make_shared<const Scene>(floor_and_pane());
  const auto lazy = make_renderer(), eager = make_renderer();
  RenderSettings skip, all;
  skip.mirror_depth = all.mirror_depth = 2;
  all.skip = false;
  std::size_t most = 0, least = 9;
  const Vec3 eyes[] = {{1.3, 1.5, 4.2}, {1.3, 1.5, 4.2},  {-1.4, 0.7, 0.0},
                       {2.0, 2.5, 2.0}, {0.5, 1.2, -1.0}, {1.3, 1.5, 4.2}};
  const Vec3 targets[] = {{0, 0.9, 0},       {0, 0.9, 0},   {0.2, 0.6, -1.6},
                          {-0.6, 1.0, -1.0}, {0, 0.2, 1.0}, {0, 0.9, 0}};
  for (std::size_t i = 0; i < std::size(eyes); ++i) {
    stage.frame.viewport = synthetic::look_at(eyes[i], targets[i], 160, 90, 55.0);
    stage.frame.subjects[0].placement.translate = {i == 1 ? 2.2 : 0.0, 0, 0};
    const Picture picture = stage.composite(*lazy, skip);
    EXPECT_EQ(picture.pixels, stage.composite(*eager, all).pixels) << "view " << i;
    most = std::max<std::size_t>(most, lazy->statistics().mirrors);
    least = std::min<std::size_t>(least, lazy->statistics().mirrors);
  }
  EXPECT_GT(most, 2u);
  EXPECT_LT(least, 2u);
}

/// A polished floor, a polished pane that leans back behind it, turned a little, and a box before them,
/// by single rays. Their normals are not at right angles, so that the order of the reflections counts.
struct LeaningPane {
  const Vec3f low{-0.5f, 0.6f, -0.5f}, high{0.4f, 1.2f, -0.2f};  // the box
  Scene scene;

  LeaningPane() {
    scene.materials.resize(1);
    scene.materials[0].base_colour = Vec3f(1.0f);
    scene.materials[0].metallic = 0.9f;  // of metal alone all that it shows is taken out
    scene.materials[0].roughness = 0.0f;
    scene.meshes = {parallelogram("floor", 0, {-1.5f, 0, 1.5f}, {3, 0, 0}, {0, 0, -2.3f}),
                    parallelogram("pane", 0, {-1.5f, 0.1f, -1}, {3, 0, 0.6f}, {0, 1.7f, -0.7f})};
    scene.mirrors = find_mirrors(scene);
    // A colour for each direction.
    RadiancePicture around{256, 128, std::vector<Vec3f>(256 * 128)};
    for (std::size_t i = 0; i < around.pixels.size(); ++i) {
      const double polar = std::numbers::pi * (static_cast<double>(i / 256) + 0.5) / 128.0;
      const double angle = 2.0 * std::numbers::pi * (static_cast<double>(i % 256) + 0.5) / 256.0;
      around.pixels[i] = 0.5f + 0.4f * Vec3f(std::sin(polar) * std::cos(angle), std::cos(polar),
                                             std::sin(polar) * std::sin(angle));
    }
    scene.environment = std::make_shared<const Environment>(around, 35.0, "colours");
  }
  bool meets_box(const Vec3f& origin, const Vec3f& way) const {
    const Vec3f a = (low - origin) / way, b = (high - origin) / way;
    const Vec3f in = glm::min(a, b), out = glm::max(a, b);
    return std::max({in.x, in.y, in.z, 0.0f}) < std::min({out.x, out.y, out.z});
  }
  /// By way of which mirrors a ray comes to the box, one digit each; 0: it does not, or does at once, or
  /// meets a mirror behind it. \p way becomes its direction there, \p share what the mirrors leave of it.
  int met(const RayCaster& mirrors, Vec3f origin, Vec3f& way, Vec3f& share) const {
    int by = 0;
    for (int depth = 0; depth < 3; ++depth) {
      const RayHit hit = mirrors.intersect({origin, 1e-4f, way});
      if (meets_box(origin, way)) return hit.hit() ? 0 : by;
      if (!hit.hit()) return 0;
      const Vec3f normal = glm::normalize(hit.normal);
      share *= fresnel(scene.materials[0].f0(), std::abs(glm::dot(normal, way)));
      origin += hit.distance * way;
      way = glm::reflect(way, normal);
      by = 10 * by + static_cast<int>(hit.mesh) + 1;
    }
    return 0;
  }
};

// What a mirror showed of the environment is taken out where the subject's image is, also by way of two.
TEST_P(MirrorsTest, TheEnvironmentInThemIsTakenOut) {
  const LeaningPane pane;
  const Mesh box = synthetic::plain_box(pane.low, pane.high, 0.6f);
  RayCaster mirrors;
  for (const SceneMesh& mesh : pane.scene.meshes) mirrors.add_mesh(mesh.positions, mesh.triangles);
  mirrors.commit();
  const Camera viewport = synthetic::look_at({0.4, 1.3, 2.6}, {0, 0.5, -0.9}, 240, 180, 60.0);
  synthetic::Shot shot(pane.scene, box, viewport);
  shot.frame.sky = Vec3f(0.5f);  // so that the background is brighter than what is taken out
  shot.settings.shadow = ShadowQuality::off;
  shot.settings.mirror_depth = 2;
  const float background = shot.draw(0.45f);
  keep(shot.picture, "environment");
  const Vec3f eye(viewport.centre());
  std::map<int, int> pixels;
  for (int y = 1; y < 179; ++y)
    for (int x = 1; x < 239; ++x) {
      Vec3f way, share;
      const auto by = [&](double right, double down) {
        share = Vec3f(1.0f);
        way = glm::normalize(Vec3f(viewport.ray(Vec2(x + right, y + down))));
        return pane.met(mirrors, eye, way, share);
      };
      const bool whole = by(-1, -1) == by(1, 1) && by(1, -1) == by(-1, 1) && by(-1, 1) == by(1, 1);
      const int path = by(0, 0);
      if (!whole || path == 0 || path != by(1, 1)) continue;
      by(0, 0);
      ++pixels[path];
      const Vec3f shown = 0.5f * pane.scene.environment->radiance(way);
      const std::uint8_t* pixel = shot.picture.row(y) + 4 * x;
      for (int c = 0; c < 3; ++c) {
        const float expected = background + share[c] * (synthetic::to_linear(0.6f) - shown[c]);
        EXPECT_NEAR(synthetic::to_linear(pixel[c] / 255.0f), expected, 0.008f)
            << x << " " << y << " by " << path;
      }
    }
  for (const int path : {2, 12}) EXPECT_GT(pixels[path], 100) << path;
}

// Of more lamps than OpenGL takes those are left out that give least where the subject is, not those that
// have least power.
TEST_P(MirrorsTest, FarLampsTakeNoRoomFromNearOnes) {
  Material glass, plaster;
  glass.roughness = 0.0f;
  const Mesh box = synthetic::plain_box({-0.5f, 0.0f, -0.2f}, {0.5f, 0.5f, 0.2f}, 0.9f);
  const auto found = [&](std::size_t far) {
    Scene scene = synthetic::floor_scene(glass, {});
    scene.materials.push_back(plaster);
    scene.meshes.push_back(parallelogram("wall", 1, {-3, 0.01f, -1}, {6, 0, 0}, {0, 3, 0}));
    scene.lights.assign(far, synthetic::point_lamp({0, 0, 1e5f}, Vec3f(1e4f)));
    scene.lights.push_back(synthetic::point_lamp({0, 1.5f, 0.5f}, Vec3f(2.0f)));
    synthetic::Shot shot(scene, box,
                         synthetic::look_at({0, 0.4, 1.7}, {0, -0.15, 0.2}, 240, 240, 12.0));
    shot.settings.shadow = ShadowQuality::off;
    shot.draw(0.3f);
    return shot.picture;
  };
  const Picture with = found(40), without = found(0);
  int most = 0;
  for (std::size_t i = 0; i < with.pixels.size(); ++i)
    most = std::max(most, std::abs(with.pixels[i] - without.pixels[i]));
  EXPECT_LE(most, 1);  // they give it 4e-5
}

INSTANTIATE_TEST_SUITE_P(Api, MirrorsTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
