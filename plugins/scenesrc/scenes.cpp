// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/scenesrc/scenes.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "scene/assumed_light.h"
#include "scene/changes/scene_changes.h"

namespace polyhull::element {
namespace {

constexpr float bounce_spacing = 5.6f;  // of the spacing of the straight light
constexpr int bounces_by_spots = 1024;  // what a spot lights is small, and found by few directions
constexpr std::chrono::milliseconds patience{20};  // between two looks at whether to go on waiting

std::filesystem::path cache_folder(const SceneSettings& settings) {
  return settings.light_cache ? std::filesystem::path(g_get_user_cache_dir()) / "polyhull" / "light"
                              : std::filesystem::path();
}

SceneAtRest read_scene(const SceneFile& file, const SceneSettings& settings) {
  Scene scene = open_scene(file, cache_folder(settings));
  const bool assumed = scene.lights.empty() && !scene.environment;
  if (assumed) assume_light(scene);  // of the file's poses: it stays where nodes move
  return {file, std::make_shared<const Scene>(std::move(scene)), assumed};
}

std::unique_ptr<OpenedScene> opened(const SceneAtRest& source, const FoundPose& found,
                                    const SceneSettings& settings) {
  auto out = std::make_unique<OpenedScene>();
  static_cast<SceneAtRest&>(*out) = source;
  Scene scene = *source.rest;
  out->found = found;
  out->nodes_missing = pose_scene(found.pose, scene);
  out->lights = scene.lights;
  out->exposure = scene.exposure;
  out->bounds = scene_bounds(scene);
  BackgroundOptions options;
  options.light.spacing = static_cast<float>(settings.light_spacing);
  options.light.bounce_spacing = bounce_spacing * options.light.spacing;
  if (std::any_of(scene.lights.begin(), scene.lights.end(),
                  [](const Light& l) { return l.is_spot(); }))
    options.light.bounce_samples = bounces_by_spots;
  // The moments of an animation hardly come again.
  if (found.pose.animation_time == 0.0) options.light_folder = cache_folder(settings);
  options.progressive = settings.live && settings.progressive;
  options.method = settings.method;
  options.view.contrast = static_cast<float>(settings.smoothing);
  options.paths.light_samples = 2;
  out->background = std::make_unique<Background>(std::move(scene), options);
  return out;
}

/// The same with its light, beside the frames of another scene: half of the threads are left to those.
std::unique_ptr<OpenedScene> opened_and_lit(const SceneAtRest& source, const FoundPose& found,
                                            const SceneSettings& settings,
                                            const std::atomic<bool>& stop) {
  auto out = opened(source, found, settings);
  const Stopwatch watch;
  out->background->prepare(out->lights_by(settings).lights, out->sky_by(settings),
                           settings.live ? std::max(pool_threads() / 2, 1) : 0, stop);
  out->light_ms = watch.milliseconds();
  return out;
}

/// Whether \p posed is seen or lit otherwise than what \p shown shows, but for what lights by property.
bool differs(const OpenedScene& shown, const Scene& posed) {
  const std::vector<SceneMesh>& now = shown.background->scene().meshes;
  if (!shown.background->has_parts_of(posed) || shown.lights != posed.lights) return true;
  for (std::size_t m = 0; m < now.size(); ++m) {
    const bool lamp =
        std::any_of(posed.lights.begin(), posed.lights.end(),
                    [&](const Light& light) { return light.mesh == static_cast<int>(m); });
    if (!lamp && now[m].positions != posed.meshes[m].positions) return true;
  }
  return false;
}

}  // namespace

SceneFile Scenes::file_of(const SceneSettings& settings) {
  SceneFile file = versions_.of(settings.scene);
  file.environment = versions_.environment(settings.environment, settings.environment_turn);
  return file;
}

void Scenes::open(const SceneSettings& settings) {
  close();
  choice_ = settings.scene_choice;
  const SceneAtRest source = read_scene(file_of(settings), settings);
  shown_ = opened(source, scene_pose(settings, *source.rest, 0.0), settings);
}

void Scenes::close() {
  wanted_.reset();
  latest_.reset();
  refused_.reset();
  stop_ = true;
  loading_ = {};  // waits for it
  stop_ = false;
  for (auto* scene : {&shown_, &before_, &next_}) scene->reset();
}

/// Whether next_ is what is wanted now. Where that cannot be, nothing is wanted any longer.
bool Scenes::make_ready(const SceneSettings& settings, const SceneWish& wish) {
  for (;;) {
    if (next_ && next_->file == *wanted_) return true;
    if (before_ && before_->file == *wanted_) {
      next_ = std::move(before_);
      return true;
    }
    if (!loading_.valid()) {
      next_.reset();  // the memory first
      under_way_ = *wanted_;
      loading_ = start_beside([this, file = under_way_, settings, seconds = wish.seconds] {
        const SceneAtRest source = read_scene(file, settings);
        return opened_and_lit(source, scene_pose(settings, *source.rest, seconds), settings, stop_);
      });
    }
    while (!has_ended(loading_)) {
      if (wish.live || wish.stopped()) return false;
      loading_.wait_for(patience);
    }
    try {
      next_ = loading_.get();
    } catch (const std::exception& error) {
      // Of what nobody wants any longer nothing is said.
      if (under_way_ != *wanted_) continue;
      wanted_.reset();
      wish.warn(fmt::format("The scene cannot be shown, and the last one, '{}', stays: {}",
                            shown_->file.name, error.what()));
      return false;
    }
  }
}

/// The scene's file.
bool Scenes::follow_file(const SceneSettings& settings, const SceneWish& wish) {
  if (settings.scene_choice != choice_) {
    choice_ = settings.scene_choice;
    latest_ = file_of(settings);
  }
  // Turns of the environment that come faster than they are lit do not hold each other up: one is shown, then the latest.
  const bool on_the_way = wish.live && wanted_ && latest_ && wanted_->same_files(*latest_);
  if (latest_ && !on_the_way) wanted_ = std::exchange(latest_, std::nullopt);
  if (wanted_ && *wanted_ == shown_->file) wanted_.reset();
  if (!wanted_) return false;
  const bool followed = !wish.live || wish.followed(*wanted_);
  if (!make_ready(settings, wish) || !followed) return false;
  before_ = std::exchange(shown_, std::move(next_));
  wanted_.reset();
  refused_.reset();
  return true;
}

/// Where shown() is to be. Nodes and animations that are set together with another scene are that one's.
FoundPose Scenes::found_pose(const SceneSettings& settings, double seconds) const {
  if (!wanted_) return scene_pose(settings, *shown_->rest, seconds);
  FoundPose found = shown_->found;
  if (found.pose.animation > 0)
    found.pose.animation_time = time_of(found.pose.animation, *shown_->rest, settings, seconds);
  return found;
}

/// Has shown() in that pose where that costs no light, or, of a live source, with the light that it has.
bool Scenes::move_to(const FoundPose& found, bool live) {
  Scene posed = *shown_->rest;
  std::string missing = pose_scene(found.pose, posed);
  if (differs(*shown_, posed)) {
    if (!live || !shown_->background->take_pose(posed)) return false;
    shown_->moved = true;
    shown_->lights = posed.lights;
    shown_->bounds = scene_bounds(posed);
  }
  shown_->found = found;
  shown_->nodes_missing = std::move(missing);
  return true;
}

void Scenes::open_in(const FoundPose& found, const SceneSettings& settings) {
  if (before_ && before_->file == shown_->file && before_->found == found)
    std::swap(before_, shown_);
  else
    before_ = std::exchange(shown_, opened(*shown_, found, settings));
}

/// Lights the pose beside, and shows its light as soon as that is there, on what has moved on meanwhile.
/// Throws Error where that cannot be.
void Scenes::relight(const FoundPose& found, const SceneSettings& settings) {
  if (loading_.valid()) {
    if (!has_ended(loading_)) return;
    // Of a scene that nobody wants any longer, and its errors, nothing is left.
    const bool of_shown = under_way_ == shown_->file;
    try {
      std::unique_ptr<OpenedScene> lit = loading_.get();
      if (of_shown) shown_ = std::move(lit);
    } catch (const std::exception& error) {
      if (of_shown) throw Error(Error::Kind::unsupported, "{}", error.what());
    }
    if (of_shown && shown_->found != found) move_to(found, true);
  }
  if (!shown_->moved && shown_->found == found) return;
  under_way_ = shown_->file;
  loading_ = start_beside([this, source = SceneAtRest(*shown_), found, settings] {
    return opened_and_lit(source, found, settings, stop_);
  });
}

bool Scenes::follow_pose(const SceneSettings& settings, const SceneWish& wish) {
  const FoundPose found = found_pose(settings, wish.seconds);
  const FoundPose before = shown_->found;
  if (refused_ == found.pose) return false;
  try {
    if (found != before && !move_to(found, wish.live) && !wish.live) open_in(found, settings);
    if (wish.live && !wanted_) relight(found, settings);
    refused_.reset();
  } catch (const Error& error) {
    refused_ = found.pose;
    // Live it may be shown already, and only its light not be had.
    wish.warn(fmt::format("The scene cannot be {}: {}",
                          shown_->found == found
                              ? "lit in that pose, and the light that it has stays"
                              : "shown in that pose, and the last one stays",
                          error.what()));
  }
  const ScenePose& now = shown_->found.pose;
  return now.nodes != before.pose.nodes || now.animation != before.pose.animation ||
         shown_->found.missing != before.missing;
}

bool Scenes::follow(const SceneSettings& settings, const SceneWish& wish) {
  const bool other = follow_file(settings, wish);
  return follow_pose(settings, wish) || other;
}

}  // namespace polyhull::element
