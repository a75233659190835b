// SPDX-License-Identifier: LGPL-2.1-or-later
// Live lines in real time: every instant is one whole set, whatever cameras, queues and processors
// do. Which instants are seen is read from the pictures.
#include "support/live_line.h"

#include <algorithm>
#include <atomic>
#include <random>

#include "element_checks.h"
#include "support/run_kind.h"

using namespace polyhull::test;

namespace {

// Else views may come too late, or farther apart than the wait, which splits an instant.
const bool in_time = !sanitized();

void expect_whole(const LiveLine& line, double begin, double end, double share) {
  fail_unless(line.error().empty(), "%s", line.error().c_str());
  const LiveFigures f = line.figures(begin, end);
  fail_unless(f.sets > 0, "no sets from %.1f to %.1f s", begin, end);
  fail_unless((f.incomplete + f.split == 0 || !in_time) && f.mixed == 0,
              "%d sets: %d incomplete, %d mixed, %d split", f.sets, f.incomplete, f.mixed, f.split);
  fail_unless(f.unreadable == 0, "%d labels cannot be read", f.unreadable);
  fail_unless(!in_time || f.share() >= share, "%d of %d instants from %.1f to %.1f s", f.shown,
              f.instants, begin, end);
}

/// Sets of \p views views between two times.
int sets_of(const LiveLine& line, std::size_t views, double begin, double end) {
  int count = 0;
  for (const LiveSet& set : line.sets()) {
    const double time = static_cast<double>(set.time) * 1e-9;
    count += time >= begin && time < end && set.numbers.size() == views;
  }
  return count;
}

GstPad* source_pad(const LiveLine& line, const char* element) {
  GstElement* camera = line.element(element);
  GstPad* pad = gst_element_get_static_pad(camera, "src");
  gst_object_unref(camera);
  return pad;
}

bool warned(const LiveLine& line, std::initializer_list<const char*> parts) {
  return std::any_of(line.warnings().begin(), line.warnings().end(), [&](const std::string& text) {
    return std::all_of(parts.begin(), parts.end(),
                       [&](const char* part) { return text.find(part) != std::string::npos; });
  });
}

}  // namespace

ELEMENT_TEST(every_instant_is_one_whole_set) {
  for (const int cameras : {4, 8}) {
    LiveOptions options;
    options.cameras = cameras;
    LiveLine line(options);
    line.play(3.0);
    expect_whole(line, 1.0, line.now() - 0.5, 0.8);
    for (const char* word : {"without", "has ended", "has sent nothing"})
      fail_if(in_time && warned(line, {word}), "said of a line without faults: %s", word);
  }
}

ELEMENT_TEST(without_trigger_numbers_times_make_the_sets) {
  LiveOptions options;
  options.branch = "queue ! silhouette sigma=1 tolerance=1 trigger-from=none";
  LiveLine line(options);
  line.play(2.5);
  expect_whole(line, 1.0, line.now() - 0.5, 0.8);
}

ELEMENT_TEST(the_wait_fits_cameras_that_come_late) {
  LiveOptions options;
  options.delays = {0, 20, 80, 150};
  options.jitter = 15;
  LiveLine line(options);
  line.play(4.0);
  expect_whole(line, 1.5, line.now() - 0.5, 0.8);
  // The latest view is 165 ms late; on a busy machine a little more.
  fail_unless(line.latency() > 140.0, "%g ms", line.latency());
  fail_unless(!in_time || line.latency() < 260.0, "%g ms", line.latency());
}

ELEMENT_TEST(a_wait_by_hand_is_honoured) {
  LiveOptions options;
  options.delays = {0, 0, 0, 150};
  options.hull = "max-wait=400000000";
  LiveLine line(options);
  line.play(3.0);
  expect_whole(line, 1.0, line.now() - 0.7, 0.8);
  fail_unless(line.latency() >= 550.0, "%g ms", line.latency());  // the sources' 150 and 400
}

ELEMENT_TEST(what_comes_too_late_is_no_set_of_its_own) {
  LiveOptions options;
  options.delays = {0, 0, 0, 900};
  options.source = "";
  // The camera does not say that it is late: as one behind a slow network.
  options.branch = "queue ! silhouette sigma=1 tolerance=1";
  options.hull = "max-wait=20000000 missing-camera=drop-camera";
  LiveLine line(options);
  GstPad* pad = source_pad(line, "cam3");
  gst_pad_add_probe(
      pad, static_cast<GstPadProbeType>(GST_PAD_PROBE_TYPE_QUERY_UPSTREAM),
      [](GstPad*, GstPadProbeInfo* info, gpointer) {
        GstQuery* query = GST_PAD_PROBE_INFO_QUERY(info);
        if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY) return GST_PAD_PROBE_OK;
        gst_query_set_latency(query, TRUE, 0, GST_CLOCK_TIME_NONE);
        return GST_PAD_PROBE_HANDLED;
      },
      nullptr, nullptr);
  line.play(3.5);
  const LiveFigures f = line.figures(1.0, line.now() - 1.2);
  fail_unless((!in_time || (f.sets > 10 && f.split == 0)) && f.mixed == 0, "%d sets, %d split",
              f.sets, f.split);
  fail_unless(!in_time || line.statistic("hull", "views-late") > 10);
  fail_unless(warned(line, {"cam3 9", "came after its set had gone", "max-wait"}));
  fail_unless(warned(line, {"built from 3 cameras", "cam3"}));
  gst_object_unref(pad);
}

ELEMENT_TEST(busy_processors_part_nobody) {
  LiveOptions options;
  options.hull = "hold-time=1000000000";  // longer than any thread waits for its turn
  LiveLine line(options);
  line.play(1.5);
  auto load = LiveLine::load(3, 2.0);
  line.play(2.0);
  for (std::thread& thread : load) thread.join();
  const double over = line.now();
  line.play(3.0);
  expect_whole(line, 1.0, line.now() - 0.5, 0.0);
  expect_whole(line, over + 1.0, line.now() - 0.5, 0.7);
}

ELEMENT_TEST(a_camera_that_stalls_comes_back) {
  LiveOptions options;
  options.hull = "hold-time=300000000";
  LiveLine line(options);
  line.play(1.5);
  GstPad* pad = source_pad(line, "cam2");
  const gulong stalled = gst_pad_add_probe(
      pad, static_cast<GstPadProbeType>(GST_PAD_PROBE_TYPE_BLOCK | GST_PAD_PROBE_TYPE_BUFFER),
      [](GstPad*, GstPadProbeInfo*, gpointer) { return GST_PAD_PROBE_OK; }, nullptr, nullptr);
  const double begin = line.now();
  line.play(3.0);
  const double end = line.now();
  gst_pad_remove_probe(pad, stalled);
  line.play(2.0);
  gst_object_unref(pad);
  fail_unless(!in_time || sets_of(line, 3, begin + 0.6, end - 0.1) > 35, "%d sets meanwhile",
              sets_of(line, 3, begin + 0.6, end - 0.1));
  expect_whole(line, end + 0.5, line.now() - 0.4, 0.7);
  fail_unless(warned(line, {"built from 3 cameras", "cam2", "has sent nothing for"}));
}

ELEMENT_TEST(a_camera_that_ends_leaves_the_others) {
  LiveLine line{LiveOptions{}};
  line.play(1.5);
  GstElement* camera = line.element("cam1");
  gst_element_send_event(camera, gst_event_new_eos());
  gst_object_unref(camera);
  const double end = line.now();
  line.play(2.0);
  fail_unless(line.error().empty());
  fail_unless(!in_time || sets_of(line, 3, end + 0.3, line.now() - 0.3) > 25, "%d sets",
              sets_of(line, 3, end + 0.3, line.now() - 0.3));
  // Which is no camera that is lost.
  fail_if(warned(line, {"cable"}) || warned(line, {"Look after"}));
  fail_unless(warned(line, {"cam1", "has ended", "end of its stream"}), "%d warnings, the last: %s",
              static_cast<int>(line.warnings().size()),
              line.warnings().empty() ? "" : line.warnings().back().c_str());
}

ELEMENT_TEST(a_camera_joins_late) {
  LiveOptions options;
  options.linked = 3;
  LiveLine line(options);
  line.play(1.5);
  line.join();
  const double joined = line.now();
  line.play(2.5);
  fail_unless(!in_time || sets_of(line, 3, 0.8, joined - 0.2) > 5);
  // The camera needs a moment to come up.
  expect_whole(line, joined + 0.8, line.now() - 0.4, 0.7);
}

ELEMENT_TEST(a_camera_that_is_slow_by_half_halves_the_sets) {
  LiveLine line{LiveOptions{}};
  GstPad* pad = source_pad(line, "cam0");
  gst_pad_add_probe(
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [](GstPad*, GstPadProbeInfo* info, gpointer) {
        return GST_BUFFER_OFFSET(GST_PAD_PROBE_INFO_BUFFER(info)) % 2 == 0 ? GST_PAD_PROBE_OK
                                                                           : GST_PAD_PROBE_DROP;
      },
      nullptr, nullptr);
  line.play(4.0);
  expect_whole(line, 1.0, line.now() - 0.5, 0.4);
  // The others need not send what nobody can use.
  fail_unless(!in_time || line.statistic("cam1", "frames-unwanted") > 5);
  gst_object_unref(pad);
}

ELEMENT_TEST(a_stage_that_cannot_keep_up_gets_whole_instants) {
  LiveOptions options;
  options.tail = "identity sleep-time=100000 ! fakesink sync=true";
  LiveLine line(options);
  line.play(6.0);
  expect_whole(line, 1.0, line.now() - 1.0, 0.2);
  fail_unless(!in_time || line.statistic("hull", "frame-step") > 1);
  fail_unless(!in_time || line.statistic("cam1", "frames-unwanted") > 20);
}

ELEMENT_TEST(pausing_goes_on_where_it_was) {
  LiveLine line{LiveOptions{}};
  line.play(1.5);
  line.pause();
  g_usleep(700000);
  line.play(2.0);
  const double now = line.now();
  fail_unless(!in_time || now < 4.0, "running time has not stood still: %g s", now);
  expect_whole(line, 1.0, now - 0.5, 0.7);
}

ELEMENT_TEST(seeking_while_live_starts_anew) {
  LiveLine line{LiveOptions{}};
  line.play(1.5);
  const auto is_new = [](const LiveSet& set) { return set.numbers[0] >= 2500; };
  fail_unless(gst_element_seek_simple(line.pipeline(), GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                      100 * GST_SECOND));
  // Once the seek is back, the flush has gone through: what comes now is new. Until then, old sets
  // go on coming, and the first new ones may have come, too.
  const std::size_t sought = line.sets().size();
  line.play(2.0);
  const std::vector<LiveSet> sets = line.sets();
  const std::size_t before =
      static_cast<std::size_t>(std::find_if(sets.begin(), sets.end(), is_new) - sets.begin());
  fail_unless(before <= sought, "set %d of after the seek is of before it",
              static_cast<int>(sought));
  fail_unless(!in_time || sets.size() > before + 15, "%d sets after the seek",
              static_cast<int>(sets.size() - before));
  for (std::size_t i = before; i < sets.size(); ++i) {
    fail_unless(!sets[i].mixed() && is_new(sets[i]), "set %d shows %d", static_cast<int>(i),
                sets[i].numbers[0]);
    fail_unless(sets[i].time < GST_SECOND || sets[i].whole(4) || !in_time,
                "set %d of frame %d has %d views", static_cast<int>(i), sets[i].numbers[0],
                static_cast<int>(sets[i].numbers.size()));
  }
}

ELEMENT_TEST(another_frame_rate_while_live) {
  LiveLine line{LiveOptions{}};
  line.play(1.5);
  // All cameras change; the filters of the line have no names of their own to find them by.
  GstIterator* all = gst_bin_iterate_recurse(GST_BIN(line.pipeline()));
  GstCaps* caps = gst_caps_from_string("video/x-raw,format=RGBx,framerate=50/1");
  GValue item = G_VALUE_INIT;
  while (gst_iterator_next(all, &item) == GST_ITERATOR_OK) {
    GObject* element = static_cast<GObject*>(g_value_get_object(&item));
    if (g_str_has_prefix(GST_OBJECT_NAME(element), "capsfilter"))
      g_object_set(element, "caps", caps, nullptr);
    g_value_reset(&item);
  }
  g_value_unset(&item);
  gst_iterator_free(all);
  gst_caps_unref(caps);
  const double changed = line.now();
  line.play(2.0);
  expect_whole(line, changed + 0.5, line.now() - 0.4, 0.0);
  fail_unless(!in_time || sets_of(line, 4, changed + 0.5, line.now() - 0.4) > 40);
}

ELEMENT_TEST(a_camera_is_relinked) {
  LiveLine line{LiveOptions{}};
  line.play(1.5);
  GstElement* camera = line.element("cam3");
  GstElement* hull = line.element("hull");
  GstPad* sink = gst_element_get_static_pad(hull, "sink_3");
  GstPad* source = gst_pad_get_peer(sink);
  gst_element_set_locked_state(camera, TRUE);
  gst_element_set_state(camera, GST_STATE_READY);  // who pushes into nothing has an error
  g_usleep(100000);
  gst_pad_unlink(source, sink);
  line.play(1.0);
  const int without = sets_of(line, 3, 1.0, line.now());
  fail_unless(gst_pad_link(source, sink) == GST_PAD_LINK_OK);
  gst_element_set_locked_state(camera, FALSE);
  gst_element_sync_state_with_parent(camera);
  gst_object_unref(source);
  gst_object_unref(sink);
  gst_object_unref(hull);
  gst_object_unref(camera);
  const double linked = line.now();
  line.play(2.0);
  fail_unless(!in_time || without > 10, "%d sets meanwhile", without);
  expect_whole(line, linked + 0.5, line.now() - 0.4, 0.7);
}

/// Lines with queues of any size anywhere, and any wait.
ELEMENT_TEST(no_queue_and_no_wait_stalls) {
  const char* times = g_getenv("POLYHULL_STRESS");
  const int rounds = times != nullptr ? 3 * std::max(1, std::atoi(times)) : 1;
  std::mt19937 random(8);
  const auto queue = [&] {
    const int sizes[] = {1, 2, 3, 5, 20, 200};
    return "queue max-size-buffers=" + std::to_string(sizes[random() % 6]);
  };
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::unique_ptr<LiveLine>> lines;
    std::vector<std::string> told;
    for (int i = 0; i < 6; ++i) {
      LiveOptions options;
      options.rate = random() % 2 ? 10 : 25;
      if (random() % 3 == 0) options.delays = {0, 40, 0, 120};
      options.branch = queue() + " ! silhouette sigma=1 tolerance=1";
      if (random() % 4 != 0)
        options.hull = "max-wait=" + std::to_string(random() % 21) + "00000000";
      options.tail = (random() % 2 ? queue() + " ! " : "") + "fakesink sync=true";
      told.push_back(options.branch + " | " + options.hull + " | " + options.tail);
      lines.push_back(std::make_unique<LiveLine>(options));
      gst_element_set_state(lines.back()->pipeline(), GST_STATE_PLAYING);
    }
    for (int step = 0; step < 20; ++step)
      for (auto& line : lines) line->play(0.04);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const LiveFigures f = lines[i]->figures(1.0, 100.0);
      const int late = sets_of(*lines[i], 4, lines[i]->now() - 3.0, 100.0);
      fail_unless(lines[i]->error().empty(), "%s: %s", told[i].c_str(), lines[i]->error().c_str());
      fail_unless(late > 0 && f.mixed == 0 && (f.split == 0 || !in_time),
                  "%s: %d sets at the end, %d split", told[i].c_str(), late, f.split);
    }
  }
}
