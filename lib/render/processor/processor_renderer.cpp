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

/// By SeenMirror::way.
template <class Kept>
using ByWay = std::map<std::vector<std::size_t>, Kept>;

/// A light whose shadow is or was drawn.
struct KnownLight : LightShadow {
  ShadowCasters casters;
  ByWay<AreaShadow> by_way;    // in_mirrors
  std::optional<Light> light;  // for which casters has the subjects, by the recipe
  ShadowRecipe recipe;
};

struct ProcessorRenderer::State : Layers {
  std::shared_ptr<const Scene> scene_held;
  std::optional<std::uint64_t> geometry;  // geometry_key() of the scene, once it is asked for
  SolidSubjects solid;
  std::map<std::size_t, KnownLight> known;  // by number
  std::vector<KnownLight*> lights;          // of this frame, as RenderPlan::lights
  SoftMasks soft_masks;
  ByWay<MirrorLayers> known_mirrors;
  std::vector<std::uint8_t> background_copy;

  bool still(const RenderPlan& plan) const;
  void ready_subjects(const RenderPlan& plan, const RenderSettings& settings,
                      RenderStatistics& statistics);
  void bring_to_screen(const RenderFrame& frame, const RenderPlan& plan);
  void choose_lights(const RenderPlan& plan, bool same);
  void ready_light(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                   std::size_t number, bool same);
  void prepare(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
               RenderStatistics& statistics);
  void draw_scene(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                  RenderStatistics& statistics);
  void forget_scene();
  void draw_mirror(const SeenMirror& seen, const LayerView& view, MirrorLayers& own);
  std::vector<std::vector<Rectangle>> sampled_parts(const RenderPlan& plan, const LayerView& view);
  ShadowView view_in_mirror(const RenderPlan& plan, std::size_t number) const;
  void draw_shadows(const RenderFrame& frame, const RenderPlan& plan,
                    const RenderSettings& settings, RenderStatistics& statistics);
  void draw_soft_shadows(const RenderPlan& plan, const ShadowView& view,
                         const RenderSettings& settings, RenderStatistics& statistics);
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
void ProcessorRenderer::State::ready_subjects(const RenderPlan& plan,
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
    const std::vector<Vec3> eyes = eyes_on(placed, plan);
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
  for (std::size_t i = 0; i < plan.mirrors.size(); ++i) {
    const SeenMirror& seen = plan.mirrors[i];
    if (seen.image.empty()) continue;
    const Facing facing = seen.way.size() % 2 == 1 ? Facing::counterclockwise : Facing::clockwise;
    mirrors[i]->image.fill(
        subjects,
        {seen.sight, pixels * seen.turned, facing, kept_side(mirror_of(*frame.scene, seen))},
        frame.width, frame.height);
  }
}

/// Finds this frame's lights and mirrors among those that are known. \p same: all subjects are as they
/// were.
void ProcessorRenderer::State::choose_lights(const RenderPlan& plan, bool same) {
  if (!same) solid.forget();
  lights.clear();
  shadows.clear();
  for (const ShadowLight& light : plan.lights) {
    KnownLight& own = known[light.light];
    lights.push_back(&own);
    shadows.push_back(&own);
    own.in_mirrors.clear();
    for (std::size_t i = 0; i < plan.mirrors.size(); ++i)
      own.in_mirrors.push_back(light.in_mirrors[i].empty() ? nullptr
                                                           : &own.by_way[plan.mirrors[i].way]);
  }
  mirrors.clear();
  for (const SeenMirror& seen : plan.mirrors) mirrors.push_back(&known_mirrors[seen.way]);
  if (same && known_mirrors.size() <= 2 * most_mirrors) return;
  // What is kept of other lights and mirrors is large, and its casters are not these subjects'.
  std::erase_if(known, [&](const auto& item) {
    return std::find(lights.begin(), lights.end(), &item.second) == lights.end();
  });
  const auto passed = [&](const auto& item) {
    return std::none_of(plan.mirrors.begin(), plan.mirrors.end(),
                        [&](const SeenMirror& seen) { return seen.way == item.first; });
  };
  for (KnownLight* light : lights) std::erase_if(light->by_way, passed);
  if (!plan.mirrors.empty()) std::erase_if(known_mirrors, passed);
}

/// Makes ready what subjects hide of the plan's light \p number.
void ProcessorRenderer::State::ready_light(const RenderFrame& frame, const RenderPlan& plan,
                                           const RenderSettings& settings, std::size_t number,
                                           bool same) {
  const ShadowLight& planned = plan.lights[number];
  const Light& light = frame.lights[planned.light];
  const ShadowRecipe now = shadow_recipe(settings, light, planned.share, planned.sharp);
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
  if (plan.soft_lights > 0)
    soft_masks.set(plan, frame.soft_light, same);
  else
    soft_masks.forget();
  std::atomic<double> prepared[2] = {0.0, 0.0};  // seconds
  const std::size_t lamps = 1 + lights.size(),
                    tasks = lamps + (plan.soft_lights > 0 ? SoftMasks::sides : 0);
  parallel_each(tasks, 1, 0, [&](std::size_t task) {
    Stopwatch own;
    if (task == 0) {
      ready_subjects(plan, settings, statistics);
      bring_to_screen(frame, plan);
    } else if (task < lamps) {
      ready_light(frame, plan, settings, task - 1, same);
    } else {
      soft_masks.cut(plan, task - lamps);
    }
    prepared[task == 0 ? 0 : 1] += own.lap();
  });
  statistics.passes.push_back({"upload", 1e3 * prepared[0], -1.0});
  if (tasks > 1) statistics.passes.push_back({"shadow-maps", 1e3 * prepared[1], -1.0});
}

/// What is kept of a scene; the next one may take its address.
void ProcessorRenderer::State::forget_scene() {
  geometry.reset();
  direct.forget();
  known_mirrors.clear();
  known.clear();
}

/// Draws what is missing of the scene as the viewport sees it and as the mirrors show it.
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
  view.mirrors = !plan.mirrors.empty();
  if (!settings.skip) {
    direct.forget();
    for (MirrorLayers* mirror : mirrors) mirror->scene.forget();
  }
  const std::shared_ptr<const SceneOnScreen> ready =
      traced ? ready_triangles(frame.planes.get(), traced->scene(), geometry,
                               view.pixels_from_scene, view.width, view.height)
             : nullptr;
  const bool fresh = direct.set(traced, view, ready);
  statistics.scene_planes_taken = fresh && ready;
  if (fresh) albedo.reset({0, 0, view.width, view.height}, Vec3f(plan.eye), rays);
  if (!traced) return;

  const auto asked = [&](const Rectangle& part) {
    return plan.soft_lights > 0 ? SoftShadow::asked(part, view) : AreaShadow::asked(part, view);
  };
  bool drawn = direct.ensure_middles(asked(plan.shadow));
  for (std::size_t i = 0; i < mirrors.size(); ++i) {
    draw_mirror(plan.mirrors[i], view, *mirrors[i]);
    const Rectangle shadow = asked(plan.mirrors[i].shadow);
    drawn = mirrors[i]->scene.ensure_middles(bounding(plan.mirrors[i].image, shadow)) || drawn;
  }
  const std::vector<std::vector<Rectangle>> sampled = sampled_parts(plan, view);
  drawn = direct.ensure_samples(sampled.back()) || drawn;
  for (std::size_t i = 0; i < mirrors.size(); ++i)
    drawn = mirrors[i]->scene.ensure_samples(sampled[i]) || drawn;
  statistics.scene_depth_reused = !drawn;
}

/// Begins with what mirror \p own shows, where it is not the same as before. \p view: the viewport's.
void ProcessorRenderer::State::draw_mirror(const SeenMirror& seen, const LayerView& view,
                                           MirrorLayers& own) {
  const MirrorLayers* outer =
      seen.within >= 0 ? mirrors[static_cast<std::size_t>(seen.within)] : nullptr;
  own.aperture.emplace(Aperture{outer ? outer->scene : direct,
                                static_cast<std::uint8_t>(seen.way.back() + 1),
                                outer ? &*outer->aperture : nullptr});
  LayerView behind = view;
  behind.pixels_from_scene = view.pixels_from_scene * seen.turned;
  behind.kept = kept_side(mirror_of(scene->scene(), seen));
  if (!own.scene.set(scene, behind)) return;
  own.albedo.reset(seen.seen, Vec3f(seen.eye), seen.rays);
  own.ways.assign(static_cast<std::size_t>(seen.seen.width) * seen.seen.height, 0);
}

/// Where samples of the scene are asked for: by mirror, and last of the viewport. The lights' shadows in
/// mirrors are begun.
std::vector<std::vector<Rectangle>> ProcessorRenderer::State::sampled_parts(const RenderPlan& plan,
                                                                            const LayerView& view) {
  std::vector<std::vector<Rectangle>> out(plan.mirrors.size() + 1);
  out.back().push_back(plan.subject);
  for (std::size_t m = 0; m < plan.mirrors.size(); ++m) {
    std::vector<Rectangle> parts{plan.mirrors[m].image};
    out[m].push_back(plan.mirrors[m].image);
    for (std::size_t i = 0; i < lights.size(); ++i) {
      KnownLight& own = *lights[i];
      AreaShadow* const shadow = own.in_mirrors[m];
      if (!shadow) continue;
      shadow->begin(own.casters, view_in_mirror(plan, m), *own.light, own.recipe,
                    plan.lights[i].in_mirrors[m]);
      const std::vector<Rectangle> reached = shadow->reached(view);
      parts.insert(parts.end(), reached.begin(), reached.end());
    }
    if (plan.soft_lights > 0 && !plan.mirrors[m].shadow.empty())
      parts.push_back(SoftShadow::asked(plan.mirrors[m].shadow, view));
    // Of all that show it, up to the viewport.
    for (int outer = plan.mirrors[m].within;; outer = plan.mirrors[outer].within) {
      std::vector<Rectangle>& asked = outer < 0 ? out.back() : out[static_cast<std::size_t>(outer)];
      asked.insert(asked.end(), parts.begin(), parts.end());
      if (outer < 0) break;
    }
  }
  return out;
}

/// Who sees the scene, and the shadow on it, in a mirror of the plan.
ShadowView ProcessorRenderer::State::view_in_mirror(const RenderPlan& plan,
                                                    std::size_t number) const {
  const SeenMirror& seen = plan.mirrors[number];
  return {mirrors[number]->scene, Vec3f(seen.eye), seen.rays, &*mirrors[number]->aperture};
}

/// That of all soft lights, there and there.
void ProcessorRenderer::State::draw_soft_shadows(const RenderPlan& plan, const ShadowView& view,
                                                 const RenderSettings& settings,
                                                 RenderStatistics& statistics) {
  if (plan.soft_lights == 0) return;
  const int step = settings.shadow == ShadowQuality::best ? 2 : 4;
  soft_masks.aim();
  if (!plan.shadow.empty()) {
    const bool kept = soft.draw(soft_masks, *scene, view, plan.shadow, step);
    statistics.static_shadow_reused = statistics.static_shadow_reused && kept;
    statistics.rays += soft.rays();
  }
  for (std::size_t m = 0; m < mirrors.size(); ++m) {
    if (plan.mirrors[m].shadow.empty()) continue;
    SoftShadow& own = mirrors[m]->soft;
    own.draw(soft_masks, *scene, view_in_mirror(plan, m), plan.mirrors[m].shadow, step);
    statistics.rays += own.rays();
  }
}

/// The shadows as the viewport sees them, and as the mirror shows them.
void ProcessorRenderer::State::draw_shadows(const RenderFrame& frame, const RenderPlan& plan,
                                            const RenderSettings& settings,
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
    for (std::size_t m = 0; m < own.in_mirrors.size(); ++m) {
      if (!own.in_mirrors[m]) continue;
      own.in_mirrors[m]->draw(own.casters, *scene, view_in_mirror(plan, m), *own.light);
      statistics.rays += own.in_mirrors[m]->rays();
    }
  }
  draw_soft_shadows(plan, view, settings, statistics);
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
  statistics_.take(plan);
  const Rectangle changed = plan.changed();
  if (changed.empty()) return;

  Stopwatch watch;
  const auto pass = [&](const char* name) {
    statistics_.passes.push_back({name, 1e3 * watch.lap(), -1.0});
  };
  if (frame.scene != s.scene_held) {
    s.scene_held = frame.scene;
    s.forget_scene();
  }
  s.scene = traced(frame);
  s.prepare(frame, plan, settings, statistics_);
  watch.lap();
  s.draw_scene(frame, plan, settings, statistics_);
  pass("scene-depth");
  s.draw_shadows(frame, plan, settings, statistics_);
  if (!plan.lights.empty() || plan.soft_lights > 0) pass("shadow");

  const std::uint8_t* unchanged = background;
  if (background == target.pixels && !(plan.mirror().empty() && plan.mirror_shadow().empty())) {
    // Other rows of the background are read for mirrors when they may be written already.
    const std::size_t size = static_cast<std::size_t>(background_stride) * (frame.height - 1) +
                             4 * static_cast<std::size_t>(frame.width);
    s.background_copy.assign(background, background + size);
    unchanged = s.background_copy.data();
  }
  for (std::size_t i = 0; i < plan.mirrors.size(); ++i)
    s.mirrors[i]->view.emplace(frame, plan, plan.mirrors[i], *s.scene, s.mirrors[i]->scene,
                               s.mirrors[i]->ways, unchanged, background_stride, settings.alpha);
  Blend blend(s, frame, plan, settings, background, background_stride, target);
  const int first = blend.first_band();
  parallel_each(blend.last_band() - first + 1, 1, 0, [&](int i) { blend.draw(first + i); });
  statistics_.pixels_shaded = blend.pixels_shaded;
  statistics_.pixels_changed = blend.pixels_changed;
  for (const auto& [name, seconds] : {std::pair{"subject", blend.seconds_subject.load()},
                                      {"mirror", blend.seconds_mirror.load()},
                                      {"blend", blend.seconds_blend.load()}})
    statistics_.passes.push_back({name, 1e3 * seconds, -1.0});
}

}  // namespace polyhull
