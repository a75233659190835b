// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/open_scenes.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "scene/changes/scene_changes.h"

namespace polyhull::element {
namespace {

constexpr std::size_t most_held = 2;

OpenScenes::Open opened(const SceneFile& file, bool rays) {
  Scene scene = open_scene(file);
  if (!rays) return {file, {}, std::make_shared<const Scene>(std::move(scene)), nullptr};
  const auto traced = std::make_shared<const TracedScene>(std::move(scene));
  return {file, {}, {traced, &traced->scene()}, traced};
}

}  // namespace

OpenScenes::Written OpenScenes::written(const SceneFile& file) {
  std::error_code none;
  return {std::filesystem::last_write_time(file.name, none),
          std::filesystem::last_write_time(file.environment.name, none)};
}

/// The one that is held or loaded, moved to the front; null: neither.
const OpenScenes::Open* OpenScenes::held(const SceneFile& file) {
  if (next_ && next_->file == file) {
    held_.insert(held_.begin(), *std::exchange(next_, std::nullopt));
    if (held_.size() > most_held) held_.pop_back();
  }
  const auto found =
      std::find_if(held_.begin(), held_.end(), [&](const Open& open) { return open.file == file; });
  if (found == held_.end()) return nullptr;
  std::rotate(held_.begin(), found, found + 1);
  return &held_.front();
}

bool OpenScenes::has_failed(const SceneFile& file) const {
  return failed_ && failed_->file == file && failed_->written == written(file);
}

/// What \p work gives becomes next_; throws what it throws, and remembers that of the file as it was
/// \p since.
void OpenScenes::load(const SceneFile& file, Written since, const std::function<Open()>& work) {
  try {
    next_ = work();
    failed_.reset();
  } catch (const Error& error) {
    failed_ = {file, since, error};
    throw;
  } catch (const std::exception& error) {
    failed_ = {file, since,
               Error(Error::Kind::unsupported, "{} cannot be loaded: {}", file.name, error.what())};
    throw failed_->why;
  }
}

/// What was loaded beside, once that has ended: waits for it.
void OpenScenes::collect() {
  try {
    load(under_way_, since_, [&] { return loading_.get(); });
  } catch (const Error&) {
    // Said by now(), if that is asked for it.
  }
}

/// As its file has it.
OpenScenes::Open OpenScenes::read(const SceneFile& file) {
  if (const Open* open = held(file)) return *open;
  if (loading_.valid() && under_way_ == file) collect();
  if (const Open* open = held(file)) return *open;
  if (has_failed(file)) throw failed_->why;
  load(file, written(file), [&] { return opened(file, false); });
  return *held(file);
}

OpenScenes::Open OpenScenes::now(const SceneFile& file, const ScenePose& pose) {
  const std::lock_guard lock(mutex_);
  Open open = read(file);
  if (pose == ScenePose()) return open;
  if (posed_of_ != open.scene || posed_->pose != pose) {
    Scene scene = *open.scene;
    pose_scene(pose, scene);
    posed_of_ = open.scene;
    posed_ = Open{file, pose, std::make_shared<const Scene>(std::move(scene)), nullptr};
  }
  return *posed_;
}

bool OpenScenes::is_ready(const SceneFile& file) {
  const std::lock_guard lock(mutex_);
  if (loading_.valid() && has_ended(loading_)) collect();
  const auto is_it = [&](const Open& open) { return open.file == file; };
  if ((next_ && is_it(*next_)) || std::any_of(held_.begin(), held_.end(), is_it) ||
      has_failed(file))
    return true;
  if (loading_.valid()) return false;
  under_way_ = file;
  since_ = written(file);
  try {
    loading_ = start_beside([file, rays = rays_.load()] { return opened(file, rays); });
  } catch (const std::system_error&) {
    return true;  // without another thread it is read when it is drawn
  }
  return false;
}

void OpenScenes::reset() {
  const std::lock_guard lock(mutex_);
  loading_ = {};  // waits for it
  held_.clear();
  posed_.reset();
  posed_of_.reset();
  next_.reset();
  failed_.reset();
}

}  // namespace polyhull::element
