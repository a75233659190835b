// SPDX-License-Identifier: LGPL-2.1-or-later
// What bodies keep of the scene's light from themselves and from each other: against many rays, and against
// paths to the figure on its walk.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "backend.h"
#include "figure_stage.h"
#include "lit_walk.h"
#include "picture_error.h"
#include "raytrace/traced_scene.h"
#include "render/light_lattice.h"
#include "render/light_samples.h"
#include "render/projection.h"
#include "render/subject_light.h"
#include "shot.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::plain_box;
using synthetic::point_lamp;

constexpr float top = 0.9f;  // of the block that is lit

Scene black_floor(const Light& lamp) {
  Material black;
  black.base_colour = Vec3f(0.0f);
  return floor_scene(black, lamp);
}

/// A lamp of half a metre that shines down.
Light ceiling_lamp(const Vec3f& centre, const Vec3f& radiance) {
  Light lamp = point_lamp(centre, radiance);
  lamp.u = {0.25f, 0, 0};
  lamp.v = {0, 0, 0.25f};
  return lamp;
}

/// Places on top of a block below a plate that hangs over it, and the light there.
struct Covered {
  Mesh block = plain_box({-0.5f, 0.5f, -0.5f}, {0.5f, top, 0.5f}, 0.5f);
  Mesh plate = plain_box({-0.15f, 1.3f, -0.2f}, {0.25f, 1.35f, 0.2f}, 0.5f);
  Scene scene;
  std::shared_ptr<const LightLattice> lattice;
  BodyTrees trees;
  RayCaster caster;  // the plate
  std::vector<Vec3f> places, normals;

  explicit Covered(Scene lit, const Vec3f& ambient = Vec3f(0.0f)) : scene(std::move(lit)) {
    RenderFrame frame;
    frame.scene = std::make_shared<const Scene>(scene);
    frame.lights = scene.lights;
    frame.ambient = ambient;
    PlacedSubject subject;
    subject.points = block.hull.vertices;
    lattice = SubjectLight().around(subject, frame, TracedScene(scene));
    trees.make(0, {block.hull.vertices, block.hull.triangles});
    trees.make(1, {plate.hull.vertices, plate.hull.triangles});
    caster.add_mesh(plate.hull.vertices, plate.hull.triangles);
    caster.commit();
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 40; ++j)
        places.emplace_back(-0.49f + 0.98f * i / 39.0f, top, -0.49f + 0.98f * j / 39.0f);
    normals.assign(places.size(), Vec3f(0, 1, 0));
  }
  std::vector<float> form(float amount, const Hiding& hiding) const {
    std::vector<float> out;
    for (const Vec3f& value : find_form(*lattice, places, normals, amount, hiding))
      out.push_back(value.x);
    return out;
  }
};

// The share of a lamp's light that a plate leaves, be it the body's own or another's, of what falls on the
// surface and of the mean over all orientations.
TEST(BodyLight, LampsAreHiddenLikeByManyRays) {
  const Covered stage(black_floor(ceiling_lamp({0, 2.6f, 0}, Vec3f(20.0f))));
  const Light& lamp = stage.scene.lights[0];
  std::mt19937 random(3);
  std::uniform_real_distribution<float> part(0.0f, 1.0f);
  for (const bool own : {true, false})
    for (const float amount : {0.0f, 1.0f}) {
      Hiding hiding{&stage.trees, {}, {}, 0.0f};
      if (own)
        hiding.own = 1;
      else
        hiding.others = {{1, bounds_of(stage.plate.hull.vertices)}};
      const std::vector<float> clear = stage.form(amount, {}), found = stage.form(amount, hiding);
      double squares = 0.0;
      int borders = 0;
      for (std::size_t i = 0; i < stage.places.size(); ++i) {
        double all = 0.0, left = 0.0;
        for (int k = 0; k < 256; ++k) {
          const float x = ((k % 16 + part(random)) / 8.0f - 1.0f);
          const float y = ((k / 16 + part(random)) / 8.0f - 1.0f);
          const Vec3f way = lamp.centre + x * lamp.u + y * lamp.v - stage.places[i];
          const double square = glm::dot(way, way), cosine = way.y / std::sqrt(square);
          const double given = cosine / square * (amount > 0.0f ? cosine : 1.0);
          all += given;
          if (!stage.caster.occluded({stage.places[i], 0.0f, way, 1.0f})) left += given;
        }
        // A body's own shadow is no part of the mean over all orientations.
        const double expected = own && amount == 0.0f ? 1.0 : left / all;
        borders += expected > 0.1 && expected < 0.9;
        squares += std::pow(found[i] / clear[i] - expected, 2.0);
      }
      const double rms = std::sqrt(squares / static_cast<double>(stage.places.size()));
      std::printf("share of the lamp, %s, relight=%g: RMS %.4f, %d of %zu at borders\n",
                  own ? "own" : "another's", amount, rms, borders, stage.places.size());
      EXPECT_LT(rms, 0.02);  // a border's is that of steps of 1/16, or twice that across corners
      EXPECT_TRUE(borders > 100 || (own && amount == 0.0f));
    }
}

TEST(BodyLight, TreesOfBodiesThatAreGoneAreGivenUp) {
  const Mesh box = plain_box({-0.5f, 0.5f, -0.5f}, {0.5f, 1.0f, 0.5f}, 0.5f);
  const Body body{box.hull.vertices, box.hull.triangles, 7};
  BodyTrees trees;
  for (const std::size_t number : {0u, 1u, 3u}) trees.make(number, body);
  trees.drop_unused();
  EXPECT_EQ(trees.size(), 3u);
  trees.make(3, body);
  trees.drop_unused();
  EXPECT_EQ(trees.size(), 1u);
  std::uint8_t hidden = 0;
  const Ray up{Vec3f(0.0f), 0.0f, {0, 1, 0}};
  trees.hide(3, {&up, 1}, {&hidden, 1});
  EXPECT_EQ(hidden, 1);
  trees.drop_unused();
  EXPECT_EQ(trees.size(), 0u);
}

// In light that is the same from all sides: what the plate hides of it, and what it sends instead.
TEST(BodyLight, AmbientLightIsHiddenLikeByManyRays) {
  const Covered stage(black_floor(point_lamp({0, 2.6f, 0}, Vec3f(0.0f))), Vec3f(0.2f));
  std::mt19937 random(5);
  std::normal_distribution<float> any(0.0f, 1.0f);
  const std::vector<float> found = stage.form(1.0f, {&stage.trees, 1, {}, 0.0f});
  double squares = 0.0;
  for (std::size_t i = 0; i < stage.places.size(); ++i) {
    double all = 0.0, hidden = 0.0;
    for (int k = 0; k < 400; ++k) {
      Vec3f way = glm::normalize(Vec3f(any(random), any(random), any(random)));
      way.y = std::abs(way.y);
      all += way.y;
      if (stage.caster.occluded({stage.places[i], 0.0f, way})) hidden += way.y;
    }
    const double expected = 1.0 - (1.0 - 0.3) * hidden / all;
    squares += std::pow(found[i] - expected, 2.0);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(stage.places.size())), 0.04);
}

// The radiance that moments say comes from each way gives what they say falls on a surface.
TEST(BodyLight, RadianceAddsUpToTheIrradiance) {
  LightMoments light;
  light.add_even(Vec3f(3.0f));
  light.add(glm::normalize(Vec3f(0.2f, 0.9f, -0.4f)), {1.0f, 0.7f, 0.2f});
  light.add(glm::normalize(Vec3f(-0.8f, 0.1f, 0.3f)), {0.1f, 0.5f, 0.9f});
  std::mt19937 random(5);
  std::normal_distribution<float> any(0.0f, 1.0f);
  constexpr int rays = 40000;
  for (const Vec3f& normal : {Vec3f(0, 1, 0), Vec3f(-0.6f, 0, 0.8f), Vec3f(0, -0.8f, 0.6f)}) {
    Vec3 sum(0.0);
    for (int i = 0; i < rays; ++i) {
      const Vec3f way = glm::normalize(Vec3f(any(random), any(random), any(random)));
      sum += Vec3(std::max(glm::dot(normal, way), 0.0f) * light.radiance(way));
    }
    sum *= 4.0 * std::numbers::pi / rays;
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(sum[c], light.irradiance(normal)[c], 0.03 * sum[c]) << normal.y << " " << c;
  }
}

/// Boxes that are subjects in one picture.
struct Boxes {
  std::vector<Mesh> meshes;
  RenderFrame frame;
  ProcessorRenderer renderer;

  Boxes(Scene scene, std::vector<Mesh> boxes) : meshes(std::move(boxes)) {
    frame.width = 320, frame.height = 240;
    frame.viewport = synthetic::look_at({0, 1, 6}, {0, 0.5, 0}, 320, 240, 60.0);
    frame.lights = scene.lights;
    frame.scene = std::make_shared<const Scene>(std::move(scene));
    for (const Mesh& mesh : meshes)
      frame.subjects.push_back(
          {&mesh, {}, frame.subjects.size() + 1, nullptr, SubjectLighting::shade});
  }
  /// The mean form of a subject; 1 where it has none.
  float form(std::size_t subject) {
    const RenderPlan plan = renderer.plan(frame, {});
    const std::vector<Vec3f>& form = plan.subjects.at(subject).form;
    float sum = 0.0f;
    for (const Vec3f& value : form) sum += value.y;
    return form.empty() ? 1.0f : sum / static_cast<float>(form.size());
  }
  bool formed(std::size_t subject) {
    return !renderer.plan(frame, {}).subjects.at(subject).form.empty();
  }
};

// Shaded subjects are darkened by those that stand before the lamp, where they stand now, and cost nothing
// where nobody can.
TEST(BodyLight, OthersHideTheLampWhileTheyStandBeforeIt) {
  Boxes boxes(black_floor(point_lamp({-3, 0.8f, 0}, Vec3f(5.0f))),
              {plain_box({0.5f, 0.2f, -0.3f}, {1.1f, 1.4f, 0.3f}, 0.5f),
               plain_box({-0.9f, 0.0f, -0.5f}, {-0.5f, 1.6f, 0.5f}, 0.5f)});
  EXPECT_LT(boxes.form(0), 0.01f) << "all of it is hidden";
  EXPECT_FALSE(boxes.formed(1)) << "what stands behind it hides nothing";
  boxes.frame.subjects[1].placement.translate.z = 3.0;  // the same mesh elsewhere
  EXPECT_FALSE(boxes.formed(0));
  boxes.frame.subjects[1].placement.translate.z = 0.55;  // half of it
  EXPECT_NEAR(boxes.form(0), 0.5f, 0.01f);
  boxes.frame.subjects[1].placement.translate.z = 0.0;
  EXPECT_LT(boxes.form(0), 0.01f);
  boxes.frame.subjects[0].lighting = SubjectLighting::relit;
  boxes.frame.subjects[0].relight = 1.0f;
  EXPECT_LT(boxes.form(0), 0.01f);
  boxes.frame.subjects.pop_back();
  EXPECT_GT(boxes.form(0), 0.5f) << "now half of its faces look at the lamp";
  boxes.frame.subjects[0].lighting = SubjectLighting::shade;
  EXPECT_FALSE(boxes.formed(0));
}

using BodyLightPictureTest = testing::BackendTest;

// Of two figures beside a lamp the farther one, which is shaded, is darker than without the nearer one,
// which is relit, and both renderers draw the same.
TEST_P(BodyLightPictureTest, TwoFiguresLookTheSame) {
  synthetic::FigureStage stage(240, 135, false);
  stage.fill_background(150);
  stage.frame.lights = {point_lamp({-1.6f, 1.3f, 0.2f}, Vec3f(3.0f))};
  stage.frame.subjects[0].placement.translate.x = 0.5;
  stage.frame.subjects[0].lighting = SubjectLighting::shade;
  const auto renderer = make_renderer();
  RenderSettings settings;
  settings.shadow = ShadowQuality::off;  // on the room
  settings.mirror = MirrorMode::off;
  const Rectangle farther = renderer->plan(stage.frame, settings).subject;
  const auto brightness = [&](const Picture& picture) {
    double sum = 0.0;
    for (int y = farther.y; y < farther.y + farther.height; ++y)
      for (int x = farther.x; x < farther.x + farther.width; ++x) sum += picture.row(y)[4 * x];
    return sum / (farther.width * farther.height);
  };
  const double alone = brightness(stage.composite(*renderer, settings));
  stage.frame.subjects.push_back(stage.frame.subjects[0]);
  stage.frame.subjects[1].placement.translate.x = -0.5;
  stage.frame.subjects[1].lighting = SubjectLighting::relit;
  const Picture both = stage.composite(*renderer, settings);
  EXPECT_LT(brightness(both), alone - 5.0);
  if (const char* folder = std::getenv("POLYHULL_PICTURES"))
    save_picture(both, std::string(folder) + "/two-figures.png");
  ProcessorRenderer other;
  EXPECT_GT(synthetic::psnr(both, stage.composite(other, settings)), 42.0);
}

INSTANTIATE_TEST_SUITE_P(Api, BodyLightPictureTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

// The true figure, relit with the studio's light known, against paths.
TEST(BodyLight, TheFigureIsRelitLikeByPaths) {
  using enum synthetic::WalkKind;
  synthetic::LitWalk walk(40, 60, 48);
  for (const synthetic::Stop& stop : synthetic::walk_stops) {
    const synthetic::LitWalk::Shown shown = walk.at(stop, {relit});
    const double found = synthetic::psnr_of_codes(shown[known], shown[relit]);
    std::printf("%-20s relit %.1f dB, without its shadows %.1f, light=relit %.1f\n", stop.name,
                found, synthetic::psnr_of_codes(shown[clear], shown[relit]),
                synthetic::psnr_of_codes(shown[form], shown[relit]));
    // The hand that touches the pillar is darker than the lattice, which is coarser, can say.
    EXPECT_GT(found, stop.name == std::string("its shadow") ? 27.0 : 30.0) << stop.name;
  }
}

}  // namespace
}  // namespace polyhull
