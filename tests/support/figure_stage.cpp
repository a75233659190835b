// SPDX-License-Identifier: LGPL-2.1-or-later
#include "figure_stage.h"

#include <algorithm>
#include <limits>

#include "mesh/texture_mesh.h"
#include "raytrace/area_light.h"
#include "raytrace/traced_scene.h"
#include "simple_trace.h"

namespace polyhull::synthetic {
namespace {

constexpr Vec3f ambient(0.35f, 0.33f, 0.3f);

}  // namespace

FigureStage::FigureStage(int width, int height, bool polished) : polished_(polished) {
  scene = std::make_shared<const Scene>(small_room(polished));
  const Hull hull = figure(20);
  subject = photographed(hull, ring(4, 3.2, 1.5, {0, 1, 0}, 512, 512, 45.0));
  texture_mesh(subject.mesh, {.metric = TextureMetric::camera_normal});
  frame.width = width;
  frame.height = height;
  frame.viewport = look_at({1.3, 1.5, 4.2}, {0.0, 0.9, 0.0}, width, height, 50.0);
  frame.scene = scene;
  frame.lights = scene->lights;
  frame.exposure = scene->exposure;
  frame.ambient = ambient;
  frame.subjects.push_back({&subject.mesh, {}, 0});
}

void FigureStage::trace_background(int light_side, int pixel_side) {
  // Each case of a program wants the same few.
  struct Traced {
    Camera viewport;
    bool polished;
    int light_side, pixel_side;
    Picture picture;
  };
  static std::vector<Traced> all;
  const auto found = std::find_if(all.begin(), all.end(), [&](const Traced& traced) {
    return traced.viewport == frame.viewport && traced.polished == polished_ &&
           traced.light_side == light_side && traced.pixel_side == pixel_side;
  });
  if (found != all.end()) {
    background = found->picture;
    return;
  }
  background = SimpleTrace(*scene, ambient).draw(frame.viewport, light_side, pixel_side);
  all.push_back({frame.viewport, polished_, light_side, pixel_side, background});
}

void FigureStage::fill_background(std::uint8_t value) {
  background = {frame.width, frame.height, 4, {}};
  background.pixels.assign(static_cast<std::size_t>(frame.width) * frame.height * 4, value);
}

Picture FigureStage::truth(int light_side, int pixel_side, int mirrors) const {
  SimpleTrace trace(*scene, ambient);
  const RenderPlan plan = plan_frame(frame, {}, {});
  const SubjectsShape shape = shape_of(plan);
  trace.add_subject(
      shape.points, shape.triangles,
      [&plan](const Vec3f& p) {
        // Of several figures that whose axis is nearest.
        Vec3 own(0.0);
        double least = std::numeric_limits<double>::infinity();
        for (const PlacedSubject& placed : plan.subjects) {
          const Vec3 local(placed.from_scene * Vec4(Vec3(p), 1.0));
          const double away = glm::length(Vec2(local.x, local.z));
          if (away < least) own = local, least = away;
        }
        return paint(own);
      },
      mirrors);
  return trace.draw(frame.viewport, light_side, pixel_side);
}

Picture FigureStage::composite(Renderer& renderer, const RenderSettings& settings) const {
  Picture out = background;
  const RenderPlan plan = renderer.plan(frame, settings);
  renderer.render(frame, plan, settings, background.pixels.data(), 4 * background.width,
                  out.pixels.data(), 4 * out.width);
  return out;
}

LightAt light_at(const Light& light, const TracedScene& scene, const RayCaster& figure,
                 const Surface& at, int side) {
  const Vec3f origin = at.lifted + scene.epsilon() * at.geometric;
  double taken = 0.0, whole = 0.0;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const Vec2f square((i + 0.5f) / side, (j + 0.5f) / side);
      const LightSample way = sample_light(light, square, origin, at.normal);
      if (way.weight <= 0.0f) continue;
      whole += way.weight;
      const Ray ray{origin, 0.0f, way.place - origin, 1.0f - 1e-4f};
      if (figure.occluded(ray) && !scene.caster().occluded(ray)) taken += way.weight;
    }
  }
  const double rays = static_cast<double>(side) * side;
  return {static_cast<float>(whole / rays), static_cast<float>(taken / rays)};
}

std::vector<Light> ceiling_lamps(const Light& own, int count) {
  std::vector<Light> out{own};
  for (int i = 1; i < count; ++i) {
    Light light = own;
    light.centre = {-2.4f + 0.53f * static_cast<float>(i % 10), 2.9f,
                    1.9f - 0.9f * static_cast<float>(i * 7 % 40 / 10)};
    light.u *= 0.5f;
    light.v *= 0.5f;
    light.radiance *= Vec3f(2.0f, i % 2 ? 1.0f : 2.0f, i % 3 ? 2.0f : 0.5f);
    if (i % 4 == 2) {
      light.inner_cone = 0.5f;
      light.outer_cone = 1.3f;
    }
    out.push_back(light);
  }
  return out;
}

ShadowTruth::ShadowTruth(const FigureStage& stage, int side, int stride) {
  const TracedScene traced(*stage.scene);
  const RenderPlan plan = plan_frame(stage.frame, {}, {});
  RayCaster figure;
  figure.add_mesh(plan.subjects[0].points, stage.subject.mesh.hull.triangles);
  figure.commit();
  const auto ray_at = [&](int x, int y) {
    Ray ray;
    ray.origin = Vec3f(plan.eye);
    ray.direction =
        Vec3f(stage.frame.viewport.ray({static_cast<double>(x), static_cast<double>(y)}));
    return ray;
  };
  const auto shows_figure = [&](int x, int y) {  // or touches a pixel that does
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i)
        if (figure.occluded(ray_at(x + i, y + j))) return true;
    return false;
  };
  for (int y = 0; y < stage.frame.height; y += stride) {
    for (int x = 0; x < stage.frame.width; x += stride) {
      const Ray ray = ray_at(x, y);
      const RayHit hit = traced.caster().intersect(ray);
      if (!hit.hit() || shows_figure(x, y)) continue;
      const Surface at = traced.surface(ray, hit);
      Place place{x, y, Vec3f(0.0f), 0.0f, stage.scene->meshes[hit.mesh].material};
      const Vec3f colour =
          stage.scene->materials[static_cast<std::size_t>(place.material)].base_colour;
      for (const Light& light : stage.frame.lights) {
        const LightAt there = light_at(light, traced, figure, at, side);
        place.light += there.whole * light.radiance;
        place.taken += there.taken * glm::dot(colour, light.radiance);
      }
      const float all = glm::dot(colour, place.light);
      if (all <= 0.0f) continue;
      place.taken /= all;
      places.push_back(place);
    }
  }
}

}  // namespace polyhull::synthetic
