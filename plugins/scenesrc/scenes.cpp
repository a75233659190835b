// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/scenesrc/scenes.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "scene/assumed_light.h"
#include "scene/scene_changes.h"

namespace polyhull::element {
namespace {

constexpr float bounce_spacing = 5.6f;  // of the spacing of the straight light
constexpr int bounces_by_spots = 1024;  // what a spot lights is small, and found by few directions
constexpr std::chrono::milliseconds patience{20};  // between two looks at whether to go on waiting

std::unique_ptr<OpenedScene> opened(const SceneFile& file, const SceneSettings& settings) {
  auto out = std::make_unique<OpenedScene>();
  out->file = file;
  const std::filesystem::path folder =
      settings.light_cache ? std::filesystem::path(g_get_user_cache_dir()) / "polyhull" / "light"
                           : std::filesystem::path();
  Scene scene = open_scene(file, folder);
  out->assumed = scene.lights.empty() && !scene.environment;
  if (out->assumed) assume_light(scene);  // of the file's poses: it stays where nodes move
  out->nodes_missing = change_nodes(parse_node_changes(file.nodes), scene);
  out->lights = scene.lights;
  out->exposure = scene.exposure;
  out->bounds = scene_bounds(scene);
  BackgroundOptions options;
  options.light.spacing = static_cast<float>(settings.light_spacing);
  options.light.bounce_spacing = bounce_spacing * options.light.spacing;
  if (std::any_of(scene.lights.begin(), scene.lights.end(),
                  [](const Light& l) { return l.is_spot(); }))
    options.light.bounce_samples = bounces_by_spots;
  options.light_folder = folder;
  options.progressive = settings.live && settings.progressive;
  options.method = settings.method;
  options.view.contrast = static_cast<float>(settings.smoothing);
  options.paths.light_samples = 2;
  out->background = std::make_unique<Background>(std::move(scene), options);
  return out;
}

/// The same with its light, beside the frames of another scene: half of the threads are left to those.
std::unique_ptr<OpenedScene> opened_and_lit(const SceneFile& file, const SceneSettings& settings,
                                            const std::atomic<bool>& stop) {
  auto out = opened(file, settings);
  const Stopwatch watch;
  out->background->prepare(out->lights_by(settings).lights, out->sky_by(settings),
                           settings.live ? std::max(pool_threads() / 2, 1) : 0, stop);
  out->light_ms = watch.milliseconds();
  return out;
}

}  // namespace

SceneFile Scenes::file_of(const SceneSettings& settings) {
  SceneFile file = versions_.of(settings.scene);
  file.nodes = settings.nodes;
  file.environment = versions_.environment(settings.environment, settings.environment_turn);
  return file;
}

void Scenes::open(const SceneSettings& settings) {
  close();
  choice_ = settings.scene_choice;
  shown_ = opened(file_of(settings), settings);
}

void Scenes::close() {
  wanted_.reset();
  latest_.reset();
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
      loading_ = start_beside(
          [this, file = under_way_, settings] { return opened_and_lit(file, settings, stop_); });
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

bool Scenes::follow(const SceneSettings& settings, const SceneWish& wish) {
  if (settings.scene_choice != choice_) {
    choice_ = settings.scene_choice;
    latest_ = file_of(settings);
  }
  // Poses that come faster than they are lit do not hold each other up: one is shown, then the latest.
  const bool on_the_way = wish.live && wanted_ && latest_ && wanted_->name == latest_->name &&
                          wanted_->version == latest_->version &&
                          wanted_->environment.name == latest_->environment.name &&
                          wanted_->environment.version == latest_->environment.version;
  if (latest_ && !on_the_way) wanted_ = std::exchange(latest_, std::nullopt);
  if (wanted_ && *wanted_ == shown_->file) wanted_.reset();
  if (!wanted_) return false;
  const bool followed = !wish.live || wish.followed(*wanted_);
  if (!make_ready(settings, wish) || !followed) return false;
  before_ = std::exchange(shown_, std::move(next_));
  wanted_.reset();
  return true;
}

}  // namespace polyhull::element
