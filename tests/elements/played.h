// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What tests of takes share: a folder, and what came out of a pipeline.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "element_checks.h"
#include "support/folder.h"

namespace polyhull::test {

inline std::string take_in(const Folder& folder) {
  return folder.file("dance.take");
}

struct Seen {
  GstClockTime time, duration;
  std::string bytes;
  bool operator==(const Seen&) const = default;
};

/// What came out of a line's elements called `out…`, by name.
struct Played {
  explicit Played(const std::string& line) : pipeline(parse(line)) {
    g_autoptr(GstIterator) all = gst_bin_iterate_sinks(GST_BIN(pipeline));
    gst_iterator_foreach(
        all,
        [](const GValue* item, gpointer data) {
          auto* element = GST_ELEMENT(g_value_get_object(item));
          if (g_object_class_find_property(G_OBJECT_GET_CLASS(element), "signal-handoffs") ==
              nullptr)
            return;
          g_object_set(element, "signal-handoffs", TRUE, nullptr);
          g_signal_connect(element, "handoff", G_CALLBACK(take), data);
        },
        this);
  }
  ~Played() { stop(pipeline); }
  static void take(GstElement* sink, GstBuffer* buffer, GstPad*, gpointer data) {
    auto& self = *static_cast<Played*>(data);
    GstMapInfo map;
    gst_buffer_map(buffer, &map, GST_MAP_READ);
    const std::scoped_lock lock(self.mutex);
    self.seen[GST_OBJECT_NAME(sink)].push_back(
        {GST_BUFFER_PTS(buffer), GST_BUFFER_DURATION(buffer),
         std::string(reinterpret_cast<char*>(map.data), map.size)});
    gst_buffer_unmap(buffer, &map);
  }
  std::vector<Seen> of(const char* name) {
    const std::scoped_lock lock(mutex);
    return seen[name];
  }
  void clear() {
    const std::scoped_lock lock(mutex);
    seen.clear();
  }
  void pause() {
    gst_element_set_state(pipeline, GST_STATE_PAUSED);
    settle();
  }
  /// Waits until a change of state or a seek is done.
  void settle() { gst_element_get_state(pipeline, nullptr, nullptr, GST_CLOCK_TIME_NONE); }
  std::string run() {
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    return wait_for_end(pipeline);
  }

  GstElement* pipeline;
  std::mutex mutex;
  std::map<std::string, std::vector<Seen>> seen;
};

}  // namespace polyhull::test
