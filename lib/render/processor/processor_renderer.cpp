// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/processor_renderer.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "base/instruction_set.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "render/processor/blend.h"
#include "view/scene_planes.h"

namespace polyhull {

using namespace processor;

namespace {

int samples_of(const RenderSettings& settings) {
  const int wanted = settings.edge_samples;
  return wanted >= 8 ? 8 : wanted >= 4 ? 4 : wanted >= 2 ? 2 : 1;
}

}  // namespace

/// A light whose shadow is or was drawn.
struct KnownLight : LightShadow {
  ShadowCasters casters;
  std::optional<Light> light;  // for which casters has the subjects, by the recipe
  ShadowRecipe recipe;
};

struct ProcessorRenderer::State : Layers {
  std::shared_ptr<const Scene> scene_held;
  std::optional<std::uint64_t> geometry;  // geometry_key() of the scene, once it is asked for
  SolidSubjects solid;
  std::map<std::size_t, KnownLight> known;  // by number
  std::vector<KnownLight*> lights;          // of this frame, as RenderPlan::lights
  std::vector<std::uint8_t> mirror_ways;    // MirrorView's
  std::vector<std::uint8_t> background_copy;

  bool still(const RenderPlan& plan) const;
  void ready_subjects(const RenderFrame& frame, const RenderPlan& plan,
                      const RenderSettings& settings, RenderStatistics& statistics);
  void bring_to_screen(const RenderFrame& frame, const RenderPlan& plan);
  void choose_lights(const RenderPlan& plan, bool same);
  void ready_light(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                   std::size_t number, bool same);
  void prepare(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
               RenderStatistics& statistics);
  void draw_scene(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                  RenderStatistics& statistics);
  ShadowView view_in_mirror(const RenderFrame& frame, const RenderPlan& plan) const;
  void draw_shadows(const RenderFrame& frame, const RenderPlan& plan, RenderStatistics& statistics);
};

ProcessorRenderer::ProcessorRenderer() : state_(std::make_unique<State>()) {}
ProcessorRenderer::~ProcessorRenderer() = default;

std::string ProcessorRenderer::description() const {
  return std::string("the processor, with ") + (may_use_avx2() ? "avx2" : "baseline");
}

/// Whether all subjects are those of the last frame, in place.
bool ProcessorRenderer::State::still(const RenderPlan& plan) const {
  bool same = subjects.size() == plan.subjects.size();
  for (std::size_t i = 0; same && i < subjects.size(); ++i)
    same = plan.subjects[i].content != 0 && plan.subjects[i].content == subjects[i].content &&
           (plan.subjects[i].image != nullptr) == (subjects[i].image != nullptr) &&
           plan.subjects[i].local_to_scene == subjects[i].local_to_scene;
  return same;
}

/// Makes the subjects' views ready.
void ProcessorRenderer::State::ready_subjects(const RenderFrame& frame, const RenderPlan& plan,
                                              const RenderSettings& settings,
                                              RenderStatistics& statistics) {
  bool reused = !plan.subjects.empty();
  subjects.resize(plan.subjects.size());
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    const PlacedSubject& placed = plan.subjects[i];
    ReadySubject& subject = subjects[i];
    const bool same = settings.skip && placed.content != 0 && placed.content == subject.content &&
                      (placed.image != nullptr) == (subject.image != nullptr);
    subject.image = placed.image;
    subject.from_scene = placed.from_scene;
    const std::vector<Vec3> eyes = eyes_on(placed, frame, plan);
    subject.views = placed.image ? views_for(*placed.mesh, eyes) : std::vector<int>();
    const SkinCounts counts =
        subject.skin.prepare(*placed.mesh, eyes, plan.pixel_size, same, !settings.skip,
                             settings.soft_edges && !placed.image, subject.views);
    statistics.pictures_uploaded += counts.pictures;
    statistics.pictures_skipped += counts.pictures_skipped;
    reused = reused && same;
    subject.skin.relight(placed.form);
    subject.light = {placed.shade, placed.local_to_scene, placed.grade};
    subject.content = placed.content;
    subject.local_to_scene = placed.local_to_scene;
    subject.scale = scale_of(placed);
  }
  statistics.mesh_reused = reused;
}

void ProcessorRenderer::State::bring_to_screen(const RenderFrame& frame, const RenderPlan& plan) {
  const Mat4 pixels = pixels_from_clip(frame.width, frame.height) * plan.clip_from_scene;
  if (!plan.subject.empty())
    front.fill(subjects, {0, pixels, Facing::clockwise, std::nullopt}, frame.width, frame.height);
  if (plan.mirror.empty()) return;
  const Mirror& m = *mirror_of(frame, plan);
  image.fill(
      subjects,
      {1, pixels * reflection(Vec3(m.normal), m.offset), Facing::counterclockwise, kept_side(m)},
      frame.width, frame.height);
}

/// Finds this frame's lights among those that are known. \p same: all subjects are as they were.
void ProcessorRenderer::State::choose_lights(const RenderPlan& plan, bool same) {
  if (!same) solid.forget();
  lights.clear();
  shadows.clear();
  for (const ShadowLight& light : plan.lights) {
    lights.push_back(&known[light.light]);
    shadows.push_back(lights.back());
  }
  if (same) return;
  // What is kept of other lights is large, and its casters are not these subjects'.
  std::erase_if(known, [&](const auto& item) {
    return std::find(lights.begin(), lights.end(), &item.second) == lights.end();
  });
}

/// Makes ready what subjects hide of the plan's light \p number.
void ProcessorRenderer::State::ready_light(const RenderFrame& frame, const RenderPlan& plan,
                                           const RenderSettings& settings, std::size_t number,
                                           bool same) {
  const ShadowLight& planned = plan.lights[number];
  const Light& light = frame.lights[planned.light];
  const ShadowRecipe now = shadow_recipe(settings, light, planned.share);
  KnownLight& own = *lights[number];
  own.casters.set(plan, solid, light, now, same && own.light == light && own.recipe == now);
  own.light = light;
  own.recipe = now;
}

/// Makes ready what subjects look like, and what they hide, side by side.
void ProcessorRenderer::State::prepare(const RenderFrame& frame, const RenderPlan& plan,
                                       const RenderSettings& settings,
                                       RenderStatistics& statistics) {
  const bool same = settings.skip && still(plan);
  choose_lights(plan, same);
  std::atomic<double> prepared[2] = {0.0, 0.0};  // seconds
  parallel_for(1 + lights.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t task = begin; task < end; ++task) {
      Stopwatch own;
      if (task == 0) {
        ready_subjects(frame, plan, settings, statistics);
        bring_to_screen(frame, plan);
      } else {
        ready_light(frame, plan, settings, task - 1, same);
      }
      prepared[task == 0 ? 0 : 1] += own.lap();
    }
  });
  statistics.passes.push_back({"upload", 1e3 * prepared[0], -1.0});
  if (!lights.empty()) statistics.passes.push_back({"shadow-maps", 1e3 * prepared[1], -1.0});
}

/// Draws what is missing of the scene as the viewport and the mirror see it.
void ProcessorRenderer::State::draw_scene(const RenderFrame& frame, const RenderPlan& plan,
                                          const RenderSettings& settings,
                                          RenderStatistics& statistics) {
  const TracedScene* traced = scene;
  LayerView view;
  const Camera viewport = resized(frame.viewport, frame.width, frame.height);
  const PixelRays rays(viewport);
  view.pixels_from_scene = pixels_from_scene(viewport);
  view.width = frame.width;
  view.height = frame.height;
  view.samples = samples_of(settings);
  const Mirror* mirror = mirror_of(frame, plan);
  if (mirror) view.mirror_mesh = mirror->mesh;
  if (!settings.skip)
    for (SceneLayer* layer : {&direct, &mirrored}) layer->forget();
  const std::shared_ptr<const SceneOnScreen> ready =
      traced ? ready_triangles(frame.planes.get(), traced->scene(), geometry,
                               view.pixels_from_scene, view.width, view.height)
             : nullptr;
  const bool fresh = direct.set(traced, view, ready);
  statistics.scene_planes_taken = fresh && ready;
  if (fresh) albedo.reset(direct, Vec3f(plan.eye), rays);
  if (!traced) return;

  bool drawn = direct.ensure_middles(AreaShadow::asked(plan.shadow, view));
  if (mirror) {
    LayerView behind = view;
    behind.mirror_mesh = -1;
    behind.pixels_from_scene =
        view.pixels_from_scene * reflection(Vec3(mirror->normal), mirror->offset);
    behind.kept = kept_side(*mirror);
    if (mirrored.set(traced, behind)) {
      const ShadowView seen = view_in_mirror(frame, plan);
      mirror_albedo.reset(mirrored, seen.eye, seen.rays);
      mirror_ways.assign(static_cast<std::size_t>(view.width) * view.height, 0);
    }
    drawn = mirrored.ensure_samples({&plan.mirror, 1}) || drawn;
    drawn = mirrored.ensure_middles(
                bounding(plan.mirror, AreaShadow::asked(plan.mirror_shadow, view))) ||
            drawn;
  }
  std::vector<Rectangle> sampled{plan.subject, plan.mirror};
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Rectangle& part = plan.lights[i].in_mirror;
    if (part.empty()) continue;
    KnownLight& own = *lights[i];
    own.in_mirror.begin(own.casters, view_in_mirror(frame, plan), *own.light, own.recipe, part);
    const std::vector<Rectangle> reached = own.in_mirror.reached(view);
    sampled.insert(sampled.end(), reached.begin(), reached.end());
  }
  drawn = direct.ensure_samples(sampled) || drawn;
  statistics.scene_depth_reused = !drawn;
}

/// Who sees the scene, and the shadow on it, in the plan's mirror.
ShadowView ProcessorRenderer::State::view_in_mirror(const RenderFrame& frame,
                                                    const RenderPlan& plan) const {
  const Mirror& mirror = *mirror_of(frame, plan);
  const PixelRays rays(resized(frame.viewport, frame.width, frame.height));
  return {mirrored, Vec3f(reflection(Vec3(mirror.normal), mirror.offset) * Vec4(plan.eye, 1.0)),
          reflected(rays, mirror.normal), &direct};
}

/// The shadows as the viewport sees them, and as the mirror shows them.
void ProcessorRenderer::State::draw_shadows(const RenderFrame& frame, const RenderPlan& plan,
                                            RenderStatistics& statistics) {
  const ShadowView view{direct, Vec3f(plan.eye),
                        PixelRays(resized(frame.viewport, frame.width, frame.height))};
  statistics.static_shadow_reused = !plan.shadow.empty();
  for (std::size_t i = 0; i < lights.size(); ++i) {
    KnownLight& own = *lights[i];
    if (const Rectangle& part = plan.lights[i].seen; !part.empty()) {
      const bool kept = own.seen.begin(own.casters, view, *own.light, own.recipe, part);
      statistics.static_shadow_reused = statistics.static_shadow_reused && kept;
      own.seen.draw(own.casters, *scene, view, *own.light);
      statistics.rays += own.seen.rays();
    }
    if (!plan.lights[i].in_mirror.empty()) {
      own.in_mirror.draw(own.casters, *scene, view_in_mirror(frame, plan), *own.light);
      statistics.rays += own.in_mirror.rays();
    }
  }
}

void ProcessorRenderer::render(const RenderFrame& frame, const RenderPlan& plan,
                               const RenderSettings& settings, const std::uint8_t* background,
                               int background_stride, std::uint8_t* target, int target_stride) {
  draw(frame, plan, settings, background, background_stride, {target, target_stride});
}

void ProcessorRenderer::render_yuv(const RenderFrame& frame, const RenderPlan& plan,
                                   const RenderSettings& settings, const std::uint8_t* background,
                                   int background_stride, const YuvPicture& target) {
  RenderSettings opaque = settings;
  opaque.alpha = AlphaCoding::ignored;
  draw(frame, plan, opaque, background, background_stride, {nullptr, 0, &target});
}

void ProcessorRenderer::draw(const RenderFrame& frame, const RenderPlan& plan,
                             const RenderSettings& settings, const std::uint8_t* background,
                             int background_stride, const PictureTarget& target) {
  State& s = *state_;
  statistics_ = {};
  statistics_.subject_skipped = plan.subject.empty();
  statistics_.shadow_skipped = plan.shadow.empty();
  statistics_.shadow_lights = plan.lights.size();
  statistics_.lights_skipped = plan.lights_skipped;
  statistics_.mirror_skipped = plan.mirror.empty();
  const Rectangle changed = plan.changed();
  if (changed.empty()) return;

  Stopwatch watch;
  const auto pass = [&](const char* name) {
    statistics_.passes.push_back({name, 1e3 * watch.lap(), -1.0});
  };
  if (frame.scene != s.scene_held) {
    s.scene_held = frame.scene;
    s.geometry.reset();
    // The next scene may take this one's address.
    for (SceneLayer* layer : {&s.direct, &s.mirrored}) layer->forget();
    s.known.clear();
  }
  s.scene = traced(frame);
  s.prepare(frame, plan, settings, statistics_);
  watch.lap();
  s.draw_scene(frame, plan, settings, statistics_);
  pass("scene-depth");
  s.draw_shadows(frame, plan, statistics_);
  if (!plan.lights.empty()) pass("shadow");

  std::optional<MirrorView> mirror;
  if (plan.mirror_index >= 0) {
    const std::uint8_t* unchanged = background;
    if (background == target.pixels) {
      // Other rows of the background are read for the mirror when they may be written already.
      const std::size_t size = static_cast<std::size_t>(background_stride) * (frame.height - 1) +
                               4 * static_cast<std::size_t>(frame.width);
      s.background_copy.assign(background, background + size);
      unchanged = s.background_copy.data();
    }
    mirror.emplace(frame, plan, *s.scene, s.mirrored, s.mirror_ways, unchanged, background_stride,
                   settings.alpha);
  }
  Blend blend(s, frame, plan, settings, mirror ? &*mirror : nullptr, background, background_stride,
              target);
  const int first = blend.first_band();
  parallel_for(static_cast<std::size_t>(blend.last_band() - first + 1), 1, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) blend.draw(first + static_cast<int>(i));
               });
  statistics_.pixels_shaded = blend.pixels_shaded;
  statistics_.pixels_changed = blend.pixels_changed;
  for (const auto& [name, seconds] : {std::pair{"subject", blend.seconds_subject.load()},
                                      {"mirror", blend.seconds_mirror.load()},
                                      {"blend", blend.seconds_blend.load()}})
    statistics_.passes.push_back({name, 1e3 * seconds, -1.0});
}

}  // namespace polyhull
