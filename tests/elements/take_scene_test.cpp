// SPDX-License-Identifier: LGPL-2.1-or-later
// Takes of a background and of a tracked camera: what is played is composited as it was live.

#include "camera_announced.h"
#include "element_test.h"
#include "played.h"
#include "small_scene.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int frames = 12;

/// A camera that moves, before a scene.
std::string tracked_scene(const Folder& folder) {
  return "scenesrc name=src light-spacing=0.2 scene=" +
         write_small_scene(folder.file("small.glb")) + " num-buffers=" + std::to_string(frames) +
         " ! video/x-raw,format=RGBA,width=160,height=90,framerate=25/1 ";
}

std::string track(const Folder& folder) {
  return "tracksrc location=" + record_motion(folder.path + "/moving.pcap", 10 * GST_MSECOND, 100) +
         " ";
}

std::string views(const char* to) {
  std::string line;
  for (const char* name : {"0", "1", "2"})
    line += std::string("rigtestsrc camera=cam") + name + " num-buffers=" + std::to_string(frames) +
            " ! video/x-raw,framerate=25/1 ! silhouette camera=cam" + name + " ! " + to + name +
            " ";
  return line;
}

constexpr char composited[] =
    "hullbuild name=h ! hulltexture ! queue ! c.mesh_0 composite name=c backend=processor ! "
    "video/x-raw,format=RGBA ! fakesink name=out ";

/// The cameras announced at pad src_5 of takesrc `t`.
void log_take(GstElement* pipeline, CameraLog& log) {
  GstElement* after = named(pipeline, "after");
  log_cameras(after, log);
}

}  // namespace

ELEMENT_TEST(test_the_composite_is_the_same_to_the_byte) {
  const Folder folder;
  Played live("takesink name=t location=" + take_in(folder) + " " + track(folder) + "! src.track " +
              tracked_scene(folder) + "! tee name=b ! queue ! t.sink_5 b. ! queue ! c.background " +
              views("tee name=v") +
              "v0. ! queue ! t.sink_0 v1. ! queue ! t.sink_1 v2. ! queue ! "
              "t.sink_2 v0. ! queue ! h. v1. ! queue ! h. v2. ! queue ! h. " +
              composited);
  check_ended(live.run());
  Played again("takesrc name=t location=" + take_in(folder) +
               " t.src_5 ! queue ! c.background t.src_0 ! queue ! h. t.src_1 ! queue ! h. "
               "t.src_2 ! queue ! h. " +
               composited);
  check_ended(again.run());
  for (Played* played : {&live, &again}) {
    GstElement* composite = named(played->pipeline, "c");
    fail_unless_equals_uint64(statistic(composite, "announcements"), frames);
    fail_unless_equals_uint64(statistic(composite, "drawn"), frames);
  }
  const auto before = live.of("out"), after = again.of("out");
  fail_unless_equals_int(before.size(), frames);
  fail_unless_equals_int(after.size(), frames);
  for (std::size_t i = 0; i < frames; ++i) fail_unless(before[i] == after[i], "frame %zu", i);
  fail_unless(before[3].bytes != before[4].bytes);
}

ELEMENT_TEST(test_seeks_find_the_camera_of_the_frame) {
  const Folder folder;
  check_ended(run_to_end(track(folder) + "! src.track " + tracked_scene(folder) +
                         "! takesink location=" + take_in(folder)));
  for (const bool backwards : {false, true}) {
    Played played("takesrc location=" + take_in(folder) +
                  " ! identity name=after ! fakesink name=out sync=false");
    CameraLog log;
    log_take(played.pipeline, log);
    played.pause();
    for (const int to : {9, 9, 2, 7, 0}) {
      log.frames.clear();
      log.announced = {};  // what a flush has taken is said again
      const gint64 time = to * 40 * static_cast<gint64>(GST_MSECOND);
      fail_unless(gst_element_seek(played.pipeline, backwards ? -1.0 : 1.0, GST_FORMAT_TIME,
                                   GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET, backwards ? 0 : time,
                                   GST_SEEK_TYPE_SET, backwards ? time + 1 : -1));
      played.settle();
      fail_if(log.frames.empty());
      fail_unless_equals_uint64(log.frames[0].time, static_cast<guint64>(time));
      for (const Shown& frame : log.frames)
        expect_place(frame.camera, {1e-9 * static_cast<double>(frame.time), -3, 0.3});
    }
    check_ended(played.run());
    for (const Shown& frame : log.frames)
      expect_place(frame.camera, {1e-9 * static_cast<double>(frame.time), -3, 0.3});
  }
}

// The camera alone, for a picture that is made again, or a video that comes from elsewhere.
ELEMENT_TEST(test_a_track_is_kept) {
  const Folder folder;
  check_ended(run_to_end(track(folder) + "! takesink location=" + take_in(folder)));
  const std::string video =
      "trackstamp name=src ! fakesink sync=false videotestsrc num-buffers=" +
      std::to_string(frames) +
      " ! video/x-raw,format=RGBA,width=160,height=90,framerate=25/1 ! src.sink";
  for (const std::string& line : {tracked_scene(folder) + "! fakesink sync=false", video}) {
    Played played("takesrc location=" + take_in(folder) + " ! queue ! src.track " + line);
    GstElement* source = named(played.pipeline, "src");
    CameraLog log;
    log_cameras(source, log);
    check_ended(played.run());
    fail_unless_equals_int(log.frames.size(), frames);
    for (const Shown& frame : log.frames)
      expect_place(frame.camera, {1e-9 * static_cast<double>(frame.time), -3, 0.3});
    expect_lens(log);
  }
}
