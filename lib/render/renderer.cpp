// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/renderer.h"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <string_view>

#include "raytrace/traced_scene.h"

namespace polyhull {

void RenderStatistics::take(const RenderPlan& plan) {
  subject_skipped = plan.subject.empty();
  shadow_skipped = plan.shadow.empty();
  shadow_lights = plan.lights.size() + plan.soft_lights;
  lights_skipped = plan.lights_skipped;
  mirror_skipped = plan.mirror().empty();
  mirrors = static_cast<std::uint64_t>(
      std::count_if(plan.mirrors.begin(), plan.mirrors.end(),
                    [](const SeenMirror& seen) { return seen.sight > 0; }));
  mirrors_skipped = plan.mirrors_skipped;
}

void RenderStatistics::add(const RenderStatistics& part) {
  for (const PassTime& time : part.passes) {
    const auto same = std::find_if(passes.begin(), passes.end(), [&](const PassTime& own) {
      return std::string_view(own.name) == time.name;
    });
    if (same == passes.end()) {
      passes.push_back(time);
      continue;
    }
    same->cpu_milliseconds += time.cpu_milliseconds;
    if (time.gpu_milliseconds >= 0.0)
      same->gpu_milliseconds = std::max(same->gpu_milliseconds, 0.0) + time.gpu_milliseconds;
  }
  pictures_uploaded += part.pictures_uploaded;
  pictures_skipped += part.pictures_skipped;
  bytes_uploaded += part.bytes_uploaded;
  background_bytes_uploaded += part.background_bytes_uploaded;
  rays += part.rays;
  shadow_lights = std::max(shadow_lights, part.shadow_lights);
  lights_skipped = std::max(lights_skipped, part.lights_skipped);
  mirrors = std::max(mirrors, part.mirrors);
  mirrors_skipped = std::max(mirrors_skipped, part.mirrors_skipped);
  pixels_shaded += part.pixels_shaded;
  pixels_changed += part.pixels_changed;
  subject_skipped = subject_skipped && part.subject_skipped;
  shadow_skipped = shadow_skipped && part.shadow_skipped;
  mirror_skipped = mirror_skipped && part.mirror_skipped;
  scene_planes_taken = scene_planes_taken || part.scene_planes_taken;
  mesh_reused = mesh_reused && part.mesh_reused;
}

Renderer::Renderer() = default;
Renderer::~Renderer() = default;

const TracedScene* Renderer::traced(const RenderFrame& frame) {
  const std::shared_ptr<const Scene>& scene = frame.scene;
  if (scene != traced_held_) {
    traced_held_.reset();  // where this fails the next call tries it again
    traced_ = frame.traced;
    if (!traced_ && scene && !scene->meshes.empty())
      traced_ = std::make_shared<const TracedScene>(*scene);
    traced_held_ = scene;
  }
  return traced_.get();
}

RenderPlan Renderer::plan(const RenderFrame& frame, const RenderSettings& settings) {
  if (frame.scene != bounds_held_) {
    bounds_held_ = frame.scene;
    std::vector<Vec3f> points;
    if (frame.scene)
      for (const SceneMesh& mesh : frame.scene->meshes)
        points.insert(points.end(), mesh.positions.begin(), mesh.positions.end());
    scene_bounds_ = bounds_of(points);
  }
  RenderPlan plan = plan_frame(frame, settings, scene_bounds_, joins_soft_lights());
  const bool seen = !plan.subject.empty() || !plan.mirror().empty();
  for (PlacedSubject& subject : plan.subjects)
    if (seen && subject.lighting != SubjectLighting::off)
      if (const TracedScene* scene = traced(frame))
        subject.shade = subject_light_.around(subject, frame, *scene);
  find_forms(plan, bodies_);
  return plan;
}

std::optional<Vec3f> Renderer::white(const RenderFrame& frame, const PlacedSubject& subject) {
  const TracedScene* scene = traced(frame);
  if (!scene || subject.points.empty()) return std::nullopt;
  const auto light = subject_light_.around(subject, frame, *scene);
  if (!light) return std::nullopt;
  Vec3 factor(1.0);
  if (subject.lighting == SubjectLighting::off) {
    factor = Vec3(0.0);
    for (const Vec3f& point : subject.points)
      factor += Vec3(light->at((point - light->origin) / light->cell));
    factor /= static_cast<double>(subject.points.size());
  }
  return Vec3f(factor) * subject_light_.stage() * frame.exposure / std::numbers::pi_v<float>;
}

void Renderer::render_yuv(const RenderFrame& frame, const RenderPlan& plan,
                          const RenderSettings& settings, const std::uint8_t* background,
                          int background_stride, const YuvPicture& target) {
  const int stride = 4 * frame.width;
  drawn_.resize(static_cast<std::size_t>(stride) * frame.height);
  const Rectangle part = yuv_part(plan.changed(), frame.width, frame.height);
  const int left = std::max(part.x - 1, 0);  // chroma looks at the column before
  for (int y = part.y; y < part.y + part.height; ++y)
    std::memcpy(drawn_.data() + static_cast<std::ptrdiff_t>(y) * stride + 4 * left,
                background + static_cast<std::ptrdiff_t>(y) * background_stride + 4 * left,
                4 * static_cast<std::size_t>(part.x + part.width - left));
  RenderSettings opaque = settings;
  opaque.alpha = AlphaCoding::ignored;
  render(frame, plan, opaque, background, background_stride, drawn_.data(), stride);
  write_yuv({drawn_.data(), stride, 0, 0}, part, target);
}

}  // namespace polyhull
