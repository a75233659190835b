// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene and the viewport that are true for a frame.
#include <utility>

#include "base/error.h"
#include "environment/environment.h"
#include "plugins/composite/frame.h"
#include "scene/assumed_light.h"
#include "scene/changes/mirror_choice.h"
#include "scene/changes/scene_changes.h"

namespace polyhull::element {
namespace {

SceneFile scene_of(const Announcement& announcement) {
  return {announcement.scene, announcement.scene_version, announcement.environment};
}

}  // namespace

/// That of the properties. Where another one comes while playing, the last one stays until it is loaded,
/// if the stream is live, and where it cannot be.
const OpenScenes::Open& FrameComposer::own_scene(const CompositeSettings& settings, bool live) {
  if (settings.scene_choice != choice_) {
    choice_ = settings.scene_choice;
    wanted_ = settings.scene.empty() ? SceneFile() : versions_.of(settings.scene);
  }
  if (own_ && own_->file == wanted_) return *own_;
  if (wanted_.name.empty()) return own_.emplace();
  if (live && own_ && !scenes_.is_ready(wanted_)) return *own_;
  try {
    own_ = scenes_.now(wanted_);
  } catch (const Error& error) {
    if (!own_) throw;
    wanted_ = own_->file;
    statistics_.warn(
        gl_.element(), "scenes-unusable",
        fmt::format("The scene cannot be used, and the last one stays: {}", error.what()));
  }
  return *own_;
}

void FrameComposer::announce(std::optional<Announcement> announcement) {
  if (announcement && !announcement->scene.empty())
    scenes_.now(scene_of(*announcement), announcement->pose);
  announcement_ = std::move(announcement);
}

/// \p open with its lamps where the frame's lights are: they hide subjects and lights, or do so no
/// longer. As long as they stay it is the same one.
OpenScenes::Open FrameComposer::with_lamps(const OpenScenes::Open& open) {
  if (!open.scene || !lamps_differ(*open.scene, frame_.lights)) {
    lamps_moved_.reset();
    lamps_of_.reset();
    return open;
  }
  if (lamps_of_ != open.scene || !lamps_moved_ || lamps_differ(*lamps_moved_, frame_.lights)) {
    Scene scene = *open.scene;
    move_lamps(scene, frame_.lights);
    lamps_moved_ = std::make_shared<const Scene>(std::move(scene));
    lamps_of_ = open.scene;
  }
  return {open.file, open.pose, lamps_moved_, nullptr};
}

/// The lights that stand for the scene's environment, as many as \p quality is worth.
void FrameComposer::add_environment(ShadowQuality quality) {
  const std::size_t count = quality == ShadowQuality::best   ? 32
                            : quality == ShadowQuality::good ? 16
                                                             : 8;
  const std::shared_ptr<const Scene>& scene = frame_.scene;
  if (!scene->environment) return;
  if (around_.scene != scene || around_.count != count) {
    // A scene that moves is another one in each frame, mostly in the same bounds.
    const Bounds bounds = scene_bounds(*scene);
    if (!around_.scene || around_.scene->environment != scene->environment ||
        around_.bounds != bounds || around_.count != count)
      around_.lights = environment_lights(*scene, count);
    around_.scene = scene;
    around_.bounds = bounds;
    around_.count = count;
  }
  const auto add = [&](const Vec3f& sky, std::vector<Light>& lights) {
    for (Light light : around_.lights) {
      light.radiance *= sky;
      lights.push_back(std::move(light));
    }
  };
  if (frame_.undimmed_sky && frame_.undimmed.empty()) frame_.undimmed = frame_.lights;
  if (!frame_.undimmed.empty()) add(frame_.undimmed_sky.value_or(frame_.sky), frame_.undimmed);
  add(frame_.sky, frame_.lights);
}

/// The same light in finer parts, where the renderer draws its shadow by these.
void FrameComposer::set_soft_light() {
  frame_.soft_light.reset();
  if (with_gl_ || !can_join_soft_lights(frame_, settings_)) return;
  const std::shared_ptr<const Environment>& environment = frame_.scene->environment;
  if (soft_.of != environment || soft_.count != around_.count) {
    soft_.of = environment;
    soft_.count = around_.count;
    soft_.parts = std::make_shared<const std::vector<EnvironmentPart>>(
        environment->soft_parts(soft_.count, 32 * soft_.count));
  }
  frame_.soft_light = soft_.parts;
}

/// The scene and its light: the background's, else those of the properties.
void FrameComposer::set_scene(const CompositeSettings& settings, bool live) {
  const auto use = [&](const OpenScenes::Open& open) {
    frame_.scene = open.scene;
    frame_.traced = open.traced;
  };
  if (announcement_ && !announcement_->scene.empty()) {
    frame_.lights = announcement_->lights;
    use(with_lamps(scenes_.now(scene_of(*announcement_), announcement_->pose)));  // read already
    frame_.exposure = announcement_->exposure;
    frame_.ambient = announcement_->ambient;
    frame_.sky = announcement_->sky;
    frame_.undimmed = announcement_->undimmed;
    frame_.undimmed_sky = announcement_->undimmed_sky;
    add_environment(settings.shadow);
    return;
  }
  use(own_scene(settings, live));
  frame_.lights = frame_.scene ? frame_.scene->lights : std::vector<Light>();
  frame_.exposure = settings.exposure > 0.0 ? static_cast<float>(settings.exposure)
                    : frame_.scene          ? frame_.scene->exposure
                                            : 1.0f;
  frame_.ambient = frame_.sky = Vec3f(0.0f);
  frame_.undimmed.clear();
  frame_.undimmed_sky.reset();
}

/// Which of the scene's mirrors show nobody.
void FrameComposer::set_mirrors(const std::string& choice) {
  if (mirrors_.scene == frame_.scene && mirrors_.choice == choice) return;
  ChosenMirrors chosen;
  if (frame_.scene) chosen = choose_mirrors(parse_mirror_choice(choice), *frame_.scene);
  frame_.mirrors_left_out = std::move(chosen.left_out);
  if (mirrors_.missing != chosen.missing && !chosen.missing.empty())
    statistics_.warn(gl_.element(), "mirrors-missing", chosen.missing);
  mirrors_ = {frame_.scene, choice, std::move(chosen.missing)};
}

/// The background's, else that of the properties. One that is impossible for a moment does not end the
/// stream.
void FrameComposer::set_viewport(const CompositeSettings& settings, GstClockTime time,
                                 double pixel_aspect) {
  if (announcement_) {
    viewport_ = announcement_->viewport;
  } else {
    try {
      const KeyFrames* keys = key_frames_.of(settings.key_frames);
      const double seconds =
          GST_CLOCK_TIME_IS_VALID(time) ? static_cast<double>(time) / GST_SECOND : 0.0;
      viewport_ = viewport_camera(
          keys ? keys->at(seconds) : KeyFrames::View{settings.pose(), settings.field_of_view, 0},
          frame_.width, frame_.height);
      viewport_.K[0][0] /= pixel_aspect;
      viewport_.distortion = settings.distortion();
    } catch (const Error& error) {
      if (viewport_.width != frame_.width || viewport_.height != frame_.height) throw;
      statistics_.warn(gl_.element(), "viewports-unusable",
                       fmt::format("{} The last viewport stays.", error.what()));
    }
  }
  frame_.viewport = viewport_;
}

}  // namespace polyhull::element
