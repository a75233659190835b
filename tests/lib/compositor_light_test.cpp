// SPDX-License-Identifier: LGPL-2.1-or-later
// Single pixels of a composite against what a formula says of them: the lamp's cosine law, Schlick's
// reflectance, where a shadow and a mirror image begin.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "backend.h"
#include "raytrace/path_tracer.h"
#include "shot.h"
#include "synthetic.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::plain_box;
using synthetic::point_lamp;
using synthetic::Shot;

using CompositorLightTest = testing::BackendTest;

/// A wall behind all, of \p material.
void add_back_wall(Scene& scene, const Material& material) {
  SceneMesh wall = scene.meshes[0];
  wall.material = static_cast<int>(scene.materials.size());
  wall.positions = {{-3, 0.01f, -1}, {3, 0.01f, -1}, {3, 3, -1}, {-3, 3, -1}};
  wall.normals.assign(4, Vec3f(0, 0, 1));
  scene.materials.push_back(material);
  scene.meshes.push_back(wall);
}

// In the core of the shadow albedo / pi * exposure * power * cosine / distance^2 is missing; an area
// lamp's power falls with the cosine at the lamp, too.
TEST_P(CompositorLightTest, TheShadowTakesWhatTheLampGave) {
  Material material;
  material.base_colour = {0.8f, 0.5f, 0.3f};
  const Mesh screen = plain_box({0.7f, 0.3f, -0.3f}, {0.75f, 0.9f, 0.3f}, 0.5f);
  const Vec3 centre(1.5, 1.2, 0.0);
  for (const std::string kind : {"point", "area", "spot"}) {
    const bool area = kind != "point", spot = kind == "spot";
    Light lamp = point_lamp(Vec3f(centre), {10.0f, 9.0f, 8.0f});
    if (spot) lamp.inner_cone = 0.6f, lamp.outer_cone = 1.2f;
    if (area) {
      lamp.u = {0.04f, 0, 0};
      lamp.v = {0, 0, 0.03f};
      lamp.radiance /= 4.0f * 0.04f * 0.03f;
    }
    Scene scene = floor_scene(material, lamp);
    scene.exposure = 0.5f;
    for (const ShadowQuality quality :
         {ShadowQuality::hard, ShadowQuality::fast, ShadowQuality::good}) {
      Shot shot(scene, screen, synthetic::look_at({0, 2.5, 2.5}, {-0.3, 0, 0.2}, 320, 240, 40.0));
      shot.settings.shadow = quality;
      shot.draw(0.5f);
      for (const Vec3& point :
           {Vec3(0, 0, 0), Vec3(-0.3, 0, 0.2), Vec3(-0.7, 0, -0.2), Vec3(0.15, 0, 0.1)}) {
        const Vec3 way = centre - point;
        const double cosine = way.y / glm::length(way), d2 = glm::dot(way, way);
        // KHR_lights_punctual's.
        const double cone =
            std::clamp((cosine - std::cos(1.2)) / (std::cos(0.6) - std::cos(1.2)), 0.0, 1.0);
        const double irradiance = 0.5 * cosine * (spot ? cone * cone : area ? cosine : 1.0) / d2;
        const Vec3f found = shot.at(point);
        for (int c = 0; c < 3; ++c) {
          const double power = Vec3(10, 9, 8)[c];
          const double expected =
              0.5 - material.base_colour[c] / std::numbers::pi * power * irradiance;
          EXPECT_NEAR(found[c], expected, 0.006)
              << kind << " quality " << static_cast<int>(quality) << " x " << point.x;
        }
      }
      EXPECT_EQ(shot.pixel({0.0, 0, 1.0})[0], shot.pixel({-0.7, 0, 1.0})[0]);
      EXPECT_NEAR(shot.at({0.0, 0, 1.0}).x, 0.5, 0.004);  // beside the shadow
    }
  }
}

// A plate half way between a square lamp and the floor, its edge below the lamp's middle: on the floor
// the shadow's edge is as wide as the lamp. From one sample, which four looks widen, it has steps.
TEST_P(CompositorLightTest, ThePenumbraIsAsWideAsTheLampMakesIt) {
  constexpr double half = 0.25, height = 2.0, step = 0.02;
  Light lamp = point_lamp({0, height, 0}, {10.0f, 9.0f, 8.0f});
  lamp.u = {half, 0, 0};
  lamp.v = {0, 0, half};
  lamp.radiance /= 4.0f * half * half;
  Scene scene = floor_scene({}, lamp);
  scene.exposure = 0.5f;
  const Mesh plate = plain_box({-2.0f, 0.98f, -2.0f}, {0.0f, 1.0f, 2.0f}, 0.5f);
  Shot shot(scene, plate, synthetic::look_at({1.6, 0.5, 0}, {0, 0, 0}, 320, 240, 40.0));
  shot.settings.shadow = ShadowQuality::good;
  for (const int samples : {1, 16}) {
    shot.settings.light_samples = samples;
    shot.draw(0.5f);
    const double lit = shot.at({0.4, 0, 0.1}).x, shaded = shot.at({-0.4, 0, 0.1}).x;
    double middle = 0.0, width = 0.0;
    for (double x = -0.4; x < 0.4; x += step) {
      const double part = (shot.at({x, 0, 0.1}).x - shaded) / (lit - shaded);
      middle += step * (0.5 - part);
      if (part > 0.05 && part < 0.95) width += step;
    }
    EXPECT_NEAR(middle, 0.0, samples == 1 ? 0.1 : 0.06);  // the looks are not even
    EXPECT_NEAR(width, 0.9 * 2.0 * half, samples == 1 ? 0.12 : 0.07) << samples << " samples";
  }
}

// What the scene's own wall shades already is not darkened again, but for a strip at the shadow's end
// that two texels of the lamp's map make.
TEST_P(CompositorLightTest, TheScenesOwnShadowIsNotDarkenedTwice) {
  Material material;
  const Vec3 lamp(2.0, 2.5, 0.0);
  Scene scene = floor_scene(material, point_lamp(Vec3f(lamp), Vec3f(9.0f)));
  SceneMesh wall = scene.meshes[0];
  wall.positions = {{0, 0, 1}, {0, 0, -1}, {0, 0.5f, -1}, {0, 0.5f, 1}};
  wall.normals.assign(4, Vec3f(-1, 0, 0));
  scene.meshes.push_back(wall);
  const Mesh roof = plain_box({-0.4f, 0.9f, -0.3f}, {1.0f, 0.95f, 0.3f}, 0.5f);
  Shot shot(scene, roof, synthetic::look_at({-2, 1.2, 0.01}, {-0.5, 0, 0}, 320, 240, 25.0));
  shot.draw(0.5f);
  const auto share = [&](double x) {  // of the lamp's light that was taken
    const Vec3 way = lamp - Vec3(x, 0, 0);
    const double given = 9.0 / std::numbers::pi * way.y / std::pow(glm::length(way), 3.0);
    return (0.5 - shot.at({x, 0, 0}).x) / given;
  };
  for (double x = -0.75; x < -0.56; x += 0.01) EXPECT_NEAR(share(x), 1.0, 0.05) << x;
  for (double x = -0.4; x < -0.25; x += 0.01) EXPECT_NEAR(share(x), 0.0, 0.02) << x;
  double end = -0.6;
  while (end < -0.3 && share(end) > 0.5) end += 0.002;
  // The wall's shadow ends at -0.5.
  EXPECT_GT(end, -0.5);
  EXPECT_LT(end, -0.425);
}

// A shadow of what stands on the floor begins at its foot.
TEST_P(CompositorLightTest, TheShadowBeginsAtTheFoot) {
  Material material;
  const Vec3 lamp(2.0, 2.0, 0.0);
  const Scene scene = floor_scene(material, point_lamp(Vec3f(lamp), Vec3f(9.0f)));
  const Mesh box = plain_box({0.0f, 0.0f, -0.3f}, {0.1f, 0.5f, 0.3f}, 0.5f);
  Shot shot(scene, box, synthetic::look_at({-1.5, 1.0, 0.01}, {-0.3, 0, 0}, 320, 240, 32.0));
  shot.draw(0.5f);
  const double given = 9.0 / std::numbers::pi * 2.0 / std::pow(8.0, 1.5);
  for (double x = -0.30; x < -0.015; x += 0.01)
    EXPECT_LT(shot.at({x, 0, 0}).x, 0.5 - 0.6 * given) << x;
  // Its end is where the ray over the upper edge meets the floor: 0.5 * 2 / 1.5 from x = 0.
  EXPECT_LT(shot.at({-0.62, 0, 0}).x, 0.5 - 0.3 * given);
  EXPECT_NEAR(shot.at({-0.71, 0, 0}).x, 0.5, 0.01);
}

// The mirror image meets the foot and is as bright as Schlick says, down to grazing views.
TEST_P(CompositorLightTest, TheMirrorImageMeetsTheFootAndFollowsSchlick) {
  Material material;
  material.base_colour = Vec3f(0.5f);
  material.roughness = 0.0f;
  for (const float ior : {1.5f, 2.2f}) {
    material.ior = ior;
    const Scene scene = floor_scene(material, point_lamp({0, 3, 0}, Vec3f(1.0f)));
    const Mesh box = plain_box({-0.5f, 0.0f, -0.2f}, {0.5f, 0.5f, 0.2f}, 0.9f);
    const float colour = synthetic::to_linear(0.9f);
    const double f0 = std::pow((ior - 1.0) / (ior + 1.0), 2.0);
    for (const double height : {0.12, 0.3, 1.0}) {
      Shot shot(scene, box, synthetic::look_at({0, height, 1.7}, {0, -0.12, 0.2}, 240, 400, 16.0));
      shot.settings.shadow = ShadowQuality::off;
      shot.draw(0.1f);
      for (const double y : {0.006, 0.05, 0.1, 0.2}) {
        const Vec3 image(0.01, -y, 0.2);
        const Vec3 way = glm::normalize(image - Vec3(0, height, 1.7));
        const double fresnel = f0 + (1.0 - f0) * std::pow(1.0 + way.y, 5.0);
        // Nothing of the scene is seen in this mirror.
        EXPECT_NEAR(shot.at(image).x, 0.1 + fresnel * colour, 0.006)
            << "ior " << ior << " from " << height << " m, " << y << " m above the foot";
      }
    }
  }
}

TEST_P(CompositorLightTest, APlainMirrorMixesByItsShare) {
  Material material;
  material.roughness = 0.0f;
  const Scene scene = floor_scene(material, point_lamp({0, 3, 0}, Vec3f(1.0f)));
  const Mesh box = plain_box({-0.5f, 0.0f, -0.2f}, {0.5f, 0.5f, 0.2f}, 0.9f);
  Shot shot(scene, box, synthetic::look_at({0, 0.3, 1.7}, {0, -0.12, 0.2}, 240, 400, 16.0));
  shot.settings.shadow = ShadowQuality::off;
  shot.settings.mirror = MirrorMode::plain;
  shot.settings.reflection_alpha = 0.4f;
  shot.draw(0.1f);
  EXPECT_NEAR(shot.at({0.01, -0.1, 0.2}).x, 0.6f * 0.1f + 0.4f * synthetic::to_linear(0.9f), 0.006);
}

// What a mirror reflects it does not scatter: less is taken from it, by Schlick and by its metal.
TEST_P(CompositorLightTest, TheShadowOnAMirrorTakesWhatItScattered) {
  const Mesh screen = plain_box({0.7f, 0.3f, -0.3f}, {0.75f, 0.9f, 0.3f}, 0.5f);
  const Vec3 lamp(1.5, 1.2, 0.0);
  Material material;
  material.base_colour = Vec3f(0.8f);
  material.roughness = 0.0f;
  material.ior = 2.0f;
  for (const float metallic : {0.0f, 0.4f}) {
    material.metallic = metallic;
    const double f0 = (1 - metallic) / 9.0 + metallic * 0.8;
    for (const double height : {0.5, 2.5}) {
      const Vec3 eye(0, height, 2.5), point(-0.3, 0, 0.1);
      Shot shot(floor_scene(material, point_lamp(Vec3f(lamp), Vec3f(8.0f))), screen,
                synthetic::look_at(eye, {-0.3, 0, 0.1}, 160, 120, 20.0));
      shot.settings.mirror = MirrorMode::off;
      shot.draw(0.5f);
      const Vec3 way = lamp - point;
      const double cosine = glm::normalize(eye - point).y;
      const double fresnel = f0 + (1 - f0) * std::pow(1 - cosine, 5.0);
      const double given = 8.0 * way.y / std::pow(glm::length(way), 3.0);
      EXPECT_NEAR(shot.at(point).x,
                  0.5 - 0.8 * (1 - fresnel) * (1 - metallic) / std::numbers::pi * given, 0.006)
          << "metallic " << metallic << " from " << height;
    }
  }
}

TEST_P(CompositorLightTest, TheShadowOnATextureHasItsColours) {
  const Mesh screen = plain_box({0.7f, 0.3f, -0.3f}, {0.75f, 0.9f, 0.3f}, 0.5f);
  const Vec3 lamp(1.5, 1.2, 0.0);
  Material material;
  material.base_colour = {1.0f, 0.5f, 1.0f};
  material.base_colour_texture = 0;
  Scene scene = floor_scene(material, point_lamp(Vec3f(lamp), Vec3f(8.0f)));
  scene.meshes[0].texture_coordinates.assign(4, Vec2f(0.5f));
  Picture texture{4, 4, 4, std::vector<std::uint8_t>(64, 255)};
  for (std::size_t i = 0; i < 16; ++i) texture.pixels[4 * i] = texture.pixels[4 * i + 1] = 150;
  scene.textures = {texture};
  Shot shot(scene, screen, synthetic::look_at({0, 2.5, 2.5}, {-0.3, 0, 0.1}, 160, 120, 20.0));
  shot.draw(0.5f);
  const Vec3 point(-0.3, 0, 0.1), way = lamp - point;
  const double given = 8.0 * way.y / std::pow(glm::length(way), 3.0) / std::numbers::pi;
  const double value = synthetic::to_linear(150 / 255.0f);
  const Vec3f found = shot.at(point);
  EXPECT_NEAR(found.x, 0.5 - value * given, 0.006);
  EXPECT_NEAR(found.y, 0.5 - 0.5 * value * given, 0.006);
  EXPECT_NEAR(found.z, 0.5 - given, 0.006);
}

// What the mirror showed there is taken out, also where the picture does not hold it: then it is lit.
TEST_P(CompositorLightTest, WhatTheMirrorShowedIsTakenOut) {
  Material glass, plaster;
  glass.roughness = 0.0f;
  plaster.base_colour = {0.6f, 0.5f, 0.4f};
  plaster.emission = {0.05f, 0.1f, 0.15f};
  const Vec3 lamp(0, 1.5, 0.5);
  Scene scene = floor_scene(glass, point_lamp(Vec3f(lamp), Vec3f(2.0f)));
  add_back_wall(scene, plaster);
  scene.exposure = 0.7f;
  const Mesh box = plain_box({-0.5f, 0.0f, -0.2f}, {0.5f, 0.5f, 0.2f}, 0.9f);
  const Vec3 eye(0, 0.4, 1.7);
  for (const bool spot : {false, true}) {
    if (spot) {
      Light& light = scene.lights[0];
      light.u = {0, 0.01f, 0};  // towards the wall
      light.v = {0.01f, 0, 0};
      light.radiance /= 4e-4f;
      light.inner_cone = 0.2f;
      light.outer_cone = 1.2f;
    }
    Shot shot(scene, box, synthetic::look_at(eye, {0, -0.15, 0.2}, 240, 240, 12.0));
    shot.frame.ambient = Vec3f(0.4f, 0.3f, 0.2f);
    shot.settings.shadow = ShadowQuality::off;
    const double background = shot.draw(0.3f);
    for (const double y : {0.05, 0.15}) {
      const Vec3 image(0.01, -y, 0.2), way = image - eye;
      // The wall's point on the way through the mirror.
      Vec3 seen = eye + way * ((-1.0 - eye.z) / way.z);
      seen.y = -seen.y;
      const Vec3 light = lamp - seen;
      const double cone = std::clamp(
          (light.z / glm::length(light) - std::cos(1.2)) / (std::cos(0.2) - std::cos(1.2)), 0.0,
          1.0);
      const double lit =
          2.0 * light.z / std::pow(glm::length(light), 3.0) * (spot ? cone * cone : 1.0);
      const double cosine = -glm::normalize(way).y;
      const double fresnel = 0.04 + 0.96 * std::pow(1 - cosine, 5.0);
      const Vec3f found = shot.at(image);
      for (int c = 0; c < 3; ++c) {
        const double shown =
            0.7 * (plaster.base_colour[c] / std::numbers::pi * (shot.frame.ambient[c] + lit) +
                   plaster.emission[c]);
        EXPECT_NEAR(found[c], background + fresnel * (synthetic::to_linear(0.9f) - shown), 0.004)
            << y << " channel " << c << " spot " << spot;
      }
    }
  }
}

// So is the sky, where it showed that.
TEST_P(CompositorLightTest, TheSkyInTheMirrorIsTakenOut) {
  Material glass;
  glass.roughness = 0.0f;
  Scene scene = floor_scene(glass, point_lamp({0, 1.5f, 0.5f}, Vec3f(2.0f)));
  scene.exposure = 0.5f;
  const Mesh box = plain_box({-0.5f, 0.0f, -0.2f}, {0.5f, 0.5f, 0.2f}, 0.9f);
  const Vec3 eye(0, 0.4, 1.7), image(0.01, -0.1, 0.2);
  Shot shot(scene, box, synthetic::look_at(eye, {0, -0.15, 0.2}, 240, 240, 12.0));
  shot.frame.sky = {0.4f, 0.8f, 3.0f};  // the last is shown as white
  shot.settings.shadow = ShadowQuality::off;
  const double background = shot.draw(0.5f);
  const double fresnel = 0.04 + 0.96 * std::pow(1.0 + glm::normalize(image - eye).y, 5.0);
  const Vec3f found = shot.at(image);
  for (int c = 0; c < 3; ++c) {
    const double shown = Vec3(0.2, 0.4, 1.0)[c];
    EXPECT_NEAR(found[c], background + fresnel * (synthetic::to_linear(0.9f) - shown), 0.004) << c;
  }
}

// The sun is a lamp far away: in the core of its shadow is missing what it gave, beside it nothing, and
// where the scene itself shades nothing more.
TEST_P(CompositorLightTest, TheSunThrowsAShadow) {
  Material material;
  const Vec3 to_sun = glm::normalize(Vec3(0.5, 1.0, 0.6));
  const Vec3 x = glm::normalize(glm::cross(Vec3(0, 1, 0), to_sun));
  const Mesh body = plain_box({-0.2f, 0.3f, -0.2f}, {0.2f, 1.2f, 0.2f}, 0.5f);
  for (const double far : {60.0, 1000.0, 4000.0}) {
    Light sun;
    const double half = far * std::tan(0.02);
    sun.centre = Vec3(far * to_sun);
    sun.u = Vec3(half * glm::cross(to_sun, x));
    sun.v = Vec3(half * x);
    sun.radiance = Vec3f(static_cast<float>(1.5 * far * far / (4.0 * half * half)));
    Scene scene = floor_scene(material, sun);
    SceneMesh plate = scene.meshes[0];  // over the body's upper end
    const Vec3 top = Vec3(0, 1.1, 0) + to_sun;
    for (Vec3f& p : plate.positions) p = Vec3f(top) + p / 25.0f;
    scene.meshes.push_back(plate);
    for (const ShadowQuality quality : {ShadowQuality::hard, ShadowQuality::good}) {
      Shot shot(scene, body,
                synthetic::look_at({-2.6, 2.6, -2.2}, {-0.3, 0, -0.3}, 320, 240, 50.0));
      shot.settings.shadow = quality;
      shot.draw(0.7f);
      const auto shadow_of = [&](double y) { return Vec3(0, y, 0) - to_sun * (y / to_sun.y); };
      const double missing = 1.5 * to_sun.y / std::numbers::pi;
      for (const double y : {0.5, 0.6, 0.65})
        EXPECT_NEAR(shot.at(shadow_of(y)).x, 0.7 - missing, far == 1000.0 ? 0.006 : 0.025)
            << far << " quality " << static_cast<int>(quality) << " y " << y;
      for (const Vec3& lit : {shadow_of(1.1), shadow_of(2.0), Vec3(0.7, 0, -1.2)})
        EXPECT_NEAR(shot.at(lit).x, 0.7, 0.004)
            << far << " quality " << static_cast<int>(quality) << " x " << lit.x;
    }
  }
}

// A lamp near what it lights throws its shadow however far the scene's middle is.
TEST_P(CompositorLightTest, ALampFarFromTheScenesMiddleThrowsAShadow) {
  Material material;
  const Vec3 lamp(1.5, 1.2, 0.0);
  Scene scene = floor_scene(material, point_lamp(Vec3f(lamp), Vec3f(5.0f)));
  SceneMesh away = scene.meshes[0];
  for (Vec3f& p : away.positions) p.x += 1800.0f;
  scene.meshes.push_back(away);
  const Mesh screen = plain_box({0.7f, 0.3f, -0.3f}, {0.75f, 0.9f, 0.3f}, 0.5f);
  Shot shot(scene, screen, synthetic::look_at({0, 2.5, 2.5}, {-0.3, 0, 0.2}, 320, 240, 40.0));
  for (const ShadowQuality quality : {ShadowQuality::hard, ShadowQuality::good}) {
    shot.settings.shadow = quality;
    shot.draw(0.5f);
    for (const Vec3& point : {Vec3(-0.3, 0, 0.2), Vec3(-0.7, 0, -0.2), Vec3(0.15, 0, 0.1)}) {
      const Vec3 way = lamp - point;
      const double given = 5.0 / std::numbers::pi * way.y / std::pow(glm::length(way), 3.0);
      EXPECT_NEAR(shot.at(point).x, 0.5 - given, 0.006)
          << static_cast<int>(quality) << " x " << point.x;
    }
  }
}

// The shadow in a spot's light: the picture after the composite is the path tracer's of the scene with
// the subject, within the cone, at its soft border and beyond.
TEST_P(CompositorLightTest, ASpotsShadowIsTheTraced) {
  Material material;
  material.base_colour = Vec3f(0.6f);
  material.emission = Vec3f(0.2f);  // what is taken beyond the cone is missing there, too
  Light lamp = point_lamp({0.2f, 2.2f, 0.1f}, Vec3f(12.0f / 0.16f));
  lamp.u = {0.2f, 0, 0};
  lamp.v = {0, 0, 0.2f};
  lamp.inner_cone = 0.3f;
  lamp.outer_cone = 0.5f;
  const Scene scene = floor_scene(material, lamp);
  // Black, so that its own light is none; half of its shadow lies beyond the cone.
  const Mesh body = plain_box({0.4f, 0.9f, -0.25f}, {0.9f, 1.0f, 0.3f}, 0.0f);
  const Camera viewport = synthetic::look_at({0.2, 2.6, 3.0}, {0.4, 0, 0}, 160, 120, 34.0);
  TracedScene traced(scene);
  const PathOptions paths{.light_samples = 16};
  const Picture before = trace_picture(traced, viewport, 16, paths);
  traced.set_subjects({{body.hull.vertices, body.hull.triangles,
                        [](std::uint32_t, float, float, const Vec3f&) { return Vec3f(0.0f); }}});
  const Picture truth = trace_picture(traced, viewport, 16, paths);
  Shot shot(scene, body, viewport);
  // Of the light that the subject takes, the share that is taken wrongly.
  const auto wrong = [&](const Picture& picture) {
    double off = 0.0, all = 0.0;
    const auto light = [](std::uint8_t value) { return synthetic::to_linear(value / 255.0f); };
    for (std::size_t i = 0; i < truth.pixels.size(); i += 4) {
      off += std::abs(light(picture.pixels[i]) - light(truth.pixels[i]));
      all += std::abs(light(before.pixels[i]) - light(truth.pixels[i]));
    }
    return off / all;
  };
  for (const ShadowQuality quality : {ShadowQuality::good, ShadowQuality::best}) {
    shot.settings.shadow = quality;
    shot.draw(before);
    EXPECT_LT(wrong(shot.picture), 0.08);
  }
  Light wide = lamp;
  wide.inner_cone = wide.outer_cone = 0.0f;
  shot.frame.lights = {wide};
  shot.draw(before);
  EXPECT_GT(wrong(shot.picture), 0.2) << "the cone matters here";
}

// Where the picture holds what the mirror showed, it is taken out as the picture shows it.
TEST_P(CompositorLightTest, WhatTheMirrorShowedIsThePicturesOwn) {
  Material glass, plaster;
  glass.roughness = 0.0f;
  Scene scene = floor_scene(glass, point_lamp({0, 2, 0.5}, Vec3f(0.5f)));
  add_back_wall(scene, plaster);
  const Mesh box = plain_box({-0.5f, 0.0f, -0.2f}, {0.5f, 0.5f, 0.2f}, 0.9f);
  const Vec3 eye(0, 1.2, 1.7);
  Shot shot(scene, box, synthetic::look_at(eye, {0, 0.5, 0}, 300, 300, 70.0));
  shot.settings.shadow = ShadowQuality::off;
  // The wall is painted where the box does not stand before it.
  Picture before{300, 300, 4, std::vector<std::uint8_t>(300 * 300 * 4, 255)};
  const Vec3 painted(0.8, 0.3, 0.6), elsewhere(0.3);
  const double edge = shot.frame.viewport.project_ideal({0, 0.7, -1}).value().y;
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 300; ++x)
      for (int c = 0; c < 3; ++c)
        before.pixels[4 * (static_cast<std::size_t>(y) * 300 + x) + c] =
            static_cast<std::uint8_t>(std::lround(
                255.0 * synthetic::to_srgb(static_cast<float>(y < edge ? painted[c] : 0.3))));
  shot.draw(before);
  for (const double y : {0.05, 0.1, 0.15}) {
    const Vec3 image(0.01, -y, 0.2), way = image - eye;
    const Vec3 seen = eye + way * ((-1.0 - eye.z) / way.z);
    ASSERT_GT(-seen.y, 0.8);
    const double fresnel = 0.04 + 0.96 * std::pow(1 + glm::normalize(way).y, 5.0);
    const Vec3f found = shot.at(image);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(found[c], elsewhere[c] + fresnel * (synthetic::to_linear(0.9f) - painted[c]),
                  0.004)
          << y << " channel " << c;
  }
}

// What a mirror shows of the floor lacks the light that the subject takes there.
TEST_P(CompositorLightTest, TheShadowIsSeenInTheMirror) {
  Material plaster, metal;
  plaster.base_colour = {0.6f, 0.5f, 0.4f};
  metal.base_colour = {0.9f, 0.7f, 0.5f};
  metal.metallic = 1.0f;
  metal.roughness = 0.0f;
  Scene scene = floor_scene(plaster, point_lamp({0, 3, 0}, Vec3f(4.0f)));
  add_back_wall(scene, metal);
  scene.mirrors = find_mirrors(scene);
  ASSERT_EQ(scene.mirrors.size(), 1u);
  const Mesh box = plain_box({-0.2f, 0.5f, -0.2f}, {0.2f, 0.9f, 0.2f}, 0.9f);
  const Vec3 eye(0, 1, 3);
  Shot shot(scene, box, synthetic::look_at(eye, {0, 0.4, -1}, 300, 300, 50.0));
  shot.draw(0.3f);
  const auto lost = [&](const Vec3& floor) {
    return Vec3f(0.3f) - shot.at({floor.x, floor.y, -2.0 - floor.z});
  };
  for (const double x : {-0.1, 0.0, 0.1}) {
    const Vec3 image(x, 0, -2.0);
    const double cosine = -glm::normalize(image - eye).z;
    const double falling = 4.0 * 3.0 / std::pow(glm::length(Vec3(x, 3, 0)), 3.0);
    for (int c = 0; c < 3; ++c) {
      const double fresnel =
          metal.base_colour[c] + (1 - metal.base_colour[c]) * std::pow(1 - cosine, 5.0);
      EXPECT_NEAR(lost({x, 0, 0})[c], fresnel * plaster.base_colour[c] / std::numbers::pi * falling,
                  0.003)
          << x << " channel " << c;
    }
  }
  // Beside the shadow.
  EXPECT_NEAR(lost({0.6, 0, 0}).x, 0.0f, 0.002f);
  shot.settings.mirror = MirrorMode::off;
  shot.draw(0.3f);
  EXPECT_NEAR(lost({0, 0, 0}).x, 0.0f, 0.002f);
}

// The mirror that the shadow is seen in is narrower than that, stands in many places of the picture's
// tiles, and shows the shadow where the viewport itself does not see it, too.
TEST_P(CompositorLightTest, SkippingChangesNoBitOfTheShadowInTheMirror) {
  Material plaster, glass;
  plaster.base_colour = {0.6f, 0.5f, 0.4f};
  glass.base_colour = Vec3f(0.1f);
  glass.roughness = 0.0f;
  glass.ior = 4.0f;
  const Mesh box = plain_box({-0.2f, 0.2f, -0.2f}, {0.2f, 0.9f, 0.2f}, 0.9f);
  Light lamp = point_lamp({0.3f, 3, 0}, Vec3f(0.0f));
  lamp.u = {0.2f, 0, 0};
  lamp.v = {0, 0, 0.2f};
  lamp.radiance = Vec3f(25.0f);
  const auto lazy_renderer = make_renderer();
  Renderer& lazy = *lazy_renderer;
  int unseen = 0;
  for (int i = 0; i < 4; ++i) {
    Scene scene = floor_scene(plaster, lamp);
    scene.materials.push_back(glass);
    SceneMesh wall = scene.meshes[0];
    wall.material = 1;
    const bool aside = i % 2 == 1;
    const float left = (aside ? 0.1f : -0.3f) + 0.02f * static_cast<float>(i);
    const float right = left + 0.23f;
    wall.positions = {{left, 0.01f, -1}, {right, 0.01f, -1}, {right, 3, -1}, {left, 3, -1}};
    wall.normals.assign(4, Vec3f(0, 0, 1));
    scene.meshes.push_back(wall);
    scene.mirrors = find_mirrors(scene);
    Shot shot(scene, box,
              aside ? synthetic::look_at({1.5, 1, 3}, {0, 0.35, -2}, 120, 200, 7.0)
                    : synthetic::look_at({0, 1, 3}, {0, 0.4, -1}, 200, 150, 40.0));
    shot.settings.shadow = i < 2 ? ShadowQuality::good : ShadowQuality::fast;
    const RenderPlan plan = lazy.plan(shot.frame, shot.settings);
    EXPECT_FALSE(plan.mirror_shadow().empty()) << i;
    unseen += plan.shadow.empty();
    const RenderSettings skipping = shot.settings;
    shot.settings.skip = false;
    shot.draw(0.4f);
    const std::size_t size = shot.picture.pixels.size();
    const auto value = static_cast<std::uint8_t>(std::lround(255.0f * synthetic::to_srgb(0.4f)));
    const Picture before{shot.frame.width, shot.frame.height, 4,
                         std::vector<std::uint8_t>(size, value)};
    Picture out = before;
    lazy.render(shot.frame, plan, skipping, before.pixels.data(), 4 * before.width,
                out.pixels.data(), 4 * before.width);
    EXPECT_EQ(out.pixels, shot.picture.pixels) << i;
    EXPECT_NE(out.pixels, before.pixels) << i;
  }
  EXPECT_GT(unseen, 0);
}

// What lies below a mirror is not seen in it.
TEST_P(CompositorLightTest, TheMirrorShowsOnlyWhatIsBeforeIt) {
  Material material;
  material.roughness = 0.0f;
  const Mesh box = plain_box({-0.3f, -0.5f, -0.2f}, {0.3f, 0.2f, 0.2f}, 0.9f);
  Shot shot(floor_scene(material, point_lamp({0, 3, 0}, Vec3f(1.0f))), box,
            synthetic::look_at({0, 0.6, 1.7}, {0, 0.2, 0.2}, 200, 200, 40.0));
  shot.settings.shadow = ShadowQuality::off;
  shot.draw(0.1f);
  EXPECT_NEAR(shot.at({0.01, 0.4, 0.2}).x, 0.1f, 0.002f);
  EXPECT_GT(shot.at({0.01, -0.1, 0.2}).x, 0.11f);
}

// One compositor draws pictures of many sizes, odd ones too, as a fresh one would.
TEST_P(CompositorLightTest, SizesChangeWhileItRuns) {
  Material material;
  material.roughness = 0.0f;
  const Mesh box = plain_box({-0.3f, 0.0f, -0.2f}, {0.3f, 0.5f, 0.2f}, 0.9f);
  const Scene scene = floor_scene(material, point_lamp({1, 2, 1}, Vec3f(1.0f)));
  const auto changing_renderer = make_renderer();
  Renderer& changing = *changing_renderer;
  for (const auto& [width, height] : {std::pair{64, 48}, {161, 93}, {97, 121}, {160, 90}}) {
    Shot shot(scene, box, synthetic::look_at({0, 0.6, 1.7}, {0, 0.2, 0.2}, width, height, 60.0));
    shot.draw(0.3f);
    const Picture fresh = shot.picture;
    const Picture before{width, height, 4,
                         std::vector<std::uint8_t>(fresh.pixels.size(), shot.picture.pixels[0])};
    Picture out = before;
    changing.render(shot.frame, changing.plan(shot.frame, shot.settings), shot.settings,
                    before.pixels.data(), 4 * width, out.pixels.data(), 4 * width);
    EXPECT_EQ(out.pixels, fresh.pixels) << width << "x" << height;
  }
}

// A lamp that moves throws another shadow of the scene, too.
TEST_P(CompositorLightTest, SkippingChangesNoBitWhileTheLampMoves) {
  const Mesh box = plain_box({-0.3f, 0.5f, -0.2f}, {0.3f, 0.9f, 0.2f}, 0.9f);
  Scene scene = floor_scene({}, point_lamp({1, 2, 0}, Vec3f(5.0f)));
  SceneMesh wall = scene.meshes[0];
  wall.positions = {{0, 0, 1}, {0, 0, -1}, {0, 0.4f, -1}, {0, 0.4f, 1}};
  wall.normals.assign(4, Vec3f(1, 0, 0));
  scene.meshes.push_back(wall);
  const auto lazy_renderer = make_renderer();
  Renderer& lazy = *lazy_renderer;
  for (const float x : {1.0f, 0.5f, -0.8f}) {
    scene.lights[0].centre.x = x;
    Shot shot(scene, box, synthetic::look_at({0.5, 2, 2.5}, {0, 0, 0}, 160, 120, 50.0));
    static const auto kept = shot.frame.scene;
    shot.frame.scene = kept;  // as announced lamps come: another light, the same scene
    shot.draw(0.5f);
    const Picture before{160, 120, 4, std::vector<std::uint8_t>(shot.picture.pixels.size(), 188)};
    Picture out = before;
    lazy.render(shot.frame, lazy.plan(shot.frame, shot.settings), shot.settings,
                before.pixels.data(), 640, out.pixels.data(), 640);
    EXPECT_EQ(out.pixels, shot.picture.pixels) << x;
  }
}

INSTANTIATE_TEST_SUITE_P(Api, CompositorLightTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
