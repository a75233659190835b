// SPDX-License-Identifier: LGPL-2.1-or-later
// takesink and takesrc: what was recorded plays as it was, from any place.
#include <gst/app/gstappsrc.h>
#include <sqlite3.h>

#include <filesystem>
#include <fstream>
#include <vector>

#include "plugins/common/rig_event.h"
#include "take/take_reader.h"

#include "element_test.h"
#include "played.h"
#include "support/folder.h"

using namespace polyhull::test;

namespace {

/// Three cameras' views, into a take and what \p rest does with tee a, b and c.
std::string cameras(int frames, const std::string& take, const std::string& rest = "",
                    const std::string& settings = "") {
  std::string line = "takesink name=t location=" + take + " " + settings + " ";
  for (const char* name : {"0", "1", "2"})
    line += std::string("rigtestsrc camera=cam") + name + " num-buffers=" + std::to_string(frames) +
            " ! video/x-raw,framerate=25/1 ! silhouette camera=cam" + name + " ! tee name=c" +
            name + " ! queue ! t.sink_" + name + " ";
  return line + rest;
}

constexpr char hull[] =
    "hullbuild name=h ! fakesink name=out c0. ! queue ! h. c1. ! queue ! h. c2. ! queue ! h. ";

constexpr char replay[] =
    " name=t t.src_0 ! queue ! h. t.src_1 ! queue ! h. t.src_2 ! queue ! h. hullbuild name=h ! "
    "fakesink name=out";

/// A take of \p frames tiny frames of 40 ms on two pads; each holds its number.
std::string numbers(const Folder& folder, int frames) {
  const std::string line =
      "takesink name=t location=" + take_in(folder) +
      " videotestsrc pattern=ball num-buffers=" + std::to_string(frames) +
      " ! video/x-raw,format=GRAY8,width=16,height=16,framerate=25/1 ! t.sink_0 "
      "videotestsrc pattern=snow num-buffers=" +
      std::to_string(frames) +
      " ! video/x-raw,format=GRAY8,width=8,height=8,framerate=25/1 ! t.sink_4";
  check_ended(run_to_end(line));
  return take_in(folder);
}

constexpr GstClockTime frame = 40 * GST_MSECOND;

bool seek(GstElement* pipeline, double rate, GstSeekFlags flags, GstClockTime from,
          GstClockTime to) {
  return gst_element_seek(pipeline, rate, GST_FORMAT_TIME, flags, GST_SEEK_TYPE_SET,
                          static_cast<gint64>(from), GST_SEEK_TYPE_SET,
                          GST_CLOCK_TIME_IS_VALID(to) ? static_cast<gint64>(to) : -1);
}

constexpr auto flushing = static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE);

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("takesink");
  check_documented("takesrc");
}

ELEMENT_TEST(test_hulls_are_the_same_to_the_byte) {
  const Folder folder;
  Played live(cameras(12, take_in(folder), hull));
  check_ended(live.run());
  Played again("takesrc location=" + take_in(folder) + replay);
  check_ended(again.run());
  const auto before = live.of("out"), after = again.of("out");
  fail_unless_equals_int(before.size(), 12);
  fail_unless_equals_int(after.size(), 12);
  for (std::size_t i = 0; i < before.size(); ++i) fail_unless(before[i] == after[i], "hull %zu", i);
}

/// hullbuild behind takesrc takes the rig that the take keeps.
ELEMENT_TEST(test_the_take_brings_its_rig) {
  const Folder folder;
  const std::string rig = std::string(g_getenv("POLYHULL_SOURCE")) + "/pipelines/rigs/five.json";
  Played live(cameras(2, take_in(folder), "hullbuild rig=" + rig + std::string(hull).substr(9),
                      "rig=" + rig));
  check_ended(live.run());
  Played again("takesrc location=" + take_in(folder) + replay);
  check_ended(again.run());
  fail_unless_equals_int(again.of("out").size(), 2);
  fail_unless(live.of("out") == again.of("out"));
}

/// As Windows' editors save it.
ELEMENT_TEST(test_a_rig_in_utf16_is_brought_as_utf8) {
  const Folder folder;
  const std::string rig = std::string(g_getenv("POLYHULL_SOURCE")) + "/pipelines/rigs/five.json";
  g_autofree char* utf8 = nullptr;
  fail_unless(g_file_get_contents(rig.c_str(), &utf8, nullptr, nullptr));
  gsize size = 0;
  g_autofree char* utf16 = g_convert(utf8, -1, "UTF-16LE", "UTF-8", nullptr, &size, nullptr);
  const auto brought = [&](const std::string& text) {
    const std::string path = folder.file("rig.json");
    fail_unless(
        g_file_set_contents(path.c_str(), text.data(), static_cast<gssize>(text.size()), nullptr));
    const std::string take = take_in(folder);
    check_ended(run_to_end("videotestsrc num-buffers=1 ! takesink existing=replace rig=" + path +
                           " location=" + take));
    Played again("takesrc name=t location=" + take + " ! fakesink name=out");
    check_ended(again.run());
    g_autoptr(GstElement) sink = gst_bin_get_by_name(GST_BIN(again.pipeline), "out");
    g_autoptr(GstPad) pad = gst_element_get_static_pad(sink, "sink");
    std::string told;
    for (guint i = 0;; ++i) {
      g_autoptr(GstEvent) event =
          gst_pad_get_sticky_event(pad, GST_EVENT_CUSTOM_DOWNSTREAM_STICKY, i);
      if (event == nullptr) break;
      told += polyhull::element::rig_of_event(event).value_or("");
    }
    g_autoptr(GstElement) source = gst_bin_get_by_name(GST_BIN(again.pipeline), "t");
    return std::pair(told, statistic(source, "rigs-unusable"));
  };
  fail_unless(brought("\xFF\xFE" + std::string(utf16, size)) ==
              std::pair(std::string(utf8), guint64{0}));
  // Latin 1: said.
  fail_unless(brought("{\"name\": \"B\xFChne\"}") == std::pair(std::string(), guint64{1}));
}

ELEMENT_TEST(test_times_caps_and_bytes_stay) {
  const Folder folder;
  const std::string sources =
      "videotestsrc num-buffers=25 ! video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1 ! "
      "tee "
      "name=v ! queue ! t.sink_0 v. ! queue ! fakesink name=outv "
      "audiotestsrc num-buffers=43 ! audio/x-raw,format=S16LE,rate=44100,channels=1 ! tee name=a ! "
      "queue ! t.sink_1 a. ! queue ! fakesink name=outa ";
  Played live("takesink name=t location=" + take_in(folder) + " " + sources);
  check_ended(live.run());
  Played again("takesrc name=t location=" + take_in(folder) +
               " t.src_0 ! video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1 ! fakesink "
               "name=outv t.src_1 ! audio/x-raw,format=S16LE,rate=44100,channels=1 ! fakesink "
               "name=outa");
  check_ended(again.run());
  fail_unless_equals_int(live.of("outv").size(), 25);
  fail_unless(live.of("outv") == again.of("outv"));
  fail_unless(live.of("outa") == again.of("outa"));
}

ELEMENT_TEST(test_any_place_is_found) {
  const Folder folder;
  Played all("takesrc name=t location=" + numbers(folder, 100) +
             " t.src_0 ! fakesink name=out t.src_4 ! fakesink name=outs");
  check_ended(all.run());
  const auto truth = all.of("out");
  fail_unless_equals_int(truth.size(), 100);
  gint64 duration = 0;
  fail_unless(gst_element_query_duration(all.pipeline, GST_FORMAT_TIME, &duration));
  fail_unless_equals_uint64(duration, 100 * frame);
  for (const int from : {70, 3, 99, 0, 42}) {
    all.pause();
    all.clear();
    const int to = std::min(100, from + 5);
    fail_unless(seek(all.pipeline, 1.0, flushing, from * frame, to * frame));
    check_ended(all.run());
    for (const char* out : {"out", "outs"}) {
      const auto seen = all.of(out);
      fail_unless_equals_int(seen.size(), to - from);
      for (int i = 0; i < to - from; ++i)
        fail_unless_equals_uint64(seen[static_cast<std::size_t>(i)].time, (from + i) * frame);
    }
    fail_unless(all.of("out")[0] == truth[static_cast<std::size_t>(from)]);
  }
}

ELEMENT_TEST(test_backwards_and_at_other_rates) {
  const Folder folder;
  Played all("takesrc name=t location=" + numbers(folder, 50) +
             " t.src_0 ! fakesink name=out t.src_4 ! fakesink");
  all.pause();
  for (const double rate : {-1.0, 2.5, -4.0}) {
    all.clear();
    fail_unless(seek(all.pipeline, rate, flushing, 10 * frame, 20 * frame));
    check_ended(all.run());
    const auto seen = all.of("out");
    fail_unless_equals_int(seen.size(), 10);
    for (int i = 0; i < 10; ++i)
      fail_unless_equals_uint64(seen[static_cast<std::size_t>(i)].time,
                                (rate > 0 ? 10 + i : 19 - i) * frame);
    gst_element_set_state(all.pipeline, GST_STATE_PAUSED);
  }
}

bool seek_simply(GstElement* pipeline, double rate, int flags, GstSeekType type, gint64 from) {
  return gst_element_seek(pipeline, rate, GST_FORMAT_TIME, static_cast<GstSeekFlags>(flags), type,
                          from, GST_SEEK_TYPE_NONE, -1);
}

// What cannot be done changes nothing of what plays.
ELEMENT_TEST(test_a_refused_seek_changes_nothing) {
  const Folder folder;
  Played all("takesrc name=t location=" + numbers(folder, 50) +
             " t.src_0 ! fakesink name=out t.src_4 ! fakesink");
  all.pause();
  fail_unless(seek(all.pipeline, 1.0, flushing, 10 * frame, 20 * frame));
  all.settle();
  all.clear();
  const int flush = GST_SEEK_FLAG_FLUSH;
  fail_if(seek_simply(all.pipeline, 1.0, 0, GST_SEEK_TYPE_SET, 0));
  fail_if(seek_simply(all.pipeline, 1.0, flush | GST_SEEK_FLAG_SEGMENT, GST_SEEK_TYPE_SET, 0));
  fail_if(seek_simply(all.pipeline, 2.0, GST_SEEK_FLAG_INSTANT_RATE_CHANGE, GST_SEEK_TYPE_NONE, 0));
  fail_if(seek(all.pipeline, 1.0, flushing, 30 * frame, 20 * frame));
  check_ended(all.run());
  const auto seen = all.of("out");
  fail_unless(seen.size() >= 9 && seen.size() <= 10, "%zu", seen.size());
  fail_unless_equals_uint64(seen.back().time, 19 * frame);
}

ELEMENT_TEST(test_forwards_after_backwards) {
  const Folder folder;
  Played all("takesrc name=t location=" + numbers(folder, 50) +
             " t.src_0 ! fakesink name=out t.src_4 ! fakesink");
  all.pause();
  for (const gint64 stop : {gint64{10 * frame}, gint64{-1}}) {
    fail_unless(gst_element_seek(all.pipeline, -1.0, GST_FORMAT_TIME, flushing, GST_SEEK_TYPE_SET,
                                 0, GST_SEEK_TYPE_SET, stop));
    all.settle();
    all.clear();
    fail_unless(seek_simply(all.pipeline, 1.0, flushing, GST_SEEK_TYPE_SET, 20 * frame));
    check_ended(all.run());
    const auto seen = all.of("out");
    fail_unless_equals_int(seen.size(), 30);
    fail_unless_equals_uint64(seen.front().time, 20 * frame);
    fail_unless_equals_uint64(seen.back().time, 49 * frame);
    gst_element_set_state(all.pipeline, GST_STATE_PAUSED);
  }
}

// From where it is, in both directions.
ELEMENT_TEST(test_another_rate_alone) {
  const Folder folder;
  Played all("takesrc name=t location=" + numbers(folder, 50) +
             " t.src_0 ! fakesink name=out t.src_4 ! fakesink");
  for (const double rate : {2.0, -2.0}) {
    all.pause();
    const bool forwards = rate > 0;
    fail_unless(seek(all.pipeline, forwards ? 1.0 : -1.0, flushing, forwards ? 30 * frame : 0,
                     forwards ? GST_CLOCK_TIME_NONE : 30 * frame + 1));
    all.settle();
    // On from where the last seek led.
    fail_unless(gst_element_send_event(
        all.pipeline, gst_event_new_step(GST_FORMAT_BUFFERS, 10, 1.0, TRUE, FALSE)));
    all.settle();
    all.clear();
    fail_unless(seek_simply(all.pipeline, rate, flushing, GST_SEEK_TYPE_NONE, 0));
    check_ended(all.run());
    const auto seen = all.of("out");
    fail_if(seen.empty());
    const GstClockTime begin = seen.front().time, end = seen.back().time;
    const GstClockTime at = (forwards ? 40 : 20) * frame;
    fail_unless(begin >= at - frame && begin <= at + frame, "%" GST_TIME_FORMAT,
                GST_TIME_ARGS(begin));
    fail_unless_equals_uint64(end, rate > 0 ? 49 * frame : 0);
  }
}

ELEMENT_TEST(test_seeking_while_it_plays) {
  const Folder folder;
  Played all("takesrc name=t location=" + numbers(folder, 200) +
             " t.src_0 ! queue ! fakesink name=out sync=true t.src_4 ! queue ! fakesink sync=true");
  gst_element_set_state(all.pipeline, GST_STATE_PLAYING);
  for (int i = 0; i < 20; ++i) {
    fail_unless(seek(all.pipeline, 1.0, flushing, (i * 37 % 190) * frame, GST_CLOCK_TIME_NONE));
    g_usleep(static_cast<gulong>(i % 4) * 15'000);
  }
  all.clear();
  fail_unless(seek(all.pipeline, 1.0, flushing, 190 * frame, GST_CLOCK_TIME_NONE));
  check_ended(wait_for_end(all.pipeline));
  const auto seen = all.of("out");
  fail_unless(seen.size() >= 10);
  fail_unless_equals_uint64(seen.back().time, 199 * frame);
}

ELEMENT_TEST(test_more_is_added_and_what_is_there_is_kept) {
  const Folder folder;
  check_ended(run_to_end(cameras(3, take_in(folder))));
  const std::string refused = run_to_end(cameras(3, take_in(folder)));
  fail_unless(refused.find("there already") != std::string::npos, "%s", refused.c_str());
  check_ended(run_to_end(cameras(4, take_in(folder), "", "existing=append")));
  Played both("takesrc name=t location=" + take_in(folder) +
              " t.src_0 ! fakesink name=out t.src_1 ! fakesink t.src_2 ! fakesink");
  check_ended(both.run());
  const auto seen = both.of("out");
  fail_unless_equals_int(seen.size(), 7);
  for (guint64 i = 0; i < 7; ++i) fail_unless_equals_uint64(seen[i].time, i * frame);
  check_ended(run_to_end(cameras(2, take_in(folder), "", "existing=replace")));
  Played less("takesrc location=" + take_in(folder) + " ! fakesink name=out");
  check_ended(less.run());
  fail_unless_equals_int(less.of("out").size(), 2);
}

ELEMENT_TEST(test_states) {
  const Folder folder;
  check_states(cameras(100, take_in(folder), "", "existing=replace"), 20);
}

ELEMENT_TEST(test_playing_states) {
  const Folder folder;
  check_states("takesrc name=t location=" + numbers(folder, 30) +
                   " t.src_0 ! queue ! fakesink sync=true t.src_4 ! fakesink",
               30);
}

ELEMENT_TEST(test_bad_input) {
  const Folder folder;
  const auto says = [](const std::string& line, const char* what) {
    const std::string end = run_to_end(line);
    fail_unless(end.find(what) != std::string::npos, "%s: %s", line.c_str(), end.c_str());
  };
  const std::string source = "videotestsrc num-buffers=3 ! ";
  says(source + "takesink", "location");
  says(source + "takesink location=/nowhere/at/all.take", "no folder");
  says(source + "takesink location=" + folder.path, "no file");
  says(source + "takesink rig=/nowhere.json location=" + take_in(folder), "/nowhere.json");
  fail_if(std::filesystem::exists(take_in(folder)));
  says("takesrc ! fakesink", "location");
  says("takesrc location=" + take_in(folder) + " ! fakesink", "No such file");
  std::ofstream(take_in(folder)) << "this is no take, but somebody's diary, which must not be lost";
  says("takesrc location=" + take_in(folder) + " ! fakesink", "no take");
  says(source + "takesink existing=replace location=" + take_in(folder), "no take");
  fail_unless_equals_int(std::filesystem::file_size(take_in(folder)), 61);
  // Two that write the same file.
  says(source + "takesink location=" + folder.file("x.take") + " " + source +
           "takesink location=" + folder.file("x.take"),
       "Another element");
}

ELEMENT_TEST(test_a_stream_without_times_is_said) {
  const Folder folder;
  GstElement* pipeline = parse(
      "fakesrc num-buffers=4 sizetype=fixed sizemax=10 format=bytes ! takesink name=t location=" +
      take_in(folder));
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  GstElement* sink = named(pipeline, "t");
  fail_unless_equals_uint64(statistic(sink, "buffers"), 4);
  fail_unless_equals_uint64(statistic(sink, "buffers-untimed"), 4);
  stop(pipeline);
}

/// A pipeline into the folder's take, with what is pushed at its sources.
struct Recording {
  explicit Recording(const Folder& folder, int pads) {
    std::string line = "takesink name=take location=" + take_in(folder);
    for (int i = 0; i < pads; ++i)
      line +=
          " appsrc name=in" + std::to_string(i) + " format=time caps=application/x-test ! take.";
    pipeline = parse(line);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
  }
  ~Recording() { stop(pipeline); }
  GstElement* in(int pad) const {
    GstElement* found =
        gst_bin_get_by_name(GST_BIN(pipeline), ("in" + std::to_string(pad)).c_str());
    gst_object_unref(found);  // the pipeline has it
    return found;
  }
  void push(int pad, GstClockTime time, GstClockTime duration = GST_CLOCK_TIME_NONE,
            guint flags = 0) const {
    GstBuffer* buffer = gst_buffer_new_memdup(&time, sizeof time);
    GST_BUFFER_PTS(buffer) = time;
    GST_BUFFER_DURATION(buffer) = duration;
    GST_BUFFER_FLAG_SET(buffer, flags);
    fail_unless_equals_int(gst_app_src_push_buffer(GST_APP_SRC(in(pad)), buffer), GST_FLOW_OK);
  }
  void end(int pad) const { gst_app_src_end_of_stream(GST_APP_SRC(in(pad))); }
  GstElement* pipeline;
};

/// The times at which the take's only stream comes, in milliseconds, after a seek to \p from by
/// \p rate.
std::vector<int> times_from(const Folder& folder, double rate, GstClockTime from,
                            GstClockTime stop) {
  Played played("takesrc location=" + take_in(folder) + " ! fakesink name=out sync=false");
  played.pause();
  fail_unless(gst_element_seek(played.pipeline, rate, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                               GST_SEEK_TYPE_SET, static_cast<gint64>(from), GST_SEEK_TYPE_SET,
                               static_cast<gint64>(stop)));
  played.settle();
  played.clear();
  check_ended(played.run());
  std::vector<int> times;
  for (const Seen& seen : played.of("out"))
    times.push_back(static_cast<int>(seen.time / GST_MSECOND));
  return times;
}

// A pipeline that has run for hours makes no take of hours.
ELEMENT_TEST(test_late_begin) {
  const Folder folder;
  {
    const Recording recording(folder, 1);
    for (int i = 0; i < 3; ++i) recording.push(0, 11 * 3600 * GST_SECOND + i * 40 * GST_MSECOND);
    recording.end(0);
    check_ended(wait_for_end(recording.pipeline));
  }
  const polyhull::TakeContent content = polyhull::read_take(take_in(folder));
  fail_unless_equals_int64(content.streams[0].begin, 10 * GST_SECOND);
  fail_unless_equals_int64(content.end, 10 * GST_SECOND + 80 * GST_MSECOND);
}

void wait_for_buffers(GstElement* take, guint64 count) {
  while (statistic(take, "buffers") < count) g_usleep(1000);
}

// Streams begin at times of their own; what is too early for the take is said.
ELEMENT_TEST(test_streams_begin_apart) {
  const Folder folder;
  {
    const Recording recording(folder, 2);
    GstElement* take = named(recording.pipeline, "take");
    recording.push(0, 100 * GST_SECOND);
    wait_for_buffers(take, 1);
    for (const guint64 at : {91, 92, 93}) recording.push(1, at * GST_SECOND);
    wait_for_buffers(take, 4);
    fail_unless_equals_uint64(statistic(take, "buffers-early"), 0);
    recording.push(1, 89 * GST_SECOND);
    wait_for_buffers(take, 5);
    fail_unless_equals_uint64(statistic(take, "buffers-early"), 1);
    recording.end(0);
    recording.end(1);
    check_ended(wait_for_end(recording.pipeline));
  }
  polyhull::TakeCursor cursor(take_in(folder), 2);
  for (const int after : {0, 1, 2, 3})
    fail_unless_equals_int64(cursor.next()->time, after * std::int64_t{1'000'000'000});
}

// A pad that waits for a camera that never came has no end.
ELEMENT_TEST(test_an_unlinked_pad_holds_no_end) {
  const Folder folder;
  const Recording recording(folder, 1);
  GstElement* take = named(recording.pipeline, "take");
  GstPad* spare = gst_element_request_pad_simple(take, "sink_7");
  GstPad* other = gst_element_request_pad_simple(take, "sink_8");
  recording.push(0, 0);
  wait_for_buffers(take, 1);
  gst_element_release_request_pad(take, other);  // ends nothing
  g_autoptr(GstBus) bus = gst_element_get_bus(recording.pipeline);
  fail_unless(gst_bus_timed_pop_filtered(bus, 100 * GST_MSECOND, GST_MESSAGE_EOS) == nullptr);
  recording.end(0);
  check_ended(wait_for_end(recording.pipeline));
  gst_object_unref(other);
  gst_object_unref(spare);
}

// Somebody looks into the take for longer than it is recorded: the element stops, and says so.
ELEMENT_TEST(test_a_reader_that_does_not_stop) {
  const Folder folder;
  sqlite3* base = nullptr;
  sqlite3_stmt* slow = nullptr;
  {
    const Recording recording(folder, 1);
    GstElement* take = named(recording.pipeline, "take");
    for (guint i = 0; i < 3; ++i) recording.push(0, i * frame);
    wait_for_buffers(take, 3);
    fail_unless_equals_int(sqlite3_open(take_in(folder).c_str(), &base), SQLITE_OK);
    sqlite3_prepare_v2(base, "SELECT id FROM packet", -1, &slow, nullptr);
    fail_unless_equals_int(sqlite3_step(slow), SQLITE_ROW);
    for (guint i = 3; i < 50; ++i) recording.push(0, i * frame);
    wait_for_buffers(take, 50);
    fail_unless_equals_uint64(statistic(take, "commits-held-up"), 1);
    fail_unless_equals_int(gst_element_set_state(recording.pipeline, GST_STATE_READY),
                           GST_STATE_CHANGE_SUCCESS);
    g_autoptr(GstBus) bus = gst_element_get_bus(recording.pipeline);
    g_autoptr(GstMessage) message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR);
    fail_unless(message != nullptr);
    g_autoptr(GError) error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    fail_unless(strstr(error->message, "has been reading it") != nullptr, "%s", error->message);
  }
  sqlite3_finalize(slow);
  sqlite3_close(base);
  fail_unless_equals_int64(polyhull::read_take(take_in(folder)).end, frame);
}

// What others wait for is released, or ends.
ELEMENT_TEST(test_released_pad_ends_the_take) {
  const Folder folder;
  const Recording recording(folder, 2);
  recording.push(0, 0);
  recording.push(1, 0);
  recording.end(0);
  GstElement* take = named(recording.pipeline, "take");
  wait_for_buffers(take, 2);
  g_usleep(100000);  // for the first stream's end, which nothing counts
  GstElement* source = recording.in(1);
  gst_element_set_locked_state(source, TRUE);
  gst_element_set_state(source, GST_STATE_NULL);
  GstPad* pad = gst_element_get_static_pad(take, "sink_1");
  gst_element_release_request_pad(take, pad);
  gst_object_unref(pad);
  check_ended(wait_for_end(recording.pipeline));
}

ELEMENT_TEST(test_pad_names) {
  GstElement* take = gst_element_factory_make("takesink", nullptr);
  GstPad* first = gst_element_request_pad_simple(take, "sink_0");
  fail_unless(first != nullptr);
  GstPad* other = gst_element_request_pad_simple(take, "sink_4294967295");
  fail_unless(other != nullptr && g_str_equal(GST_OBJECT_NAME(other), "sink_1"), "%s",
              other != nullptr ? GST_OBJECT_NAME(other) : "none");
  for (GstPad* pad : {first, other}) {
    gst_element_release_request_pad(take, pad);
    gst_object_unref(pad);
  }
  gst_object_unref(take);
}

// What has begun before is still seen; backwards what stands for itself.
ELEMENT_TEST(test_what_lasts_and_what_stands_alone) {
  const Folder folder;
  {
    const Recording recording(folder, 1);
    for (guint i = 0; i < 10; ++i)
      recording.push(0, i * 40 * GST_MSECOND, 40 * GST_MSECOND,
                     i % 5 == 0 ? 0 : GST_BUFFER_FLAG_DELTA_UNIT);
    recording.end(0);
    check_ended(wait_for_end(recording.pipeline));
  }
  const auto expect = [&](double rate, int from, int to, const std::vector<int>& times) {
    std::string found;
    for (const int time : times_from(folder, rate, static_cast<GstClockTime>(from) * GST_MSECOND,
                                     static_cast<GstClockTime>(to) * GST_MSECOND))
      found += std::to_string(time) + " ";
    std::string wanted;
    for (const int time : times) wanted += std::to_string(time) + " ";
    fail_unless_equals_string(found.c_str(), wanted.c_str());
  };
  expect(1.0, 210, 290, {200, 240, 280});
  expect(1.0, 290, 330, {280, 320});  // the sink leaves out what ends before
  expect(-1.0, 0, 400, {200, 0});
}

ELEMENT_TEST(test_a_damaged_take_plays_what_is_whole) {
  const Folder folder;
  check_ended(
      run_to_end("videotestsrc pattern=snow num-buffers=60 ! "
                 "video/x-raw,format=GRAY8,width=320,height=240,framerate=25/1 ! "
                 "takesink location=" +
                 take_in(folder)));
  {
    std::fstream file(take_in(folder), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(take_in(folder)) / 2));
    file << std::string(100, 'x');
  }
  Played rest("takesrc name=t location=" + take_in(folder) + " ! fakesink name=out");
  GstBus* bus = gst_element_get_bus(rest.pipeline);
  gst_element_set_state(rest.pipeline, GST_STATE_PLAYING);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 60 * GST_SECOND,
      static_cast<GstMessageType>(GST_MESSAGE_WARNING | GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  fail_unless_equals_int(GST_MESSAGE_TYPE(message), GST_MESSAGE_WARNING);
  GError* said = nullptr;
  gst_message_parse_warning(message, &said, nullptr);
  fail_unless(strstr(said->message, "damaged") != nullptr, "%s", said->message);
  g_error_free(said);
  gst_message_unref(message);
  gst_object_unref(bus);
  check_ended(wait_for_end(rest.pipeline));
  GstElement* source = named(rest.pipeline, "t");
  fail_unless(statistic(source, "packets-damaged") >= 1);
  fail_unless(rest.of("out").size() >= 55 && rest.of("out").size() < 60);
}
