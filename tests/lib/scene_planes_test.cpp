// SPDX-License-Identifier: LGPL-2.1-or-later
// The triangles that a background's drawing hands over, and who takes them.
#include "view/scene_planes.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "render/processor/processor_renderer.h"
#include "synthetic.h"
#include "texture/texture_hull.h"
#include "view/background.h"

namespace polyhull {
namespace {

constexpr int width = 333, height = 187;

BackgroundOptions quick() {
  BackgroundOptions options;
  options.light = {.spacing = 0.2f, .bounce_spacing = 0.6f};
  return options;
}

Camera travelling(int step) {
  return synthetic::look_at({1.3 - 0.2 * step, 1.5, 4.2}, {0.0, 0.9, 0.0}, width, height, 50.0);
}

/// A figure in the small room, drawn before backgrounds.
struct Stage {
  Scene room = synthetic::small_room(true);
  synthetic::Photographed subject = synthetic::photographed(
      synthetic::figure(8), synthetic::ring(3, 3.2, 1.5, {0, 1, 0}, 128, 128, 60.0));
  RenderFrame frame;
  std::vector<std::uint8_t> backdrop = std::vector<std::uint8_t>(4 * width * height, 200);

  Stage() {
    std::vector<Camera> cameras;
    for (const MeshView& view : subject.mesh.views) cameras.push_back(view.calibration);
    subject.mesh.texturing =
        texture_hull(subject.mesh.hull, cameras, {.metric = TextureMetric::camera_normal});
    frame.width = width;
    frame.height = height;
    frame.scene = std::make_shared<const Scene>(room);
    frame.lights = room.lights;
    frame.exposure = room.exposure;
    frame.subjects.push_back({&subject.mesh, {}, 1});
  }
  struct Drawn {
    std::vector<std::uint8_t> picture;
    bool taken = false;
  };
  Drawn draw(ProcessorRenderer& renderer, const Camera& viewport,
             std::shared_ptr<const ScenePlanes> planes) {
    frame.viewport = viewport;
    frame.planes = std::move(planes);
    Drawn out{backdrop};
    const RenderPlan plan = renderer.plan(frame, {});
    renderer.render(frame, plan, {}, backdrop.data(), 4 * width, out.picture.data(), 4 * width);
    out.taken = renderer.statistics().scene_planes_taken;
    return out;
  }
};

TEST(ScenePlanes, GiveTheSameBitsAsNone) {
  Stage stage;
  Background background(stage.room, quick());
  ProcessorRenderer with, without;
  for (int step = 0; step < 3; ++step) {
    background.update(travelling(step), stage.room.lights, stage.room.exposure);
    ASSERT_TRUE(background.planes());
    const auto expected = stage.draw(without, travelling(step), nullptr);
    const auto drawn = stage.draw(with, travelling(step), background.planes());
    EXPECT_FALSE(expected.taken);
    EXPECT_TRUE(drawn.taken);
    EXPECT_TRUE(drawn.picture == expected.picture) << step;
    EXPECT_FALSE(drawn.picture == stage.backdrop);
    // The view stays: nothing is asked for.
    EXPECT_FALSE(stage.draw(with, travelling(step), background.planes()).taken);
  }
}

TEST(ScenePlanes, StayWhileTheBackgroundGoesOn) {
  Stage stage;
  Background background(stage.room, quick());
  background.update(travelling(0), stage.room.lights, stage.room.exposure);
  const auto first = background.planes();
  background.update(travelling(1), stage.room.lights, stage.room.exposure);
  EXPECT_NE(background.planes(), first);
  ProcessorRenderer with, without;
  const auto drawn = stage.draw(with, travelling(0), first);
  EXPECT_TRUE(drawn.taken);
  EXPECT_TRUE(drawn.picture == stage.draw(without, travelling(0), nullptr).picture);
}

TEST(ScenePlanes, AreLeftWhereTheyAreOfSomethingElse) {
  Stage stage;
  Background background(stage.room, quick());
  background.update(travelling(0), stage.room.lights, stage.room.exposure);
  const ScenePlanes& own = *background.planes();
  ProcessorRenderer plain;
  const auto expected = stage.draw(plain, travelling(0), nullptr).picture;
  const auto is_left = [&](const ScenePlanes& planes) {
    ProcessorRenderer renderer;
    const auto drawn =
        stage.draw(renderer, travelling(0), std::make_shared<const ScenePlanes>(planes));
    return !drawn.taken && drawn.picture == expected;
  };
  EXPECT_FALSE(is_left(own));
  ScenePlanes other = own;
  other.pixels_from_scene[3][0] *= 1.0 + 1e-15;  // another viewport, by a bit
  EXPECT_TRUE(is_left(other));
  other = own;
  other.width += 1;
  EXPECT_TRUE(is_left(other));
  other = own;
  other.height -= 1;
  EXPECT_TRUE(is_left(other));

  // The same file, changed meanwhile.
  Scene moved = stage.room;
  moved.meshes[0].positions[0].y += 1e-3f;
  Background elsewhere(moved, quick());
  elsewhere.update(travelling(0), moved.lights, moved.exposure);
  EXPECT_TRUE(is_left(*elsewhere.planes()));
}

TEST(ScenePlanes, AreLeftWhereALampMoved) {
  // Its mesh moves with it; composite's scene is as the file has it.
  Scene room = synthetic::small_room(false);
  Light& lamp = room.lights[0];
  SceneMesh shown;
  shown.material = static_cast<int>(room.materials.size());
  shown.positions = {lamp.centre - lamp.u - lamp.v, lamp.centre + lamp.u - lamp.v,
                     lamp.centre + lamp.u + lamp.v, lamp.centre - lamp.u + lamp.v};
  shown.normals.assign(4, glm::normalize(glm::cross(lamp.u, lamp.v)));
  shown.triangles = {0, 1, 2, 0, 2, 3};
  lamp.mesh = static_cast<int>(room.meshes.size());
  room.materials.emplace_back().emission = lamp.radiance;
  room.meshes.push_back(shown);
  Background background(room, quick());
  std::vector<Light> lights = room.lights;
  background.update(travelling(0), lights, room.exposure);
  EXPECT_EQ(background.planes()->geometry, geometry_key(room));
  lights[0].radiance *= 2.0f;
  background.update(travelling(0), lights, room.exposure);
  EXPECT_EQ(background.planes()->geometry, geometry_key(room));
  lights[0].centre.x += 0.1f;
  background.update(travelling(0), lights, room.exposure);
  EXPECT_NE(background.planes()->geometry, geometry_key(room));
}

TEST(ScenePlanes, AreNotOfWhatRaysDraw) {
  Stage stage;
  BackgroundOptions options = quick();
  options.method = ViewMethod::rays;
  Background background(stage.room, options);
  background.update(travelling(0), stage.room.lights, stage.room.exposure);
  EXPECT_FALSE(background.planes());
  background.set_method(ViewMethod::raster);
  Camera bent = travelling(0);
  bent.distortion = {-0.1, 0.0, 0.0, 0.0};
  background.update(bent, stage.room.lights, stage.room.exposure);
  EXPECT_FALSE(background.planes());
  background.update(travelling(0), stage.room.lights, stage.room.exposure);
  EXPECT_TRUE(background.planes());
}

}  // namespace
}  // namespace polyhull
