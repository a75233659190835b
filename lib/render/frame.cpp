// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"

namespace polyhull {
namespace {

constexpr double near_plane = 0.05;  // metres

void check_viewport(const Camera& camera) {
  bool finite = camera.width > 0 && camera.height > 0;
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(camera.t[i]);
    for (int j = 0; j < 3; ++j)
      finite = finite && std::isfinite(camera.R[i][j]) && std::isfinite(camera.K[i][j]);
  }
  if (!finite || std::abs(camera.K[0][0]) < 1e-9 || std::abs(camera.K[1][1]) < 1e-9 ||
      std::abs(glm::determinant(camera.R) - 1.0) > 1e-3) {
    throw Error(
        Error::Kind::bad_input,
        "The viewport camera is not usable: it needs a size, a focal length other than zero, "
        "a rotation, and only finite numbers.");
  }
}

/// Where rays from the light through the subject's box leave the scene's box, and the box itself:
/// the shadow lies in the convex hull of these.
std::vector<Vec3> shadow_volume(const Light& light, const Bounds& subject, const Bounds& scene) {
  std::vector<Vec3> volume = corners(subject);
  const std::vector<Vec3> box = volume;
  const Vec3 c(light.centre), u(light.u), v(light.v);
  for (const Vec3& source : {c - u - v, c - u + v, c + u - v, c + u + v}) {
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
  }
  return volume;
}

PlacedSubject place(const RenderSubject& subject) {
  PlacedSubject out;
  const Mesh& mesh = *subject.mesh;
  out.mesh = &mesh;
  out.content = subject.content;
  out.to_scene = place_in_scene(mesh, subject.placement);
  out.from_scene = glm::inverse(out.to_scene);
  out.local_to_scene = out.to_scene;
  out.local_to_scene[3] = out.to_scene * Vec4(mesh.hull.origin, 1.0);
  out.points.reserve(mesh.hull.vertices.size());
  for (const Vec3f& v : mesh.hull.vertices)
    out.points.emplace_back(out.local_to_scene * Vec4(Vec3(v), 1.0));
  return out;
}

/// The pixels in which \p mirror can show the subjects.
Rectangle mirror_rectangle(const Mirror& mirror, const RenderPlan& plan, const RenderFrame& frame) {
  const Vec3 normal(mirror.normal);
  if (glm::dot(normal, plan.eye) <= mirror.offset) return {};
  std::vector<Vec3> outline(mirror.outline.begin(), mirror.outline.end());
  const Rectangle frame_of_mirror =
      screen_rectangle(outline, plan.clip_from_scene, frame.width, frame.height);
  if (frame_of_mirror.empty()) return {};
  const Mat4 clip = plan.clip_from_scene * reflection(normal, mirror.offset);
  Rectangle images;
  for (const PlacedSubject& subject : plan.subjects) {
    const bool in_front = std::any_of(subject.points.begin(), subject.points.end(), [&](auto& p) {
      return glm::dot(mirror.normal, p) > mirror.offset;
    });
    if (!in_front) continue;
    images = bounding(images, screen_rectangle(subject.points, clip, frame.width, frame.height));
  }
  return intersection(images, frame_of_mirror);
}

int area(const Rectangle& r) {
  return r.empty() ? 0 : r.width * r.height;
}

}  // namespace

RenderPlan plan_frame(const RenderFrame& frame, const RenderSettings& settings,
                      const Bounds& scene_bounds) {
  check_viewport(frame.viewport);
  RenderPlan plan;
  plan.eye = frame.viewport.centre();
  Bounds everything = scene_bounds;
  Bounds people;
  for (const RenderSubject& subject : frame.subjects) {
    if (!subject.mesh || subject.mesh->hull.empty()) continue;
    plan.subjects.push_back(place(subject));
    const Bounds own = bounds_of(plan.subjects.back().points);
    everything.min = glm::min(everything.min, own.min);
    everything.max = glm::max(everything.max, own.max);
    people = plan.subjects.size() == 1
                 ? own
                 : Bounds{glm::min(people.min, own.min), glm::max(people.max, own.max)};
  }
  double far = 1.0;
  for (const Vec3& corner : corners(everything))
    far = std::max(far, 1.05 * glm::distance(plan.eye, corner));
  plan.clip_from_scene =
      clip_from_camera(resized(frame.viewport, frame.width, frame.height), near_plane, far) *
      view_matrix(frame.viewport);
  if (plan.subjects.empty()) return plan;

  const Rectangle whole{0, 0, frame.width, frame.height};
  for (const PlacedSubject& subject : plan.subjects) {
    plan.subject = bounding(plan.subject, screen_rectangle(subject.points, plan.clip_from_scene,
                                                           frame.width, frame.height));
  }
  if (frame.scene && !frame.scene->meshes.empty()) {
    if (settings.shadow != ShadowQuality::off) {
      plan.light = main_light(frame.lights, 0.5 * (people.min + people.max));
      if (plan.light >= 0) {
        const std::vector<Vec3> volume =
            shadow_volume(frame.lights[static_cast<std::size_t>(plan.light)], people, everything);
        plan.shadow = screen_rectangle(volume, plan.clip_from_scene, frame.width, frame.height);
      }
    }
    if (settings.mirror != MirrorMode::off) {
      for (std::size_t i = 0; i < frame.scene->mirrors.size(); ++i) {
        const Rectangle image = mirror_rectangle(frame.scene->mirrors[i], plan, frame);
        if (area(image) > area(plan.mirror)) {
          plan.mirror = image;
          plan.mirror_index = static_cast<int>(i);
        }
      }
    }
  }
  if (!settings.skip) {
    plan.subject = whole;
    if (plan.light >= 0) plan.shadow = whole;
    if (plan.mirror_index >= 0) plan.mirror = whole;
  }
  return plan;
}

const Mirror* mirror_of(const RenderFrame& frame, const RenderPlan& plan) {
  if (plan.mirror_index < 0) return nullptr;
  return &frame.scene->mirrors[static_cast<std::size_t>(plan.mirror_index)];
}

Vec4 kept_side(const Mirror& mirror) {
  return Vec4(Vec3(mirror.normal), -mirror.offset - 1e-4f);
}

std::vector<Vec3> eyes_on(const PlacedSubject& subject, const RenderFrame& frame,
                          const RenderPlan& plan) {
  std::vector<Vec3> eyes{Vec3(subject.from_scene * Vec4(plan.eye, 1.0))};
  if (const Mirror* m = mirror_of(frame, plan)) {
    const Vec4 image = reflection(Vec3(m->normal), m->offset) * Vec4(plan.eye, 1.0);
    eyes.emplace_back(subject.from_scene * image);
  }
  return eyes;
}

}  // namespace polyhull
