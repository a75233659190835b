// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which scene is meant while files are written anew, how one is loaded beside what plays, and how
/// scenesrc asks whether composite has the next one ready.
///
/// A scene that comes while playing would hold up the frame in which composite reads its file. So
/// scenesrc, once it begins to load it, asks downstream with each frame by the custom query
/// "polyhull-scene" (fields `scene`, a string, `version`, an int, and where there is an environment
/// `environment`, a string, `environment-version`, an int, and `environment-turn`, a double), upon which
/// composite loads it, too; the answer is the field `ready`, a boolean. Without an answer the scene is
/// shown as soon as scenesrc has it.
#pragma once

#include <gst/gst.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <map>
#include <string>
#include <utility>

#include "scene/announcement.h"
#include "scene/scene.h"

namespace polyhull::element {

/// As Announcement::scene, scene_version and environment.
struct SceneFile {
  std::string name;
  int version = 0;
  EnvironmentFile environment = {};
  bool operator==(const SceneFile&) const = default;
  /// Whether at most the environment's turn is another.
  bool same_files(const SceneFile& other) const {
    return name == other.name && version == other.version &&
           environment.name == other.environment.name &&
           environment.version == other.environment.version;
  }
};

/// Reads \p file, as open_scene(), with its environment but its nodes where they are. Throws Error.
Scene open_scene(const SceneFile& file, const std::filesystem::path& folder = {});

/// Tells files that were written anew from those that were not. For one thread.
class SceneVersions {
 public:
  /// The file at \p path as it is now, named by its absolute path as load_scene() does; empty: the
  /// built-in room. One that is gone counts as unchanged.
  SceneFile of(const std::string& path);
  /// The same of an environment picture; empty: none.
  EnvironmentFile environment(const std::string& path, double turn);

 private:
  struct Seen {
    std::filesystem::file_time_type written;
    int version = 0;
  };
  std::map<std::string, Seen> seen_;
};

/// Lets the calling thread give way to those that make pictures.
void give_way();
/// Starts the process's pool of threads, unless it runs: started by a thread that gives way it would
/// give way, too.
void start_pool();

/// Does \p work on a thread of its own that gives way.
template <class Work>
auto start_beside(Work work) {
  start_pool();
  return std::async(std::launch::async, [work = std::move(work)] {
    give_way();
    return work();
  });
}

/// Whether \p work, which is under way or has ended, has ended.
template <class Result>
bool has_ended(const std::future<Result>& work) {
  return work.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/// Whether what follows \p pad can show \p file with the next frame, or does not care.
bool followers_ready(GstPad* pad, const SceneFile& file);

/// Whether \p query asks that; of such a one the file, and its answer.
bool is_scene_query(GstQuery* query);
SceneFile scene_of(GstQuery* query);
void answer_scene(GstQuery* query, bool ready);

}  // namespace polyhull::element
