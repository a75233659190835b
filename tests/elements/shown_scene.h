// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Small scenes, and what scenesrc shows of them while it plays.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "builtin/shapes.h"
#include "element_checks.h"
#include "scene/announcement.h"
#include "support/folder.h"

namespace polyhull::test {

/// Of this program.
inline const Folder folder;

/// A box of the size \p size at \p x on a floor under a lamp \p lamp wide, as the file \p name.
inline std::string scene_file(const std::string& name, float size, float lamp = 1.0f,
                              float x = 0.0f) {
  const std::string path = folder.file(name);
  Scene scene;
  scene.materials.resize(2);
  scene.materials[1].emission = Vec3f(8.0f / lamp);
  scene.meshes = {parallelogram("floor", 0, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
                  box("box", 0, {x - size, 0, -size}, {x + size, 2 * size, size}),
                  parallelogram("lamp", 1, {-lamp / 2, 2, -lamp / 2}, {lamp, 0, 0}, {0, 0, lamp})};
  scene.exposure = 0.7f;
  save_scene(scene, path);
  return path;
}

/// What a playing scenesrc has shown, and what is done after which frame.
struct Shown {
  GstElement* pipeline = nullptr;
  GstElement* source = nullptr;
  std::function<void(Shown&, std::size_t)> after;
  std::vector<std::string> frames;
  std::vector<GstClockTime> times;      // of the frames
  std::vector<Announcement> announced;  // with each of them
  std::vector<std::string> said;        // warnings
  std::vector<std::string> asked;       // scenes, of what follows
  std::size_t unready = 0;              // how many of these questions are answered by no
  GMutex mutex;                         // protects these
  GCond cond;

  explicit Shown(const std::string& properties, std::function<void(Shown&, std::size_t)> then = {})
      : after(std::move(then)) {
    g_mutex_init(&mutex);
    g_cond_init(&cond);
    pipeline = parse(
        "scenesrc name=src light-cache=false light-spacing=0.1 eye=1,1.5,2 target=0,0.3,0 " +
        properties +
        " ! video/x-raw,format=RGBA,width=32,height=24,framerate=50/1 ! fakesink name=sink sync=" +
        (properties.find("is-live") != std::string::npos ? "true" : "false"));
    source = named(pipeline, "src");
    GstElement* sink = named(pipeline, "sink");
    GstPad* pad = gst_element_get_static_pad(sink, "sink");
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, take, this, nullptr);
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM, ask, this, nullptr);
    gst_object_unref(pad);
    GstBus* bus = gst_element_get_bus(pipeline);
    gst_bus_set_sync_handler(bus, hear, this, nullptr);
    gst_object_unref(bus);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
  }
  ~Shown() {
    stop(pipeline);
    g_mutex_clear(&mutex);
    g_cond_clear(&cond);
  }
  static GstPadProbeReturn take(GstPad* pad, GstPadProbeInfo* probe, gpointer data) {
    Shown& self = *static_cast<Shown*>(data);
    GstMapInfo map;
    fail_unless(gst_buffer_map(GST_PAD_PROBE_INFO_BUFFER(probe), &map, GST_MAP_READ));
    GstEvent* event = gst_pad_get_sticky_event(pad, GST_EVENT_CUSTOM_DOWNSTREAM_STICKY, 0);
    fail_unless(event != nullptr);
    g_mutex_lock(&self.mutex);
    self.times.push_back(GST_BUFFER_PTS(GST_PAD_PROBE_INFO_BUFFER(probe)));
    self.frames.emplace_back(reinterpret_cast<const char*>(map.data), map.size);
    self.announced.push_back(
        parse_announcement(gst_structure_get_string(gst_event_get_structure(event), "json")));
    const std::size_t number = self.frames.size() - 1;
    g_cond_broadcast(&self.cond);
    g_mutex_unlock(&self.mutex);
    gst_event_unref(event);
    gst_buffer_unmap(GST_PAD_PROBE_INFO_BUFFER(probe), &map);
    if (self.after) self.after(self, number);
    return GST_PAD_PROBE_OK;
  }
  void set(const char* name, const std::string& value) {
    gst_util_set_object_arg(G_OBJECT(source), name, value.c_str());
  }
  guint64 count(const char* name) const { return statistic(source, name); }
  void wait_for_end() { check_ended(test::wait_for_end(pipeline)); }
  /// Notes which scenes what follows is asked for, which it never has ready at first.
  static GstPadProbeReturn ask(GstPad*, GstPadProbeInfo* probe, gpointer data) {
    Shown& self = *static_cast<Shown*>(data);
    GstQuery* query = GST_PAD_PROBE_INFO_QUERY(probe);
    const GstStructure* asked = gst_query_get_structure(query);
    if (asked == nullptr || !gst_structure_has_name(asked, "polyhull-scene"))
      return GST_PAD_PROBE_OK;
    g_mutex_lock(&self.mutex);
    self.asked.emplace_back(gst_structure_get_string(asked, "scene"));
    const gboolean ready = self.asked.size() > self.unready ? TRUE : FALSE;
    g_mutex_unlock(&self.mutex);
    gst_structure_set(gst_query_writable_structure(query), "ready", G_TYPE_BOOLEAN, ready, nullptr);
    return GST_PAD_PROBE_HANDLED;
  }
  static GstBusSyncReply hear(GstBus*, GstMessage* message, gpointer data) {
    Shown& self = *static_cast<Shown*>(data);
    if (GST_MESSAGE_TYPE(message) != GST_MESSAGE_WARNING) return GST_BUS_PASS;
    GError* found = nullptr;
    gst_message_parse_warning(message, &found, nullptr);
    g_mutex_lock(&self.mutex);
    self.said.emplace_back(found->message);
    g_mutex_unlock(&self.mutex);
    g_clear_error(&found);
    return GST_BUS_PASS;
  }
  /// Waits until with some frame \p done holds, which is asked under the mutex; else fails with \p missing.
  template <class Done>
  void wait_until(const char* missing, Done done) {
    const gint64 end = g_get_monotonic_time() + 30 * G_TIME_SPAN_SECOND;
    g_mutex_lock(&mutex);
    while (!done()) fail_unless(g_cond_wait_until(&cond, &mutex, end), "%s", missing);
    g_mutex_unlock(&mutex);
  }
  /// The number of the first frame that is like \p frame, from \p first on.
  std::size_t wait_for(const std::string& frame, std::size_t first = 0) {
    wait_until("the frame that was asked for came not", [&] {
      while (first < frames.size() && frames[first] != frame) ++first;
      return first < frames.size();
    });
    return first;
  }
};

/// The picture of a scene that is there from the start.
inline std::string picture_of(const std::string& scene, const std::string& properties = "") {
  Shown shown("num-buffers=1 scene=" + scene + " " + properties);
  shown.wait_for_end();
  return shown.frames.at(0);
}

/// How far the pictures are apart at most, in levels.
inline int difference(const std::string& a, const std::string& b) {
  int most = a.size() == b.size() ? 0 : 255;
  for (std::size_t i = 0; i < a.size() && most < 255; ++i)
    most =
        std::max(most, std::abs(static_cast<std::uint8_t>(a[i]) - static_cast<std::uint8_t>(b[i])));
  return most;
}

}  // namespace polyhull::test
