// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/video/navigation.h>
#include <gst/video/video.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "controlled.h"
#include "element_checks.h"
#include "scene/announcement.h"
#include "small_scene.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

const Folder folder;
// GLib looks once; so before main().
const bool has_own_cache = g_setenv("XDG_CACHE_HOME", folder.file("cache").c_str(), TRUE) != FALSE;

const std::string& small() {
  static const std::string path = write_small_scene(folder.file("small.glb"));
  return path;
}

/// What arrived at the end of a pipeline: announcements (as "A") and buffers in order.
struct Log {
  std::vector<Announcement> announcements;
  std::vector<std::size_t> announced_before;  // number of buffers that had come before each
  std::vector<GstClockTime> times;
  std::vector<std::vector<std::uint8_t>> frames;
  std::vector<GstMemory*> memories;  // not owned: to tell whether they are the same
  GstVideoInfo info;
  GMutex mutex;
  GCond cond;
  Log() {
    g_mutex_init(&mutex);
    g_cond_init(&cond);
  }
  ~Log() {
    g_mutex_clear(&mutex);
    g_cond_clear(&cond);
  }
};

GstPadProbeReturn take(GstPad*, GstPadProbeInfo* probe, gpointer data) {
  Log& log = *static_cast<Log*>(data);
  g_mutex_lock(&log.mutex);
  if (GST_PAD_PROBE_INFO_TYPE(probe) & GST_PAD_PROBE_TYPE_BUFFER) {
    GstBuffer* buffer = GST_PAD_PROBE_INFO_BUFFER(probe);
    GstMapInfo map;
    fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
    log.frames.emplace_back(map.data, map.data + map.size);
    gst_buffer_unmap(buffer, &map);
    log.times.push_back(GST_BUFFER_PTS(buffer));
    log.memories.push_back(gst_buffer_peek_memory(buffer, 0));
  } else {
    GstEvent* event = GST_PAD_PROBE_INFO_EVENT(probe);
    const GstStructure* structure = gst_event_get_structure(event);
    if (GST_EVENT_TYPE(event) == GST_EVENT_CUSTOM_DOWNSTREAM_STICKY &&
        gst_structure_has_name(structure, "polyhull-announcement")) {
      log.announcements.push_back(parse_announcement(gst_structure_get_string(structure, "json")));
      log.announced_before.push_back(log.frames.size());
    } else if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS) {
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      fail_unless(gst_video_info_from_caps(&log.info, caps));
    }
  }
  g_cond_broadcast(&log.cond);
  g_mutex_unlock(&log.mutex);
  return GST_PAD_PROBE_OK;
}

GstElement* start(const std::string& line, Log& log) {
  GstElement* pipeline = parse(line);
  GstElement* sink = named(pipeline, "sink");
  GstPad* pad = gst_element_get_static_pad(sink, "sink");
  gst_pad_add_probe(
      pad,
      static_cast<GstPadProbeType>(GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      take, &log, nullptr);
  gst_object_unref(pad);
  return pipeline;
}

void run(const std::string& line, Log& log) {
  GstElement* pipeline = start(line, log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  const std::string result = wait_for_end(pipeline);
  fail_unless(result.empty(), "%s: %s", line.c_str(), result.c_str());
  stop(pipeline);
}

void wait_for_frames(Log& log, std::size_t count) {
  const gint64 end = g_get_monotonic_time() + 30 * G_TIME_SPAN_SECOND;
  g_mutex_lock(&log.mutex);
  while (log.frames.size() < count) {
    fail_unless(g_cond_wait_until(&log.cond, &log.mutex, end), "no frame %u came",
                static_cast<unsigned>(count));
  }
  g_mutex_unlock(&log.mutex);
}

std::string line_of(const std::string& properties, const std::string& caps = "width=64,height=48") {
  return "scenesrc name=src scene=" + small() + " eye-x=1 eye-y=1.5 eye-z=2 target-y=0.3 " +
         properties + " ! video/x-raw,format=RGBA," + caps + " ! fakesink name=sink";
}

double mean(const std::vector<std::uint8_t>& frame) {
  double sum = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (i % 4 != 3) sum += frame[i];
  }
  return sum / (0.75 * static_cast<double>(frame.size()));
}

guint64 counter(GstElement* pipeline, const char* name) {
  return statistic(named(pipeline, "src"), name);
}

}  // namespace

ELEMENT_TEST(documented) {
  check_documented("scenesrc");
}

ELEMENT_TEST(states) {
  check_states(line_of("light-spacing=0.2", "width=16,height=9"), 50);
}

ELEMENT_TEST(announces_before_the_first_frame_it_holds_for) {
  Log moving, still;
  run(line_of("num-buffers=4 path=orbit"), moving);
  fail_unless_equals_int(moving.frames.size(), 4);
  fail_unless_equals_int(moving.announcements.size(), 4);
  for (std::size_t i = 0; i < 4; ++i) fail_unless_equals_int(moving.announced_before[i], i);
  const Announcement& heard = moving.announcements[0];
  fail_unless_equals_int(heard.viewport.width, 64);
  fail_unless_equals_int(heard.viewport.height, 48);
  fail_unless(heard.scene == small());
  fail_unless_equals_int(heard.lights.size(), 1);
  fail_unless(std::abs(heard.exposure - 0.7f) < 1e-6f);
  fail_unless(heard.ambient.x > 0.0f);
  // The announced camera sees the corner of the box where the picture has it: red on the box's face
  // close to its edge, not beyond it.
  const Announcement& last = moving.announcements[3];
  const auto at = [&](const Vec3& world) {
    const Vec2 p = *last.viewport.project_ideal(world);
    return &moving.frames[3][4 * (64 * std::lround(p.y) + std::lround(p.x))];
  };
  const Vec3 centre(0, 0.6, 0);
  fail_unless(at(centre)[0] > 2 * at(centre)[2], "top of the box is red");

  run(line_of("num-buffers=5"), still);
  fail_unless_equals_int(still.announcements.size(), 1);
  for (std::size_t i = 1; i < 5; ++i) {
    fail_unless(still.memories[i] == still.memories[0], "a still picture is drawn once");
    fail_unless(still.times[i] == i * 40 * GST_MSECOND);
  }
}

ELEMENT_TEST(formats_and_sizes) {
  Log rgba, bgrx;
  run(line_of("num-buffers=1", "width=33,height=17,framerate=30000/1001"), rgba);
  fail_unless_equals_int(rgba.frames[0].size(), 33 * 17 * 4);
  fail_unless_equals_int(rgba.info.fps_n, 30000);
  std::string line = line_of("num-buffers=1", "width=33,height=17");
  line.replace(line.find("RGBA"), 4, "BGRx");
  run(line, bgrx);
  for (std::size_t i = 0; i < rgba.frames[0].size(); i += 4) {
    fail_unless_equals_int(rgba.frames[0][i], bgrx.frames[0][i + 2]);
    fail_unless_equals_int(rgba.frames[0][i + 1], bgrx.frames[0][i + 1]);
    fail_unless_equals_int(rgba.frames[0][i + 3], 255);
  }
  Log one;
  run(line_of("num-buffers=2 path=orbit", "width=1,height=1"), one);
  fail_unless_equals_int(one.frames[0].size(), 4);
  Log standard;
  run("scenesrc num-buffers=1 scene=" + small() + " ! fakesink name=sink", standard);
  fail_unless_equals_int(standard.info.width, 1280);
  fail_unless_equals_int(standard.info.height, 720);
  fail_unless_equals_int(standard.info.fps_n, 25);
}

ELEMENT_TEST(renegotiation_goes_on_in_time) {
  Log log;
  GstElement* pipeline = start("scenesrc scene=" + small() +
                                   " ! capsfilter name=filter caps=video/x-raw,width=32,height=18,"
                                   "framerate=10/1 ! fakesink name=sink sync=true",
                               log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  wait_for_frames(log, 2);
  GstElement* filter = named(pipeline, "filter");
  GstCaps* caps = gst_caps_from_string("video/x-raw,width=48,height=36,framerate=20/1");
  g_object_set(filter, "caps", caps, nullptr);
  gst_caps_unref(caps);
  const std::size_t seen = log.frames.size();
  wait_for_frames(log, seen + 4);
  stop(pipeline);
  bool changed = false;
  for (std::size_t i = 1; i < log.times.size(); ++i) {
    fail_unless(log.times[i] > log.times[i - 1]);
    const GstClockTime step = log.times[i] - log.times[i - 1];
    fail_unless(step == 100 * GST_MSECOND || step == 50 * GST_MSECOND);
    changed |= log.frames[i].size() == 48 * 36 * 4;
  }
  fail_unless(changed);
}

ELEMENT_TEST(seeks_to_the_frame_of_that_time) {
  Log whole, sought;
  run(line_of("num-buffers=30 path=orbit"), whole);
  GstElement* pipeline = start(line_of("path=orbit"), sought);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                         GST_STATE_CHANGE_SUCCESS);
  for (const guint64 target : {GST_SECOND, 200 * GST_MSECOND, GST_SECOND + 30 * GST_MSECOND}) {
    const std::size_t before = sought.frames.size();
    fail_unless(gst_element_seek_simple(
        pipeline, GST_FORMAT_TIME,
        static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        static_cast<gint64>(target)));
    wait_for_frames(sought, before + 1);
    fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                           GST_STATE_CHANGE_SUCCESS);
    const std::size_t index = target / (40 * GST_MSECOND);
    fail_unless(sought.times.back() == index * 40 * GST_MSECOND);
    fail_unless(sought.frames.back() == whole.frames[index], "the same picture as without seeking");
  }
  fail_if(gst_element_seek(pipeline, -1.0, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET,
                           0, GST_SEEK_TYPE_SET, GST_SECOND),
          "backwards is refused");
  stop(pipeline);
}

ELEMENT_TEST(stop_time_ends_the_stream) {
  Log log;
  GstElement* pipeline = start(line_of(""), log);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND);
  fail_unless(gst_element_seek(pipeline, 1.0, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                               GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_SET, 400 * GST_MSECOND));
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  fail_unless(wait_for_end(pipeline).empty());
  stop(pipeline);
  fail_unless(log.times.back() == 360 * GST_MSECOND);
}

/// The light is computed once, and found the next time, unless it is not to be kept.
ELEMENT_TEST(light_is_kept_from_one_run_to_the_next) {
  const std::filesystem::path kept =
      std::filesystem::path(g_get_user_cache_dir()) / "polyhull" / "light";
  std::filesystem::remove_all(kept);
  const auto loads = [](const char* properties, std::vector<std::uint8_t>& frame) {
    Log log;
    GstElement* pipeline =
        start(line_of(std::string("num-buffers=1 light-spacing=0.031 ") + properties), log);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    fail_unless(wait_for_end(pipeline).empty());
    fail_unless_equals_int(counter(pipeline, "warnings"), 0);
    const guint64 count = counter(pipeline, "light-loads");
    fail_unless_equals_int(counter(pipeline, "light-fills"), 1 - count);
    stop(pipeline);
    frame = log.frames[0];
    return count;
  };
  std::vector<std::uint8_t> computed, found, unkept;
  fail_unless_equals_int(loads("", computed), 0);
  fail_unless_equals_int(loads("", found), 1);
  fail_unless(computed == found, "the light from the file is another one");
  fail_unless_equals_int(loads("light-cache=false", unkept), 0);
  fail_unless(computed == unkept);
}

/// A live source shows a coarse light first and the exact one some time later; one that is not live
/// has the exact one in its first frame.
ELEMENT_TEST(live_light_is_coarse_and_then_exact) {
  const std::string properties = "light-cache=false light-spacing=0.1 refinement=never ";
  const auto first_frame = [&](const char* more) {
    Log log;
    GstElement* pipeline = start(line_of(properties + "num-buffers=1 " + more), log);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    fail_unless(wait_for_end(pipeline).empty());
    fail_unless_equals_int(counter(pipeline, "light-exact"),
                           std::string(more) != "is-live=true" ? 1 : 0);
    stop(pipeline);
    return log.frames[0];
  };
  const std::vector<std::uint8_t> exact = first_frame("");
  fail_unless(first_frame("progressive=false is-live=true") == exact);
  fail_unless(first_frame("is-live=true") != exact);

  Log log;
  GstElement* pipeline = start(line_of(properties + "is-live=true"), log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  std::size_t seen = 1;
  for (; counter(pipeline, "light-exact") == 0; ++seen) wait_for_frames(log, seen);
  wait_for_frames(log, seen + 2);
  fail_unless_equals_int(counter(pipeline, "light-fills"), 1);
  stop(pipeline);
  fail_unless(log.frames[0] != exact);
  fail_unless(log.frames.back() == exact);
}

ELEMENT_TEST(live_properties_act_on_the_next_frame) {
  Log log;
  GstElement* pipeline =
      start(line_of("light-cache=false", "width=64,height=48,framerate=50/1"), log);
  GstElement* sink = named(pipeline, "sink");
  g_object_set(sink, "sync", TRUE, nullptr);
  GstElement* source = named(pipeline, "src");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  wait_for_frames(log, 2);
  const double normal = mean(log.frames.back());
  const auto after = [&](const char* name, double value) {
    g_object_set(source, name, value, nullptr);
    // One frame may have been on its way.
    g_mutex_lock(&log.mutex);
    const std::size_t now = log.frames.size();
    g_mutex_unlock(&log.mutex);
    wait_for_frames(log, now + 3);
    g_mutex_lock(&log.mutex);
    const double result = mean(log.frames.back());
    g_mutex_unlock(&log.mutex);
    return result;
  };
  const double dim = after("light-intensity", 0.25);
  fail_unless(dim < 0.7 * normal, "%g %g", dim, normal);
  fail_unless_equals_int(counter(pipeline, "light-fills"), 1);
  fail_unless(after("light-intensity", 0.0) == 0.0);
  fail_unless(std::abs(after("light-intensity", 1.0) - normal) < 0.01);
  fail_unless(after("exposure-compensation", 1.0) > 1.15 * normal);
  fail_unless(std::abs(after("exposure-compensation", 0.0) - normal) < 0.01);
  fail_unless(std::abs(after("light-x", 1.5) - normal) > 1.0);
  fail_unless_equals_int(counter(pipeline, "light-fills"), 2);
  const Vec3f moved = log.announcements.back().lights[0].centre;
  fail_unless(std::abs(moved.x - 1.5f) < 1e-5f);
  const std::size_t said = log.announcements.size();
  after("field-of-view", 20.0);
  fail_unless(log.announcements.size() == said + 1);
  // A distortion that no lens has is said, once.
  const guint64 warned = counter(pipeline, "warnings");
  after("distortion-k1", -10.0);
  after("light-intensity", 0.9);
  fail_unless_equals_int(counter(pipeline, "warnings"), warned + 1);
  after("distortion-k1", 0.0);
  // A camera of the scene, then one that it does not have: the last view stays, with a warning.
  g_object_set(source, "camera", "above", nullptr);
  after("smoothing", 0.045);
  fail_unless(std::abs(log.announcements.back().viewport.centre().y - 3.0) < 1e-3);
  g_object_set(source, "camera", "nowhere", nullptr);
  after("smoothing", 0.045);
  fail_unless(counter(pipeline, "warnings") > 0);
  fail_unless(std::abs(log.announcements.back().viewport.centre().y - 3.0) < 1e-3);
  stop(pipeline);
}

ELEMENT_TEST(controllers_drive_the_viewport) {
  Log log;
  GstElement* pipeline = start(line_of("num-buffers=3"), log);
  GstElement* source = named(pipeline, "src");
  control(source, "eye-x", 1.0, 3.0, 80 * GST_MSECOND);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  fail_unless(wait_for_end(pipeline).empty());
  stop(pipeline);
  fail_unless_equals_int(log.announcements.size(), 3);
  for (int i = 0; i < 3; ++i) {
    fail_unless(std::abs(log.announcements[i].viewport.centre().x - (1.0 + i)) < 1e-6);
  }
}

ELEMENT_TEST(key_frames_move_the_viewport) {
  const std::string path = folder.file("move.json");
  std::ofstream(path) << R"({"format": "polyhull-key-frames", "version": 1, "keys": [
      {"time": 0, "eye": [1, 1.5, 2], "target": [0, 0.3, 0], "field-of-view": 40},
      {"time": 0.08, "eye": [3, 1.5, 2], "easing": "linear"},
      {"time": 0.12, "cut": true, "eye": [0, 1, 3], "field-of-view": 20}]})";
  Log log;
  run(line_of("num-buffers=5 path=orbit key-frames=" + path), log);
  fail_unless_equals_int(log.announcements.size(), 4);  // the last one holds for two frames
  const double xs[] = {1, 2, 3, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    const Camera& viewport = log.announcements[i].viewport;
    fail_unless(std::abs(viewport.centre().x - xs[i]) < 1e-9, "%g", viewport.centre().x);
    const double degrees = 2.0 * glm::degrees(std::atan(24.0 / viewport.K[1][1]));
    fail_unless(std::abs(degrees - (i < 3 ? 40 : 20)) < 1e-9, "%g", degrees);
    // Who blurs motion knows by the name that a cut is none.
    fail_unless((viewport.name == log.announcements[0].viewport.name) == (i < 3));
  }
  std::ofstream(path)
      << R"({"format": "polyhull-key-frames", "version": 1, "keys": [{"time": -1}]})";
  const std::string result = run_to_end(line_of("num-buffers=5 key-frames=" + path));
  fail_unless(result.find("move.json: keys[0]") != std::string::npos, "%s", result.c_str());
}

// While playing they are read when they are named, or written anew; broken ones leave the viewport.
ELEMENT_TEST(key_frames_are_live) {
  const std::string path = folder.file("live.json");
  const auto write = [&](const std::string& key) {
    std::ofstream(path + ".new") << R"({"format": "polyhull-key-frames", "version": 1, "keys": [)" +
                                        key + "]}";
    std::filesystem::rename(path + ".new", path);
  };
  const auto at = [](const char* x) {
    return std::string(R"({"time": 0, "target": [0, 0.3, 0], "field-of-view": 40, "eye": [)") + x +
           ", 1, 2]}";
  };
  Log log;
  GstElement* pipeline = start(line_of("", "width=64,height=48,framerate=50/1"), log);
  GstElement* sink = named(pipeline, "sink");
  g_object_set(sink, "sync", TRUE, nullptr);
  GstElement* source = named(pipeline, "src");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  wait_for_frames(log, 1);
  const auto expect_x = [&](double x) {
    const gint64 end = g_get_monotonic_time() + 10 * G_TIME_SPAN_SECOND;
    double found = NAN;
    while (!(std::abs(found - x) < 1e-9)) {
      fail_unless(g_get_monotonic_time() < end, "%g instead of %g", found, x);
      g_usleep(10000);
      g_mutex_lock(&log.mutex);
      found = log.announcements.back().viewport.centre().x;
      g_mutex_unlock(&log.mutex);
    }
  };
  write(at("2"));
  g_object_set(source, "key-frames", path.c_str(), nullptr);
  expect_x(2);
  write(at("3"));
  expect_x(3);
  write("{}");
  for (int i = 0; i < 1000 && counter(pipeline, "warnings") == 0; ++i) g_usleep(10000);
  fail_unless(counter(pipeline, "warnings") > 0);
  expect_x(3);
  write(at("4"));
  expect_x(4);
  // Three numbers at once, and what is none.
  g_object_set(source, "key-frames", nullptr, "eye", "-1.5, 2,2.5e0", "target", "0,0.5,0", nullptr);
  expect_x(-1.5);
  gdouble y = 0.0, z = 0.0;
  g_object_get(source, "eye-y", &y, "target-y", &z, nullptr);
  fail_unless(y == 2.0 && z == 0.5);
  for (const char* wrong : {"1,2", "1,2,3,4", "1;2;3", "1,2,x", "1,2,nan", "1,2,1e7", "", "1,,2"}) {
    g_object_set(source, "eye", wrong, nullptr);
    g_object_get(source, "eye-y", &y, nullptr);
    fail_unless(y == 2.0, "%s", wrong);
  }
  GstBus* bus = gst_element_get_bus(pipeline);
  expect_warning(bus, "\"eye\" was set to something that is not three numbers");
  gst_object_unref(bus);
  stop(pipeline);
  // Before there is a pipeline that could take a message.
  GstElement* alone = gst_element_factory_make("scenesrc", nullptr);
  ASSERT_WARNING(g_object_set(alone, "eye", "1 2 3", nullptr));
  gst_object_unref(alone);
}

ELEMENT_TEST(a_picture_that_is_mostly_white_is_said_once) {
  for (const bool bright : {false, true}) {
    GstElement* pipeline =
        parse(line_of(std::string("num-buffers=4 eye=0,1.5,0.1 target=0,0,0 field-of-view=40 ") +
                      (bright ? "exposure-compensation=5" : "")));
    GstElement* source = named(pipeline, "src");
    control(source, "eye-x", 0.0, 0.1, 160 * GST_MSECOND);  // each frame is another view
    GstBus* bus = gst_element_get_bus(pipeline);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    const std::string end = wait_for_end(pipeline);
    fail_unless(end.empty(), "%s", end.c_str());
    fail_unless_equals_int(counter(pipeline, "clipped"), bright);
    stop(pipeline);
    gst_object_unref(bus);
  }
}

ELEMENT_TEST(mouse_and_keys_move_the_viewport) {
  Log log;
  GstElement* pipeline = start(line_of("", "width=64,height=48,framerate=50/1"), log);
  GstElement* sink = named(pipeline, "sink");
  g_object_set(sink, "sync", TRUE, nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  wait_for_frames(log, 1);
  GstPad* pad = gst_element_get_static_pad(sink, "sink");
  const auto centre_after = [&](GstStructure* what) {
    fail_unless(gst_pad_push_event(pad, gst_event_new_navigation(what)));
    g_mutex_lock(&log.mutex);
    const std::size_t now = log.frames.size();
    g_mutex_unlock(&log.mutex);
    wait_for_frames(log, now + 3);
    return log.announcements.back().viewport.centre();
  };
  const auto mouse = [](const char* event, double x, double y) {
    return gst_structure_new("application/x-gst-navigation", "event", G_TYPE_STRING, event,
                             "button", G_TYPE_INT, 1, "pointer_x", G_TYPE_DOUBLE, x, "pointer_y",
                             G_TYPE_DOUBLE, y, nullptr);
  };
  const auto key = [](const char* name) {
    return gst_structure_new("application/x-gst-navigation", "event", G_TYPE_STRING, "key-press",
                             "key", G_TYPE_STRING, name, nullptr);
  };
  const Vec3 target(0, 0.3, 0), before(1, 1.5, 2);
  centre_after(mouse("mouse-button-press", 10, 10));
  const Vec3 dragged = centre_after(mouse("mouse-move", 22, 10));
  centre_after(mouse("mouse-button-release", 22, 10));
  fail_unless(glm::length(dragged - before) > 0.5);
  fail_unless(std::abs(glm::length(dragged - target) - glm::length(before - target)) < 1e-6,
              "it turns around the target");
  fail_unless(glm::length(centre_after(mouse("mouse-move", 40, 30)) - dragged) < 1e-9,
              "no button, no drag");
  const Vec3 nearer = centre_after(key("w"));
  fail_unless(glm::length(nearer - target) < 0.95 * glm::length(before - target));
  fail_unless(glm::length(centre_after(key("Home")) - before) < 1e-6);
  gst_object_unref(pad);
  stop(pipeline);
}

ELEMENT_TEST(a_still_view_is_refined_and_then_only_repeated) {
  Log log;
  GstElement* pipeline = start(line_of("num-buffers=12 refinement=always samples=5"), log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  fail_unless(wait_for_end(pipeline).empty());
  fail_unless_equals_int(counter(pipeline, "frames-drawn"), 1);
  fail_unless_equals_int(counter(pipeline, "frames-refined"), 5);
  fail_unless_equals_int(counter(pipeline, "frames-repeated"), 6);
  fail_unless_equals_int(counter(pipeline, "samples"), 5);
  stop(pipeline);
  fail_unless(log.frames[1] != log.frames[0]);
  fail_unless(log.frames[11] == log.frames[5]);
  fail_unless(log.memories[11] == log.memories[5]);
  fail_unless(std::abs(mean(log.frames[11]) - mean(log.frames[0])) < 0.5);
  fail_unless_equals_int(log.announcements.size(), 1);
}

ELEMENT_TEST(live_frames_come_at_their_time_and_are_refined_between) {
  Log log;
  GstElement* pipeline = start(
      line_of("num-buffers=15 is-live=true progressive=false", "width=32,height=24,framerate=25/1"),
      log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  fail_unless(wait_for_end(pipeline).empty());
  fail_unless(counter(pipeline, "frames-refined") > 0);
  stop(pipeline);
  for (std::size_t i = 1; i < log.times.size(); ++i) {
    fail_unless(log.times[i] > log.times[i - 1]);
    fail_unless((log.times[i] - log.times[0]) % (40 * GST_MSECOND) == 0);
  }
}

ELEMENT_TEST(bad_scenes_are_refused_once_and_clearly) {
  {
    std::ofstream(folder.file("empty.gltf"))
        << R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[]}]})";
    std::ofstream(folder.file("textured.gltf"))
        << R"({"asset":{"version":"2.0"},"materials":[{"name":"brick","pbrMetallicRoughness":
        {"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],"images":[{"uri":"brick.png"}]})";
  }
  const std::pair<std::string, const char*> cases[] = {{"/nowhere/room.glb", "does not exist"},
                                                       {folder.file("empty.gltf"), "no geometry"},
                                                       {folder.file("textured.gltf"), "brick.png"},
                                                       {folder.path, "not a file"}};
  for (const auto& [path, words] : cases) {
    GstElement* pipeline = parse("scenesrc scene=" + path + " ! fakesink");
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_PAUSED),
                           GST_STATE_CHANGE_FAILURE);
    GstBus* bus = gst_element_get_bus(pipeline);
    int errors = 0;
    while (GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR)) {
      GError* error = nullptr;
      gst_message_parse_error(message, &error, nullptr);
      fail_unless(std::strstr(error->message, words) != nullptr, "%s", error->message);
      g_clear_error(&error);
      gst_message_unref(message);
      ++errors;
    }
    fail_unless_equals_int(errors, 1);
    gst_object_unref(bus);
    stop(pipeline);
  }
  const std::string result = run_to_end(line_of("eye-x=0 eye-y=0.3 eye-z=0"));
  fail_unless(result.find("eye and a target") != std::string::npos, "%s", result.c_str());
}

ELEMENT_TEST(a_frame_outlives_its_pipeline) {
  GstElement* pipeline = parse(line_of("num-buffers=3") + " enable-last-sample=true");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  fail_unless(wait_for_end(pipeline).empty());
  GstElement* sink = named(pipeline, "sink");
  GstSample* sample = nullptr;
  g_object_get(sink, "last-sample", &sample, nullptr);
  stop(pipeline);
  GstMapInfo map;
  fail_unless(gst_buffer_map(gst_sample_get_buffer(sample), &map, GST_MAP_READ));
  fail_unless(mean(std::vector<std::uint8_t>(map.data, map.data + map.size)) > 1.0);
  gst_buffer_unmap(gst_sample_get_buffer(sample), &map);
  gst_sample_unref(sample);
}

ELEMENT_TEST(two_in_one_process) {
  fail_unless(
      run_to_end("scenesrc num-buffers=5 path=orbit scene=" + small() +
                 " ! video/x-raw,width=32,height=18 ! fakesink scenesrc num-buffers=5 scene=" +
                 small() + " ! video/x-raw,width=48,height=18 ! fakesink")
          .empty());
}
