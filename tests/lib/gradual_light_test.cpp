// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/gradual_light.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "builtin/shapes.h"
#include "raytrace/light_store.h"
#include "support/folder.h"
#include "support/picture_error.h"
#include "view/background.h"

namespace polyhull {
namespace {

using synthetic::furthest;

namespace fs = std::filesystem;

/// A box on a floor of which both sides are seen, under a lamp.
Scene small_scene() {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[0].base_colour = {0.8f, 0.3f, 0.2f};
  scene.materials[1].double_sided = true;
  scene.meshes = {box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f}),
                  parallelogram("floor", 1, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2})};
  Light lamp;
  lamp.centre = {0.6f, 1.5f, 0.4f};
  lamp.u = {0.2f, 0, 0};
  lamp.v = {0, 0, 0.2f};
  lamp.radiance = Vec3f(14.0f);
  scene.lights = {lamp};
  return scene;
}

const Camera camera = look_at({1.2, 1.3, 1.8}, {0, 0.2, 0}, 45, 96, 72);

BackgroundOptions settings(bool progressive) {
  BackgroundOptions options;
  options.light.spacing = 0.02f;
  options.light.bounce_spacing = 0.1f;
  options.progressive = progressive;
  return options;
}

/// Updates like frames until the light is exact, or for \p seconds.
template <class EachFrame>
void play(Background& background, double seconds, const EachFrame& each) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!background.light_is_exact() && std::chrono::steady_clock::now() < end) {
    const auto work = background.update(camera, background.scene().lights, 1.0f);
    EXPECT_NE(work, Background::Work::lit);
    each(work);
    usleep(2000);
  }
}

TEST(GradualLight, BecomesTheExactLightWithoutJumps) {
  Background at_once(small_scene(), settings(false));
  at_once.update(camera, at_once.scene().lights, 1.0f);
  EXPECT_TRUE(at_once.light_is_exact());

  Background background(small_scene(), settings(true));
  EXPECT_EQ(background.update(camera, background.scene().lights, 1.0f), Background::Work::lit);
  EXPECT_FALSE(background.light_is_exact());
  EXPECT_LT(20 * background.light_rays(), at_once.light_rays());
  const std::vector<Vec3f> first = background.picture();
  const float whole = furthest(first, at_once.picture());
  EXPECT_GT(whole, 0.02f) << "the first light is coarse";
  EXPECT_LT(whole, 0.7f);

  std::vector<Vec3f> last = first;
  int faded = 0;
  play(background, 60.0, [&](Background::Work work) {
    EXPECT_LT(furthest(last, background.picture()), 0.1f) << "a jump";
    EXPECT_EQ(work == Background::Work::drawn, last != background.picture());
    faded += work == Background::Work::drawn;
    last = background.picture();
    if (!background.light_is_exact()) {
      EXPECT_FALSE(background.refine(camera.height));
    }
  });
  ASSERT_TRUE(background.light_is_exact());
  EXPECT_GE(faded, GradualLight::fade_frames);
  EXPECT_EQ(background.picture(), at_once.picture());
  EXPECT_EQ(background.announcement().ambient, at_once.announcement().ambient);
  EXPECT_GT(background.light_rays(), at_once.light_rays());
  EXPECT_EQ(background.update(camera, background.scene().lights, 1.0f), Background::Work::none);
  EXPECT_TRUE(background.refine(camera.height));
}

TEST(GradualLight, OnlyTheExactLightIsKept) {
  const test::Folder own;
  const fs::path folder = own / "light";
  BackgroundOptions options = settings(true);
  options.light_folder = folder;
  Background background(small_scene(), options);
  background.update(camera, background.scene().lights, 1.0f);
  EXPECT_FALSE(fs::exists(folder));
  play(background, 60.0, [](Background::Work) {});
  ASSERT_TRUE(background.light_is_exact());
  EXPECT_EQ(background.light_not_kept(), "");
  Background again(small_scene(), options);
  again.update(camera, again.scene().lights, 1.0f);
  EXPECT_TRUE(again.light_was_kept());
  EXPECT_TRUE(again.light_is_exact());
  EXPECT_EQ(again.picture(), background.picture());
}

TEST(GradualLight, AMovedLampBeginsAnew) {
  Background background(small_scene(), settings(true));
  std::vector<Light> lights = background.scene().lights;
  background.update(camera, lights, 1.0f);
  for (int i = 0; i < 5; ++i) {
    lights[0].centre.x -= 0.2f;
    EXPECT_EQ(background.update(camera, lights, 1.0f), Background::Work::lit);
    EXPECT_FALSE(background.light_is_exact());
  }
  // Brighter is a factor, also on what is yet to come.
  lights[0].radiance *= 0.5f;
  EXPECT_EQ(background.update(camera, lights, 1.0f), Background::Work::drawn);
  play(background, 60.0, [](Background::Work) {});
  Scene moved = small_scene();
  moved.lights = lights;
  Background at_once(moved, settings(false));
  at_once.update(camera, lights, 1.0f);
  EXPECT_LT(furthest(background.picture(), at_once.picture()), 1e-5f);
}

TEST(GradualLight, EndsEarly) {
  // Some hundred million ways, which would take half a minute.
  BackgroundOptions options = settings(true);
  options.light.spacing = 0.005f;
  options.light.first_samples = options.light.light_samples = 1024;
  options.light.bounce_samples = 1024;
  const auto begin = std::chrono::steady_clock::now();
  {
    const TracedScene scene(small_scene());
    const GradualLight light(scene.scene(), options.light, {});
    usleep(50000);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

TEST(BackgroundRest, ASampleUnderWayStartsAgain) {
  BackgroundOptions options = settings(false);
  options.light.spacing = 0.1f;
  const auto refined = [&](bool rests) {
    Background background(small_scene(), options);
    background.update(camera, background.scene().lights, 1.0f);
    background.update(camera, background.scene().lights, 1.0f);
    EXPECT_FALSE(background.refine(camera.height / 2));
    background.rest(rests ? 1 : 2);
    EXPECT_EQ(background.picture().empty(), rests);
    EXPECT_TRUE(background.refine(camera.height));
    EXPECT_EQ(background.samples(), 1u);
    return background.picture();
  };
  EXPECT_EQ(refined(true), refined(false));
}

TEST(BackgroundRest, TheNextViewsAreThoseOfAFreshOne) {
  const test::Folder own;
  BackgroundOptions options = settings(false);
  options.light.spacing = 0.1f;
  options.light_folder = own / "light";
  std::vector<Light> lights = small_scene().lights;
  const auto fresh = [&](const Camera& viewport) {
    Background background(small_scene(), options);
    background.update(viewport, lights, 1.0f);
    return background.picture();
  };
  fresh(camera);  // whose light is kept
  Background background(small_scene(), options);
  const auto see = [&](const Camera& viewport) {
    background.update(viewport, lights, 1.0f);
    const std::vector<Vec3f> picture = background.picture();
    background.rest(0);
    EXPECT_TRUE(background.picture().empty());
    return picture;
  };
  see(camera);
  EXPECT_TRUE(background.light_was_kept());
  const Camera aside = look_at({-1.0, 0.9, 1.9}, {0, 0.2, 0}, 45, 96, 72);
  EXPECT_EQ(see(aside), fresh(aside));
  options.light_folder.clear();
  lights[0].centre.x -= 0.5f;
  EXPECT_EQ(see(aside), fresh(aside));
  background.refine(camera.height);
  const std::vector<Vec3f> picture = background.picture();
  background.rest(0);
  EXPECT_EQ(background.picture(), picture) << "samples are kept";
}

}  // namespace
}  // namespace polyhull
