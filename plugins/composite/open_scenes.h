// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scenes that composite has open: the last two that it drew with, and one that is loaded beside.
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/error.h"
#include "plugins/common/scene/scene_file.h"
#include "raytrace/traced_scene.h"
#include "scene/animation/scene_pose.h"
#include "scene/scene.h"

namespace polyhull::element {

/// For any threads.
class OpenScenes {
 public:
  struct Open {
    SceneFile file;
    ScenePose pose = {};
    std::shared_ptr<const Scene> scene;
    std::shared_ptr<const TracedScene> traced;  ///< null: not made
  };

  /// The scene of \p file in \p pose, which is read here and now where it is not there; drawn with from now on.
  /// Throws Error; one that could not be read is not read again before its file has changed: whoever
  /// announces it does so with each frame.
  Open now(const SceneFile& file, const ScenePose& pose = {});

  /// Whether now() would not be held up. Where it would be, \p file is loaded beside, one at a time.
  bool is_ready(const SceneFile& file);

  /// Whether what is loaded beside is made ready for rays, too.
  void want_rays(bool wanted) { rays_ = wanted; }

  void reset();

 private:
  using Written = std::array<std::filesystem::file_time_type, 2>;  // a file's scene and environment
  static Written written(const SceneFile& file);
  struct Failed {
    SceneFile file;
    Written written;
    Error why;
  };
  const Open* held(const SceneFile& file);
  Open read(const SceneFile& file);
  bool has_failed(const SceneFile& file) const;
  void load(const SceneFile& file, Written since, const std::function<Open()>& work);
  void collect();

  std::atomic<bool> rays_ = false;
  std::mutex mutex_;           // protects all below
  std::vector<Open> held_;     // the last one first
  std::optional<Open> posed_;  // the last one that was asked for in a pose of its own, and
  std::shared_ptr<const Scene> posed_of_;  // of which
  std::optional<Open> next_;               // loaded, and not yet drawn with
  std::optional<Failed> failed_;
  SceneFile under_way_;  // of loading_, and
  Written since_;        // when its file was written, as far as was known at its start
  std::future<Open> loading_;
};

}  // namespace polyhull::element
