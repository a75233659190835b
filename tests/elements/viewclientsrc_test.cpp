// SPDX-License-Identifier: LGPL-2.1-or-later
// viewclientsrc before real connections: what gdppay sends, and what only somebody else would.
#include "support/sender.h"

#include <glib/gstdio.h>
#include <atomic>
#include <memory>

#include "element_checks.h"
#include "gdp_stream.h"
#include "support/folder.h"
#include "view_client.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr char views[] =
    "rigtestsrc camera=cam0 num-buffers=6 ! silhouette "
    "camera=cam0";

const GdpStream& recorded() {
  static const GdpStream stream = record_before_checks(views);
  return stream;
}
const bool is_recorded = before_cases([] { recorded(); });

void expect_frames(Client& client, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i)
    fail_unless(client.next() == recorded().payloads[i], "frame %zu differs", i);
}

/// The first connection brings \p bad, later ones the recorded stream: \p counter tells, a warning has
/// \p words, and the stream that comes then is whole.
void check_refused(const Packet& bad, const char* counter, const char* words,
                   const std::string& properties = "max-age=0") {
  const Sender sender([&](int number, Accepted& accepted) {
    accepted.send(number == 0 ? bad : recorded().bytes());
    if (number == 0) accepted.wait_for_cut();
  });
  Client client(sender.port(), properties + " end-with-sender=true");
  expect_frames(client, 0, recorded().payloads.size());
  fail_unless(client.next().empty());
  fail_unless_equals_uint64(statistic(client.source, counter), 1);
  fail_unless_equals_uint64(statistic(client.source, "cuts"), 1);
  fail_unless_equals_uint64(statistic(client.source, "connections"), 2);
  client.expect_warning(words);
}

Packet with_byte(Packet packet, std::size_t at, std::uint8_t value) {
  packet.at(at) = value;
  return packet;
}

Packet joined(Packet first, const Packet& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

/// The recorded stream's head and first frame's packet, without header's checksum and changed.
Packet forged(std::size_t at, std::uint8_t value) {
  const Packet& frame = recorded().packets[recorded().frames[0]];
  return joined(recorded().head(), with_byte(with_byte(frame, 2, 0), at, value));
}

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("viewclientsrc");
}

ELEMENT_TEST(test_same_bytes) {
  const std::string packed = std::string(views) + " ! viewencode coding=zstd";
  const std::pair<std::string, const char*> senders[] = {
      {views, ""}, {views, "crc-payload=true"}, {views, "crc-header=false"}, {packed, ""}};
  for (const auto& [source, payer] : senders) {
    const GdpStream stream = record_stream(source, payer);
    const Sender sender([&](int, Accepted& accepted) {
      // In pieces that end anywhere.
      const Packet all = stream.bytes();
      for (std::size_t at = 0; at < all.size(); at += 1013)
        accepted.send(Bytes(all).subspan(at, std::min<std::size_t>(1013, all.size() - at)));
    });
    Client client(sender.port(), "max-age=0 end-with-sender=true");
    for (std::size_t i = 0; i < stream.payloads.size(); ++i) {
      fail_unless(client.next() == stream.payloads[i], "frame %zu differs", i);
      fail_unless_equals_uint64(client.time,
                                read_packet_header(stream.packets[stream.frames[i]]).time);
    }
    fail_unless(client.next().empty());
    fail_unless_equals_uint64(statistic(client.source, "bytes"), stream.bytes().size());
    fail_unless_equals_uint64(statistic(client.source, "ends-of-sender"), 1);
  }
}

ELEMENT_TEST(test_cut_and_back) {
  const Packet head = recorded().head();
  const auto frame = [](std::size_t i) { return recorded().packets[recorded().frames[i]]; };
  const Sender sender([&](int number, Accepted& accepted) {
    if (number == 0) {
      accepted.send(joined(head, frame(0)));
      const Packet half = frame(1);
      accepted.send(Bytes(half).first(half.size() / 2));  // and the end
    } else if (number == 1) {
      accepted.send(Bytes(head).first(10));
    } else {
      accepted.send(joined(head, joined(frame(2), frame(3))));
      accepted.wait_for_cut();
    }
  });
  Client client(sender.port());
  expect_frames(client, 0, 1);
  expect_frames(client, 2, 4);
  fail_unless_equals_uint64(statistic(client.source, "cuts"), 2);
  fail_unless_equals_uint64(statistic(client.source, "frames"), 3);
  // Lost is said once, then the return.
  GstBus* bus = client.bus;
  std::vector<gboolean> connected;
  while (GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ELEMENT)) {
    gboolean value = FALSE;
    const GstStructure* structure = gst_message_get_structure(message);
    fail_unless(gst_structure_has_name(structure, "polyhull-link"));
    fail_unless(gst_structure_get_boolean(structure, "connected", &value));
    connected.push_back(value);
    gst_message_unref(message);
  }
  fail_unless_equals_uint64(connected.size(), 2);
  fail_unless(!connected[0] && connected[1]);
}

ELEMENT_TEST(test_refused) {
  check_refused(Packet(200, 'x'), "refused-packets", "data protocol 1.0");
  check_refused(with_byte(recorded().bytes(), 7, 1), "refused-packets", "checksum is wrong");
  check_refused(forged(5, 7), "refused-packets", "of kind 7");
  check_refused(forged(10, 0x7f), "refused-packets", "after the year 2065");
  check_refused(forged(6, 0x7f), "refused-sizes", "bytes, and 67108864 are allowed by max-packet");
  // A limit is live.
  const Sender sender([](int, Accepted& accepted) {
    accepted.send(recorded().bytes());
    accepted.wait_for_cut();
  });
  Client client(sender.port(), "max-age=0 max-packet=1024");
  client.wait_for("refused-sizes", 2);
  g_object_set(client.source, "max-packet", guint64{1 << 24}, nullptr);
  expect_frames(client, 0, 6);
}

ELEMENT_TEST(test_refused_formats) {
  const GdpStream video =
      record_stream("videotestsrc num-buffers=2 ! video/x-raw,width=32,height=16");
  check_refused(video.bytes(), "refused-formats", "neither views nor meshes");
  check_refused(recorded().packets[recorded().frames[0]], "refused-formats", "before its format");
}

// GStreamer keeps each name that it reads for good: those of strangers are not given to it.
ELEMENT_TEST(test_names_of_strangers) {
  const std::string good = "framerate=(fraction)25/1", bad = "never-met=(string)abcdef";
  Packet bytes = recorded().bytes();
  const auto at = std::search(bytes.begin(), bytes.end(), good.begin(), good.end());
  fail_if(at == bytes.end() || good.size() != bad.size());
  std::copy(bad.begin(), bad.end(), at);
  check_refused(bytes, "refused-formats", "neither views nor meshes");
  fail_unless(g_quark_try_string("never-met") == 0);
}

// What is no frame in a packet that is one is dropped, and the connection stays.
ELEMENT_TEST(test_forged_frames) {
  const Sender sender([&](int, Accepted& accepted) {
    accepted.send(recorded().head());
    Packet frame = recorded().packets[recorded().frames[0]];
    for (std::size_t at = packet_header_size; at < packet_header_size + 32; ++at) frame[at] ^= 0x55;
    accepted.send(frame);
    accepted.send(recorded().packets[recorded().frames[1]]);
    accepted.wait_for_cut();
  });
  Client client(sender.port());
  expect_frames(client, 1, 2);
  fail_unless_equals_uint64(statistic(client.source, "refused-frames"), 1);
  fail_unless_equals_uint64(statistic(client.source, "cuts"), 0);
  client.expect_warning("is dropped");
}

/// The head, then \p view's packet, then a frame that is let through: the view is refused, with
/// \p words, and the connection stays.
void check_frame_refused(const View& view, const std::string& properties, const char* words) {
  const Packet payload = write_view(view);
  const Packet& frame = recorded().packets[recorded().frames[0]];
  Packet packet = with_byte(Packet(frame.begin(), frame.begin() + packet_header_size), 2, 0);
  for (int i = 0; i < 4; ++i)
    packet[6 + i] = static_cast<std::uint8_t>(payload.size() >> (24 - 8 * i));
  packet = joined(packet, payload);
  const Sender sender([&](int, Accepted& accepted) {
    accepted.send(recorded().head());
    accepted.send(packet);
    accepted.send(recorded().packets[recorded().frames[1]]);
    accepted.wait_for_cut();
  });
  Client client(sender.port(), "max-age=0 " + properties);
  expect_frames(client, 1, 2);
  fail_unless_equals_uint64(statistic(client.source, "refused-frames"), 1);
  fail_unless_equals_uint64(statistic(client.source, "cuts"), 0);
  client.expect_warning(words);
}

// What would cost those that follow their time or memory, or is another camera's, is dropped here.
ELEMENT_TEST(test_limits_of_frames) {
  const ReadView first{recorded().payloads[0], {}};
  View other = read_view(Bytes(first.bytes));
  other.camera = "cam1";
  check_frame_refused(other, "camera=cam0", "of camera 'cam1', and expected is 'cam0'");
  View comb = read_view(Bytes(first.bytes));
  comb.contours = {};
  for (int i = 0; i < 30'000; ++i)
    comb.contours.points.emplace_back(static_cast<float>(i % 1000), i % 2 ? 700.0f : 10.0f);
  comb.contours.ends = {30'000};
  check_frame_refused(comb, "", "30000 vertices, and 10000 are allowed by max-vertices");
  View large = read_view(Bytes(first.bytes));
  std::vector<std::uint8_t> pixels(4 * 512 * 512);
  large.roi = {0, 0, 512, 512};
  large.format = PixelFormat::rgba;
  large.stride = 4 * 512;
  large.pixels = pixels;
  check_frame_refused(large, "max-unpacked=1000000",
                      "pixels are 1048576 bytes, and 1000000 are allowed by max-unpacked");
}

// Packed pixels count as what becomes of them.
ELEMENT_TEST(test_limit_of_packed_pixels) {
  const GdpStream packed = record_stream(std::string(views) + " ! viewencode coding=zstd");
  const Sender sender([&](int, Accepted& accepted) {
    accepted.send(packed.bytes());
    accepted.wait_for_cut();
  });
  const std::string most = std::to_string(packed.payloads[0].size() + 1000);
  Client client(sender.port(), "max-age=0 max-unpacked=" + most);
  client.wait_for("refused-frames", packed.frames.size());
  fail_unless_equals_uint64(statistic(client.source, "frames"), 0);
}

// Meshes where views are wanted are refused here, before what takes views ends the stream.
ELEMENT_TEST(test_meshes_where_views_are_wanted) {
  const std::string words = "x-polyhull-mesh";
  Packet head = recorded().head();
  const std::string view = "x-polyhull-view";
  const auto at = std::search(head.begin(), head.end(), view.begin(), view.end());
  fail_if(at == head.end());
  std::copy(words.begin(), words.end(), at);
  // The caps packet's checksum is that of the header alone.
  const Sender sender([&](int number, Accepted& accepted) {
    accepted.send(number == 0 ? head : recorded().bytes());
    accepted.wait_for_cut();
  });
  GstElement* pipeline =
      parse("viewclientsrc name=client retry=20000000 timeout=20000000000 max-age=0 port=" +
            std::to_string(sender.port()) + " ! queue ! viewdecode ! appsink name=sink sync=false");
  GstElement* source = named(pipeline, "client");
  GstBus* bus = gst_element_get_bus(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  wait_for_statistic(source, "frames", recorded().frames.size());
  fail_unless_equals_uint64(statistic(source, "refused-formats"), 1);
  expect_warning(bus, "it brings application/x-polyhull-mesh");
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
}

// Packets without end are cut off, by their number and by their bytes.
ELEMENT_TEST(test_floods) {
  const Packet head = recorded().head();
  std::atomic<bool> flood = true;
  const auto script = [&](const Packet& packet) {
    return [&, packet](int, Accepted& accepted) {
      accepted.send(head);
      while (flood && accepted.send(packet)) {
      }
      if (!flood) accepted.send(recorded().packets[recorded().frames[3]]);
      accepted.wait_for_cut();
    };
  };
  Packet many;
  for (int i = 0; i < 5000; ++i) many = joined(std::move(many), recorded().packets[0]);
  {
    const Sender sender(script(many));
    Client client(sender.port());
    client.wait_for("refused-rates", 2);
    client.expect_warning("packets a second");
    flood = false;
    expect_frames(client, 3, 4);
  }
  flood = true;
  const Packet& frame = recorded().packets[recorded().frames[0]];
  const Sender sender(script(frame));
  Client client(sender.port(), "max-age=0 max-rate=" + std::to_string(20 * frame.size()));
  g_object_set(client.sink, "drop", TRUE, "max-buffers", 1, nullptr);
  client.wait_for("refused-rates", 2);
}

// Who connects and says nothing is left, as is who says too little.
ELEMENT_TEST(test_half_open) {
  recorded();
  const Sender sender([&](int number, Accepted& accepted) {
    if (number == 1) accepted.send(Bytes(recorded().packets[0]).first(30));
    if (number >= 2) accepted.send(recorded().bytes());
    accepted.wait_for_cut();
  });
  // Silence has been waited for already: retry adds nothing to it.
  Client client(sender.port(), "max-age=0 timeout=100000000 retry=1000000000000");
  client.wait_for("silences", 2);
  expect_frames(client, 0, 6);
  client.expect_warning("no whole frame came for 100 ms");
}

ELEMENT_TEST(test_nobody_answers) {
  int port = 0;
  {
    const Sender gone([](int, Accepted&) {});
    port = gone.port();
  }
  Client client(port);
  client.wait_for("connections-failed", 3);
  fail_unless_equals_uint64(warnings_on(client.bus).size(), 1);
  // Live changes reach the next attempt.
  g_object_set(client.source, "retry", guint64{1000000}, nullptr);
  const guint64 before = statistic(client.source, "connections-failed");
  client.wait_for("connections-failed", before + 50);
}

// Frames by the pipeline's own clock: fresh ones pass, old ones are dropped, those of another clock pass.
ELEMENT_TEST(test_age) {
  const Packet frame = recorded().packets[recorded().frames[0]];
  const ReadView first{recorded().payloads[0], {}};
  const View view = read_view(Bytes(first.bytes));
  fail_unless(view.clock == CaptureClock::arrival);
  const auto aged = [&](gint64 age) {
    GstClock* clock = gst_system_clock_obtain();
    View changed = view;
    changed.capture_time = static_cast<gint64>(gst_clock_get_time(clock)) - age;
    gst_object_unref(clock);
    const Packet payload = write_view(changed);
    Packet packet = with_byte(Packet(frame.begin(), frame.begin() + packet_header_size), 2, 0);
    for (int i = 0; i < 4; ++i)
      packet[6 + i] = static_cast<std::uint8_t>(payload.size() >> (24 - 8 * i));
    return joined(packet, payload);
  };
  const Sender sender([&](int, Accepted& accepted) {
    accepted.send(recorded().head());
    accepted.send(aged(40 * GST_SECOND));
    accepted.send(aged(0));
    accepted.send(aged(31 * GST_SECOND));
    accepted.send(aged(90 * GST_SECOND));  // no more: the clock may have begun minutes ago
    accepted.send(aged(-90 * static_cast<gint64>(GST_SECOND)));
    accepted.wait_for_cut();
  });
  Client client(sender.port(), "max-age=30000000000");
  const auto seconds_ago = [&] {
    const Packet bytes = client.next();
    GstClock* clock = gst_system_clock_obtain();
    const gint64 now = static_cast<gint64>(gst_clock_get_time(clock));
    gst_object_unref(clock);
    return (now - read_view(Bytes(bytes)).capture_time) / static_cast<gint64>(GST_SECOND);
  };
  fail_unless(seconds_ago() < 30);
  fail_unless(seconds_ago() >= 90);
  fail_unless(seconds_ago() <= -30);
  fail_unless_equals_uint64(statistic(client.source, "frames-stale"), 2);
  fail_unless_equals_uint64(statistic(client.source, "frames-of-another-clock"), 2);
  client.expect_warning("different ones");
}

// Meshes, too; and the hull over three wires is the hull in one process, byte for byte.
ELEMENT_TEST(test_hull_over_the_wire) {
  constexpr int cameras = 4;
  const Folder folder;
  const auto file = [&](int camera) { return folder.file(std::to_string(camera) + ".gdp"); };
  std::string process = "hullbuild name=h ";
  for (int i = 0; i < cameras; ++i) {
    const std::string n = std::to_string(i);
    process += "rigtestsrc num-buffers=4 camera=cam" + n + " ! silhouette camera=cam" + n +
               " ! tee name=v" + n + " v" + n +
               ". ! queue ! gdppay ! filesink location=" + file(i) + " v" + n + ". ! queue ! h. ";
  }
  const GdpStream here = record_stream(process + "h.");
  std::vector<std::unique_ptr<Sender>> senders;
  // Live as it is, but nothing is given up for its lateness, and no connection that a slow machine
  // leaves silent is cut: the recording that comes again then has old times.
  std::string wire = "hullbuild name=h max-wait=20000000000 ";
  for (int i = 0; i < cameras; ++i) {
    gchar* content = nullptr;
    gsize size = 0;
    fail_unless(g_file_get_contents(file(i).c_str(), &content, &size, nullptr));
    const Packet bytes(content, content + size);
    g_free(content);
    senders.push_back(
        std::make_unique<Sender>([bytes](int, Accepted& accepted) { accepted.send(bytes); }));
    wire += "viewclientsrc max-age=0 timeout=100000000000 end-with-sender=true port=" +
            std::to_string(senders.back()->port()) + " ! queue ! h. ";
  }
  const GdpStream there = record_stream(wire + "h.");
  fail_unless_equals_uint64(here.payloads.size(), 4);
  // A live hullbuild may give up sets on a busy machine; what it makes is the same, in order.
  fail_if(there.payloads.empty());
  std::size_t at = 0;
  for (const Packet& hull : there.payloads) {
    while (at < here.payloads.size() && here.payloads[at] != hull) ++at;
    fail_if(at == here.payloads.size(), "a hull over the wire is none of those in one process");
    ++at;
  }
  const Sender meshes([&](int, Accepted& accepted) { accepted.send(here.bytes()); });
  Client client(meshes.port(), "max-age=0 timeout=100000000000 end-with-sender=true");
  for (std::size_t i = 0; i < 4; ++i)
    fail_unless(client.next() == here.payloads[i], "hull %zu differs after its own wire", i);
  fail_unless(client.next().empty());
}

// Events come, frames do not.
ELEMENT_TEST(test_events_are_no_frames) {
  const Sender sender([&](int number, Accepted& accepted) {
    if (number > 0) {
      accepted.send(recorded().bytes());
      return;
    }
    while (accepted.send(recorded().head())) g_usleep(50000);
  });
  Client client(sender.port(), "max-age=0 timeout=500000000 end-with-sender=true");
  client.wait_for("silences", 1);
  g_object_set(client.source, "timeout", 100 * GST_SECOND, nullptr);
  expect_frames(client, 0, recorded().payloads.size());
}

// Whatever it waits for, the states change at once.
ELEMENT_TEST(test_states) {
  const Sender silent([](int, Accepted& accepted) { accepted.wait_for_cut(); });
  const std::string end = " timeout=1000000000000 retry=1000000000000 ! fakesink async=false";
  check_states("viewclientsrc port=" + std::to_string(silent.port()) + end);
  check_states("viewclientsrc port=1" + end);
  const Sender sender([&](int, Accepted& accepted) {
    accepted.send(recorded().bytes());
    accepted.wait_for_cut();
  });
  check_states("viewclientsrc max-age=0 port=" + std::to_string(sender.port()) +
               " retry=1000000 ! fakesink");
}

ELEMENT_TEST(test_pause) {
  std::atomic<std::size_t> wanted = 1;
  const Sender sender([&](int, Accepted& accepted) {
    accepted.send(recorded().head());
    for (std::size_t i = 0; i < 6; ++i) {
      while (wanted <= i) g_usleep(1000);
      accepted.send(recorded().packets[recorded().frames[i]]);
    }
    accepted.wait_for_cut();
  });
  Client client(sender.port());
  for (std::size_t i = 0; i < 6; ++i) {
    expect_frames(client, i, i + 1);
    gst_element_set_state(client.pipeline, GST_STATE_PAUSED);
    gst_element_set_state(client.pipeline, GST_STATE_PLAYING);
    wanted = i + 2;
  }
}

ELEMENT_TEST(test_bad_settings) {
  const auto refusal = [](const std::string& properties) {
    GstElement* pipeline = parse("viewclientsrc " + properties + " ! fakesink");
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_PLAYING),
                           GST_STATE_CHANGE_FAILURE);
    const std::string text = wait_for_end(pipeline, GST_SECOND);
    stop(pipeline);
    return text;
  };
  fail_unless(refusal("host=\"\"").find("host is empty") != std::string::npos);
  fail_unless(refusal("settings=" + std::string(4001, 'x')).find("4001 bytes") !=
              std::string::npos);
}

ELEMENT_TEST(test_latency) {
  const Sender silent([](int, Accepted& accepted) { accepted.wait_for_cut(); });
  Client client(silent.port(), "latency=30000000");
  GstQuery* query = gst_query_new_latency();
  gboolean live = FALSE;
  GstClockTime least = 0;
  fail_unless(gst_element_query(client.source, query));
  gst_query_parse_latency(query, &live, &least, nullptr);
  fail_unless(live && least == 30 * GST_MSECOND);
  gst_query_unref(query);
}
