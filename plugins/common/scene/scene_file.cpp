// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/scene/scene_file.h"

#include <sys/resource.h>

#include <system_error>

#include "base/thread_pool.h"
#include "builtin/room.h"
#include "environment/environment.h"
#include "scene/assumed_light.h"

namespace polyhull::element {
namespace {

constexpr const char* query_name = "polyhull-scene";
constexpr int niceness = 5;  // of 19: a quarter of the time beside one busy thread

}  // namespace

SceneFile SceneVersions::of(const std::string& path) {
  if (path.empty()) return {"builtin:room"};
  if (is_builtin_scene(path)) return {path};
  std::error_code gone;
  const std::filesystem::path absolute = std::filesystem::absolute(path, gone);
  const std::string name = gone ? path : absolute.lexically_normal().string();
  const auto written = std::filesystem::last_write_time(name, gone);
  const auto found = seen_.find(name);
  if (gone) return {name, found == seen_.end() ? 0 : found->second.version};
  Seen& seen = seen_.try_emplace(name, Seen{written, 0}).first->second;
  if (seen.written != written) seen = {written, seen.version + 1};
  return {name, seen.version};
}

EnvironmentFile SceneVersions::environment(const std::string& path, double turn) {
  if (path.empty()) return {};
  const SceneFile file = of(path);
  return {file.name, file.version, turn};
}

Scene open_scene(const SceneFile& file, const std::filesystem::path& folder) {
  Scene scene = polyhull::open_scene(file.name, folder);
  if (!file.environment.name.empty())
    set_environment(load_environment(file.environment.name, file.environment.turn), scene);
  return scene;
}

void give_way() {
  setpriority(PRIO_PROCESS, 0, niceness);  // on Linux of the thread alone
}

bool followers_ready(GstPad* pad, const SceneFile& file) {
  GstQuery* query = gst_query_new_custom(
      GST_QUERY_CUSTOM, gst_structure_new(query_name, "scene", G_TYPE_STRING, file.name.c_str(),
                                          "version", G_TYPE_INT, file.version, nullptr));
  if (const EnvironmentFile& around = file.environment; !around.name.empty())
    gst_structure_set(gst_query_writable_structure(query), "environment", G_TYPE_STRING,
                      around.name.c_str(), "environment-version", G_TYPE_INT, around.version,
                      "environment-turn", G_TYPE_DOUBLE, around.turn, nullptr);
  gboolean ready = TRUE;
  if (gst_pad_peer_query(pad, query))
    gst_structure_get_boolean(gst_query_get_structure(query), "ready", &ready);
  gst_query_unref(query);
  return ready != FALSE;
}

void start_pool() {
  parallel_for(2, 1, 0, [](std::size_t, std::size_t) {});
}

bool is_scene_query(GstQuery* query) {
  const GstStructure* asked = gst_query_get_structure(query);
  return GST_QUERY_TYPE(query) == GST_QUERY_CUSTOM && asked != nullptr &&
         gst_structure_has_name(asked, query_name) &&
         gst_structure_get_string(asked, "scene") != nullptr;
}

SceneFile scene_of(GstQuery* query) {
  const GstStructure* asked = gst_query_get_structure(query);
  SceneFile file{gst_structure_get_string(asked, "scene"), 0};
  gst_structure_get_int(asked, "version", &file.version);
  if (const gchar* around = gst_structure_get_string(asked, "environment")) {
    file.environment.name = around;
    gst_structure_get_int(asked, "environment-version", &file.environment.version);
    gst_structure_get_double(asked, "environment-turn", &file.environment.turn);
  }
  return file;
}

void answer_scene(GstQuery* query, bool ready) {
  gst_structure_set(gst_query_writable_structure(query), "ready", G_TYPE_BOOLEAN,
                    ready ? TRUE : FALSE, nullptr);
}

}  // namespace polyhull::element
