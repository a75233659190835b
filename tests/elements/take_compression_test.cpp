// SPDX-License-Identifier: LGPL-2.1-or-later
// takesink's compression: what is played is what was recorded, or within the error that is said.
#include <gst/check/gstharness.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

#include "element_test.h"
#include "played.h"
#include "support/folder.h"
#include "take/take_reader.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

using namespace polyhull::test;

namespace {

/// A camera's views, recorded and seen.
std::string camera(const Folder& folder, int frames, const std::string& settings) {
  return "takesink name=t location=" + take_in(folder) + " " + settings +
         " rigtestsrc camera=cam0 num-buffers=" + std::to_string(frames) +
         " ! video/x-raw,framerate=25/1 ! silhouette camera=cam0 ! tee name=v ! queue ! t.sink_0 "
         "v. ! queue ! fakesink name=out sync=false";
}

std::string play(const Folder& folder) {
  return "takesrc location=" + take_in(folder) + " ! fakesink name=out sync=false";
}

polyhull::Bytes bytes_of(const Seen& seen) {
  return {reinterpret_cast<const std::uint8_t*>(seen.bytes.data()), seen.bytes.size()};
}

}  // namespace

ELEMENT_TEST(test_exact_views_are_the_same) {
  const Folder folder;
  Played live(camera(folder, 20, "compression=exact key-interval=5"));
  check_ended(live.run());
  Played again(play(folder));
  check_ended(again.run());
  fail_unless_equals_int(live.of("out").size(), 20);
  fail_unless(live.of("out") == again.of("out"));
  const guint64 bytes = statistic(named(live.pipeline, "t"), "bytes");
  const guint64 stored = statistic(named(live.pipeline, "t"), "bytes-stored");
  fail_unless(stored < bytes / 2, "%" G_GUINT64_FORMAT " of %" G_GUINT64_FORMAT, stored, bytes);
  fail_unless_equals_uint64(statistic(named(live.pipeline, "t"), "buffers-alone"), 4);
}

ELEMENT_TEST(test_exact_textured_meshes_are_the_same) {
  const Folder folder;
  std::string line = "takesink name=t compression=exact location=" + take_in(folder) +
                     " hullbuild name=h ! hulltexture ! tee name=m ! queue ! t.sink_0 m. ! queue ! "
                     "fakesink name=out sync=false ";
  for (const char* name : {"0", "1", "2"})
    line += std::string("rigtestsrc camera=cam") + name +
            " num-buffers=6 ! video/x-raw,framerate=25/1 ! silhouette camera=cam" + name +
            " ! queue ! h. ";
  Played live(line);
  check_ended(live.run());
  Played again(play(folder));
  check_ended(again.run());
  fail_unless_equals_int(live.of("out").size(), 6);
  fail_unless(live.of("out") == again.of("out"));
}

ELEMENT_TEST(test_lossy_is_as_good_as_it_says) {
  const Folder folder;
  Played live(camera(folder, 12, "compression=lossy quantizer=10"));
  check_ended(live.run());
  Played again(play(folder));
  check_ended(again.run());
  const std::vector<Seen> before = live.of("out"), after = again.of("out");
  fail_unless_equals_int(after.size(), 12);
  double error = 0, colours = 0;
  for (std::size_t i = 0; i < 12; ++i) {
    const polyhull::View was = polyhull::read_view(bytes_of(before[i]));
    const polyhull::View is = polyhull::read_view(bytes_of(after[i]));
    fail_unless(was.contours.points == is.contours.points);
    fail_unless_equals_int(was.pixels.size(), is.pixels.size());
    for (std::size_t p = 0; p < was.pixels.size(); ++p) {
      const int less = was.pixels[p] - is.pixels[p];
      if (p % 4 == 3) {
        fail_unless(std::abs(less) <= 4);
      } else {
        error += less * less;
        ++colours;
      }
    }
  }
  const double psnr = 10 * std::log10(65025 * colours / error);
  const double said = figure(named(live.pipeline, "t"), "picture-psnr");
  fail_unless(std::abs(psnr - said) < 1e-6, "%f dB, %f said", psnr, said);
  fail_unless(psnr > 30);
  fail_unless(statistic(named(live.pipeline, "t"), "bytes-stored") <
              statistic(named(live.pipeline, "t"), "bytes") / 10);
}

ELEMENT_TEST(test_lossy_meshes_move_as_far_as_said) {
  const Folder folder;
  std::string line = "takesink name=t compression=lossy precision=2 location=" + take_in(folder) +
                     " hullbuild name=h ! tee name=m ! queue ! t.sink_0 m. ! queue ! "
                     "fakesink name=out sync=false ";
  for (const char* name : {"0", "1", "2"})
    line += std::string("rigtestsrc camera=cam") + name +
            " num-buffers=3 ! video/x-raw,framerate=25/1 ! silhouette camera=cam" + name +
            " ! queue ! h. ";
  Played live(line);
  check_ended(live.run());
  Played again(play(folder));
  check_ended(again.run());
  const std::vector<Seen> before = live.of("out"), after = again.of("out");
  fail_unless_equals_int(after.size(), 3);
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const polyhull::Mesh was = polyhull::read_mesh(bytes_of(before[i]));
    const polyhull::Mesh is = polyhull::read_mesh(bytes_of(after[i]));
    fail_unless(was.hull.triangles == is.hull.triangles);
    for (std::size_t v = 0; v < was.hull.vertices.size(); ++v)
      most = std::max(most, 1000 * was.metres_per_unit *
                                glm::length(polyhull::Vec3(was.hull.vertices[v]) -
                                            polyhull::Vec3(is.hull.vertices[v])));
  }
  fail_unless(most > 1 && most <= 2.001, "%f mm", most);
  const double said = figure(named(live.pipeline, "t"), "vertex-error-mm");
  fail_unless(std::abs(most - said) < 1e-6, "%f mm, %f said", most, said);
}

// Any place, in both directions, also while other places are being looked for.
ELEMENT_TEST(test_any_place_is_found) {
  const Folder folder;
  constexpr GstClockTime frame = 40 * GST_MSECOND;
  Played live(camera(folder, 40, "compression=exact key-interval=7"));
  check_ended(live.run());
  Played again(play(folder));
  again.pause();
  for (const int from : {33, 6, 7, 0, 20})
    for (const double rate : {1.0, -1.0}) {
      again.clear();
      fail_unless(
          gst_element_seek(again.pipeline, rate, GST_FORMAT_TIME,
                           static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
                           GST_SEEK_TYPE_SET, static_cast<gint64>(from * frame), GST_SEEK_TYPE_SET,
                           static_cast<gint64>((from + 6) * frame)));
      check_ended(again.run());
      fail_unless_equals_int(again.of("out").size(), 6);
      for (int i = 0; i < 6; ++i)
        fail_unless(
            again.of("out")[static_cast<std::size_t>(i)] ==
                live.of("out")[static_cast<std::size_t>(rate > 0 ? from + i : from + 5 - i)],
            "%d at rate %f", from + i, rate);
      gst_element_set_state(again.pipeline, GST_STATE_PAUSED);
    }
}

// Raw video of any kind, added to, with the settings changed while it runs.
ELEMENT_TEST(test_settings_change_while_it_plays) {
  const Folder folder;
  std::vector<Seen> all;
  for (const char* existing : {"refuse", "append"}) {
    Played live(
        "takesink name=t location=" + take_in(folder) + " existing=" + existing +
        " videotestsrc num-buffers=60 ! "
        "video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1 ! identity "
        "sleep-time=1000 ! tee name=v ! queue ! t. v. ! queue ! fakesink name=out sync=false");
    gst_element_set_state(live.pipeline, GST_STATE_PLAYING);
    GstElement* sink = named(live.pipeline, "t");
    for (int i = 0; i < 12; ++i) {
      g_object_set(sink, "compression", i % 3, "key-interval", 1 + i, "quantizer", 5 * i, nullptr);
      g_usleep(5000);
    }
    check_ended(wait_for_end(live.pipeline));
    for (const Seen& seen : live.of("out")) all.push_back(seen);
  }
  Played again(play(folder));
  check_ended(again.run());
  fail_unless_equals_int(again.of("out").size(), 120);
  for (std::size_t i = 0; i < all.size(); ++i)
    fail_unless(again.of("out")[i].bytes == all[i].bytes, "buffer %zu", i);
}

ELEMENT_TEST(test_damage_is_said_and_ends_at_the_next_key) {
  const Folder folder;
  Played live(camera(folder, 40, "compression=exact key-interval=5"));
  check_ended(live.run());
  {
    std::fstream file(take_in(folder), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(take_in(folder)) / 2));
    file << std::string(100, 'x');
  }
  Played rest("takesrc name=t location=" + take_in(folder) + " ! fakesink name=out sync=false");
  check_ended(rest.run());
  const guint64 damaged = statistic(named(rest.pipeline, "t"), "packets-damaged");
  fail_unless(damaged >= 1 && damaged <= 5, "%" G_GUINT64_FORMAT, damaged);
  fail_unless_equals_uint64(rest.of("out").size() + damaged, 40);
  for (const Seen& seen : rest.of("out"))
    fail_unless(seen == live.of("out")[static_cast<std::size_t>(seen.time / (40 * GST_MSECOND))]);
}

ELEMENT_TEST(test_states) {
  const Folder folder;
  check_states(camera(folder, 100, "compression=lossy existing=replace"), 10);
}

// Views are no use without the rig that saw them.
ELEMENT_TEST(test_another_rig_is_refused) {
  const Folder folder;
  std::ofstream(folder.file("a.json")) << "{ \"a\": 1 }";
  std::ofstream(folder.file("b.json")) << "{ \"b\": 1 }";
  const std::string begin = "videotestsrc num-buffers=3 ! takesink location=" + take_in(folder) +
                            " existing=append rig=" + folder.path;
  check_ended(run_to_end(begin + "/a.json"));
  check_ended(run_to_end(begin + "/a.json"));
  const std::string end = run_to_end(begin + "/b.json");
  fail_unless(end.find("another rig") != std::string::npos, "%s", end.c_str());
  Played again(play(folder));
  check_ended(again.run());
  fail_unless_equals_int(again.of("out").size(), 6);
}

/// Much of it as before, and too much new for one page of the file.
GstBuffer* changing(unsigned pad, unsigned number) {
  std::string bytes(6000, static_cast<char>(pad));
  std::minstd_rand random(1 + 1000 * pad + number);
  for (std::size_t i = 0; i < 4000; ++i) bytes[i] = static_cast<char>(random() >> 8);
  GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
  GST_BUFFER_PTS(buffer) = number * 40 * GST_MSECOND;
  return buffer;
}

// The instant that the disk has no room for is gone, of all pads; those that did not fail go on.
ELEMENT_TEST(test_the_other_pads_outlive_a_full_disk) {
  const Folder folder;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 640'000;
  GstElement* take = gst_element_factory_make("takesink", nullptr);
  g_object_set(take, "location", take_in(folder).c_str(), nullptr);
  gst_util_set_object_arg(G_OBJECT(take), "compression", "exact");
  GstHarness* first = gst_harness_new_with_element(take, "sink_0", nullptr);
  GstHarness* other = gst_harness_new_with_element(take, "sink_1", nullptr);
  for (GstHarness* harness : {first, other})
    gst_harness_set_src_caps_str(harness, "application/x-test");
  setrlimit(RLIMIT_FSIZE, &small);
  unsigned number = 0;
  while (number < 1000 && gst_harness_push(first, changing(0, number)) == GST_FLOW_OK) {
    fail_unless_equals_int(gst_harness_push(other, changing(1, number)), GST_FLOW_OK);
    ++number;
  }
  fail_unless(number > 10 && number < 1000 && number % 8 != 1, "%u", number);
  setrlimit(RLIMIT_FSIZE, &before);
  const unsigned end = number + 20;
  for (unsigned i = number; i < end; ++i)
    fail_unless_equals_int(gst_harness_push(other, changing(1, i)), GST_FLOW_OK);
  gst_element_set_state(take, GST_STATE_NULL);
  gst_harness_teardown(first);
  gst_harness_teardown(other);
  gst_object_unref(take);
  polyhull::TakeCursor cursor(take_in(folder), 2);
  for (unsigned i = 0; i < end; ++i) {
    if (i == number - 1) continue;
    const auto packet = cursor.next();
    fail_unless(packet.has_value());
    GstBuffer* truth = changing(1, i);
    fail_unless_equals_uint64(static_cast<guint64>(packet->time), GST_BUFFER_PTS(truth));
    fail_unless(gst_buffer_memcmp(truth, 0, packet->data.data(), packet->data.size()) == 0);
    gst_buffer_unref(truth);
  }
  fail_unless(!cursor.next() && cursor.damaged() == 0);
}
