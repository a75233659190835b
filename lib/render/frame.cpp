// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "base/error.h"
#include "render/shadow_recipe.h"
#include "render/subject/soft_edge.h"
#include "scene/drawable.h"

namespace polyhull {
namespace {

constexpr double near_plane = 0.05;  // metres
/// Scene sizes: an environment's suns are farther away, the scene's lamps nearer.
constexpr double suns_away = 10.0;
/// Places at which shadows are kept, of all lights together, some 70 bytes each, and as many again in
/// mirrors: the strongest lights that fit are drawn.
constexpr double most_shadow_places = 32e6;

/// Adds where the edges of \p scene lie in the circular cone from \p source around \p box: there the
/// light leaves the scene between the rays through the box's corners.
void add_scene_edges(const Vec3& source, const std::vector<Vec3>& box, const Bounds& scene,
                     std::vector<Vec3>& volume) {
  Vec3 middle(0.0);
  for (const Vec3& corner : box) middle += corner / static_cast<double>(box.size());
  const Vec3 axis = glm::normalize(middle - source);
  double widest = 1.0;  // as a cosine
  for (const Vec3& corner : box)
    widest = std::min(widest, glm::dot(axis, glm::normalize(corner - source)));
  constexpr int steps = 16;
  const std::vector<Vec3> ends = corners(scene);
  for (const Vec3& a : ends) {
    for (const Vec3& b : ends) {
      // Each edge once: its ends differ in one coordinate.
      if ((a.x != b.x) + (a.y != b.y) + (a.z != b.z) != 1 || glm::dot(b - a, Vec3(1.0)) <= 0.0)
        continue;
      const auto at = [&](int i) { return a + (b - a) * (static_cast<double>(i) / steps); };
      const auto inside = [&](int i) {
        const Vec3 way = at(i) - source;
        return i >= 0 && i <= steps && glm::dot(axis, way) >= widest * glm::length(way);
      };
      for (int i = 0; i <= steps; ++i)
        if (inside(i - 1) || inside(i) || inside(i + 1)) volume.push_back(at(i));
    }
  }
}

/// Where rays from the light through the subject's box leave the scene's box, and the box itself:
/// the shadow lies in the convex hull of these.
std::vector<Vec3> shadow_volume(const Light& light, const Bounds& subject, const Bounds& scene) {
  std::vector<Vec3> volume = corners(subject);
  const std::vector<Vec3> box = volume;
  const Vec3 c(light.centre), u(light.u), v(light.v);
  const std::vector<Vec3> sources = {c - u - v, c - u + v, c + u - v, c + u + v};
  Bounds lamp{sources[0], sources[0]};
  for (const Vec3& source : sources) {
    lamp.min = glm::min(lamp.min, source);
    lamp.max = glm::max(lamp.max, source);
  }
  if (glm::all(glm::lessThanEqual(lamp.min, subject.max)) &&
      glm::all(glm::greaterThanEqual(lamp.max, subject.min)))
    return corners(scene);  // from within, the shadow is everywhere
  for (const Vec3& source : sources) {
    for (const Vec3& corner : box) {
      const Vec3 way = corner - source;
      double leave = std::numeric_limits<double>::infinity();
      for (int axis = 0; axis < 3; ++axis) {
        if (way[axis] == 0.0) continue;
        const double wall = way[axis] > 0.0 ? scene.max[axis] : scene.min[axis];
        leave = std::min(leave, (wall - source[axis]) / way[axis]);
      }
      if (!std::isfinite(leave)) continue;  // the light lies in the corner
      volume.push_back(source + std::max(leave, 1.0) * 1.01 * way);
    }
    add_scene_edges(source, box, scene, volume);
  }
  return volume;
}

PlacedSubject place(const RenderSubject& subject) {
  PlacedSubject out;
  const Mesh& mesh = subject.image ? subject.image->mesh : *subject.mesh;
  out.mesh = &mesh;
  out.image = subject.image;
  out.content = subject.content;
  out.lighting = subject.lighting;
  out.relight = subject.relight;
  out.grade = subject.grade;
  out.to_scene = place_in_scene(mesh, subject.placement);
  out.from_scene = glm::inverse(out.to_scene);
  out.local_to_scene = out.to_scene;
  out.local_to_scene[3] = out.to_scene * Vec4(mesh.hull.origin, 1.0);
  out.points.reserve(mesh.hull.vertices.size());
  for (const Vec3f& v : mesh.hull.vertices)
    out.points.emplace_back(out.local_to_scene * Vec4(Vec3(v), 1.0));
  return out;
}

/// Has the plan's clip space reach as far as \p everything is from its eye and from the eye's images in its
/// mirrors, in steps, so that depths that are kept stay true while subjects move.
void set_clip(const RenderFrame& frame, const Camera& viewport, const Bounds& everything,
              RenderPlan& plan) {
  double far = 1.0;
  const auto reach_from = [&](const Vec3& eye) {
    for (const Vec3& corner : corners(everything))
      far = std::max(far, 1.05 * glm::distance(eye, corner));
  };
  reach_from(plan.eye);
  for (const SeenMirror& mirror : plan.mirrors) reach_from(mirror.eye);
  far = std::exp2(std::ceil(std::log2(far)));
  plan.clip_from_scene = clip_from_camera(viewport, near_plane, far) * view_matrix(frame.viewport);
}

/// Finds the mirrors in which subjects are seen.
void plan_mirrors(const RenderFrame& frame, const RenderSettings& settings, const Camera& viewport,
                  RenderPlan& plan) {
  MirrorSearch search{*frame.scene,          plan.clip_from_scene, plan.eye,
                      PixelRays(viewport),   frame.width,          frame.height,
                      settings.mirror_depth, settings.skip,        {},
                      frame.mirrors_left_out};
  for (const PlacedSubject& subject : plan.subjects) search.subjects.emplace_back(subject.points);
  plan.mirrors = find_seen_mirrors(search);
  std::set<std::size_t> seen;
  for (const SeenMirror& mirror : plan.mirrors)
    if (mirror.sight > 0) seen.insert(mirror.way.begin(), mirror.way.end());
  plan.mirrors_skipped = frame.scene->mirrors.size() - seen.size();
}

/// How many pixels the soft edge of \p subject reaches beyond its hull, at most \p most; 0 where all of
/// it lies behind the eye.
int pixels_beyond(const PlacedSubject& subject, const RenderPlan& plan, int most) {
  const Mat4& clip = plan.clip_from_scene;
  const Vec4 depth(clip[0][3], clip[1][3], clip[2][3], clip[3][3]);
  double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (const Vec3f& p : subject.points) {
    const double d = glm::dot(depth, Vec4(Vec3(p), 1.0));
    nearest = std::min(nearest, d);
    farthest = std::max(farthest, d);
  }
  const double reach = longest_reach(*subject.mesh) * scale_of(subject);
  if (farthest + reach < near_plane) return 0;
  const double pixels = reach / (plan.pixel_size * std::max(nearest - reach, near_plane)) + 1.0;
  return pixels < most ? static_cast<int>(std::ceil(pixels)) : most;
}

/// Finds the lights whose shadows of what stands in \p people are seen, and where; \p plan has its
/// mirrors. \p join: plan_frame()'s.
void plan_shadows(const RenderFrame& frame, const RenderSettings& settings, const Bounds& people,
                  const Bounds& everything, bool join, RenderPlan& plan) {
  const bool mirrored = settings.mirror == MirrorMode::fresnel;
  const bool joins = join && frame.soft_light && can_join_soft_lights(frame, settings);
  const Rectangle whole{0, 0, frame.width, frame.height};
  double places = 0.0, mirrored_places = 0.0;  // of all lights' grids
  for (ShadowLight& light :
       find_shadow_lights(frame.lights, frame.exposure, people, !settings.skip)) {
    if (joins && frame.lights[light.light].soft) {  // takes no place of its own
      if (light.idle) continue;
      plan.blocked_lights.push_back(light.light);
      ++plan.soft_lights;
      continue;
    }
    const Light& own = frame.lights[light.light];
    const auto grid_of = [&](bool sharp) {
      const int step = shadow_recipe(settings, own, light.share, sharp).ray_step;
      return static_cast<double>(frame.width) * frame.height / (step * step);
    };
    // A sun is not sharp where others would lose their shadows to it.
    light.sharp =
        joins && is_beyond(own, everything, suns_away) &&
        std::max(places + grid_of(true),
                 mirrored_places + grid_of(true) * static_cast<double>(plan.mirrors.size())) <=
            most_shadow_places;
    const double grid = grid_of(light.sharp);
    if (!light.idle) {
      places += grid;
      if (places > grid && places > most_shadow_places) continue;  // the strongest one stays
      plan.blocked_lights.push_back(light.light);
    }
    const std::vector<Vec3> volume = shadow_volume(frame.lights[light.light], people, everything);
    light.seen = screen_rectangle(volume, plan.clip_from_scene, frame.width, frame.height);
    if (!settings.skip) light.seen = whole;
    bool seen = !light.seen.empty();
    for (SeenMirror& mirror : plan.mirrors) {
      Rectangle& part = light.in_mirrors.emplace_back();
      if (mirrored)
        part =
            intersection(mirror.seen, screen_rectangle(volume, plan.clip_from_scene * mirror.turned,
                                                       frame.width, frame.height));
      if (!part.empty() && !light.idle) mirrored_places += grid;
      if (!plan.lights.empty() && mirrored_places > most_shadow_places) part = {};
      if (!settings.skip && !part.empty()) part = whole;
      seen = seen || !part.empty();
    }
    if (!seen) continue;
    plan.shadow = bounding(plan.shadow, light.seen);
    for (std::size_t i = 0; i < plan.mirrors.size(); ++i)
      plan.mirrors[i].shadow = bounding(plan.mirrors[i].shadow, light.in_mirrors[i]);
    plan.lights.push_back(light);
  }
  plan.lights_skipped = frame.lights.size() - plan.lights.size() - plan.soft_lights;
  if (plan.soft_lights == 0) return;
  // From all around it may fall on anything.
  plan.shadow = settings.skip ? bounding(plan.shadow,
                                         screen_rectangle(corners(everything), plan.clip_from_scene,
                                                          frame.width, frame.height))
                              : whole;
  if (!mirrored) return;
  for (SeenMirror& mirror : plan.mirrors) mirror.shadow = settings.skip ? mirror.seen : whole;
}

}  // namespace

bool can_join_soft_lights(const RenderFrame& frame, const RenderSettings& settings) {
  return settings.shadow != ShadowQuality::off && settings.shadow != ShadowQuality::hard &&
         std::any_of(frame.lights.begin(), frame.lights.end(),
                     [](const Light& light) { return light.soft; }) &&
         std::none_of(frame.subjects.begin(), frame.subjects.end(),
                      [](const RenderSubject& subject) { return subject.image != nullptr; });
}

RenderPlan plan_frame(const RenderFrame& frame, const RenderSettings& settings,
                      const Bounds& scene_bounds, bool join) {
  check_viewport(frame.viewport);
  check_light(frame.lights, frame.exposure, frame.ambient, frame.sky);
  RenderPlan plan;
  plan.eye = frame.viewport.centre();
  Bounds everything = scene_bounds;
  Bounds people;
  for (const RenderSubject& subject : frame.subjects) {
    const bool something =
        subject.image ? !subject.image->hull.empty() : subject.mesh && !subject.mesh->hull.empty();
    if (!something) continue;
    PlacedSubject placed = place(subject);
    if (!std::all_of(placed.points.begin(), placed.points.end(), within_reach)) {
      ++plan.unusable;
      continue;
    }
    const Bounds own = placed.bounds = bounds_of(placed.points);
    plan.subjects.push_back(std::move(placed));
    everything.min = glm::min(everything.min, own.min);
    everything.max = glm::max(everything.max, own.max);
    people = plan.subjects.size() == 1
                 ? own
                 : Bounds{glm::min(people.min, own.min), glm::max(people.max, own.max)};
  }
  const Camera viewport = resized(frame.viewport, frame.width, frame.height);
  set_clip(frame, viewport, everything, plan);
  plan.pixel_size = 1.0 / std::abs(viewport.K[0][0]);
  if (plan.subjects.empty()) return plan;

  const Rectangle whole{0, 0, frame.width, frame.height};
  for (PlacedSubject& subject : plan.subjects) {
    // A hull beside the picture may reach into it with its soft edge.
    int by = 0;
    if (settings.soft_edges && !subject.image)
      by = subject.beyond = pixels_beyond(subject, plan, frame.width + frame.height);
    const int width = frame.width + 2 * by, height = frame.height + 2 * by;
    Mat4 wider(1.0);
    wider[0][0] = static_cast<double>(frame.width) / width;
    wider[1][1] = static_cast<double>(frame.height) / height;
    Rectangle own = screen_rectangle(subject.points, wider * plan.clip_from_scene, width, height);
    if (by == frame.width + frame.height) own = {0, 0, width, height};  // or more
    if (own.empty()) continue;
    plan.subject = bounding(plan.subject, intersection({own.x - 2 * by, own.y - 2 * by,
                                                        own.width + 2 * by, own.height + 2 * by},
                                                       whole));
  }
  if (frame.scene && !frame.scene->meshes.empty()) {
    if (settings.mirror != MirrorMode::off) {
      plan_mirrors(frame, settings, viewport, plan);
      set_clip(frame, viewport, everything, plan);
    }
    if (settings.shadow != ShadowQuality::off)
      plan_shadows(frame, settings, people, everything, join, plan);
  }
  if (!settings.skip) plan.subject = whole;
  return plan;
}

Rectangle RenderPlan::mirror() const {
  Rectangle all;
  for (const SeenMirror& seen : mirrors) all = bounding(all, seen.image);
  return all;
}

Rectangle RenderPlan::mirror_shadow() const {
  Rectangle all;
  for (const SeenMirror& seen : mirrors) all = bounding(all, seen.shadow);
  return all;
}

std::vector<Vec3> eyes_on(const PlacedSubject& subject, const RenderPlan& plan) {
  std::vector<Vec3> eyes{Vec3(subject.from_scene * Vec4(plan.eye, 1.0))};
  for (const SeenMirror& seen : plan.mirrors)
    if (seen.sight > 0) eyes.emplace_back(subject.from_scene * Vec4(seen.eye, 1.0));
  return eyes;
}

SubjectsShape shape_of(const RenderPlan& plan) {
  SubjectsShape out;
  for (const PlacedSubject& subject : plan.subjects) {
    const auto base = static_cast<std::uint32_t>(out.points.size());
    out.points.insert(out.points.end(), subject.points.begin(), subject.points.end());
    for (const std::uint32_t index : subject.mesh->hull.triangles)
      out.triangles.push_back(base + index);
  }
  return out;
}

double scale_of(const PlacedSubject& subject) {
  return glm::length(Vec3(subject.local_to_scene[0]));
}

}  // namespace polyhull
