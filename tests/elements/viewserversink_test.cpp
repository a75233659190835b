// SPDX-License-Identifier: LGPL-2.1-or-later
// viewserversink before clients that may have its views, and before those that may not.
#include "support/sender.h"

#include <gio/gio.h>
#include <glib/gstdio.h>
#include <gst/app/gstappsrc.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "element_checks.h"
#include "gdp_stream.h"
#include "support/folder.h"
#include "support/run_kind.h"
#include "view_client.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr std::size_t frames = 6;

const GdpStream& recorded() {
  static const GdpStream stream =
      record_before_checks("rigtestsrc camera=cam0 num-buffers=6 ! silhouette camera=cam0");
  return stream;
}
const bool is_recorded = before_cases([] { recorded(); });

/// A pipeline that serves the recorded views, one when the test says so.
struct Server {
  explicit Server(const std::string& properties = "")
      : pipeline(parse("appsrc name=in format=time caps=application/x-polyhull-view ! gdppay ! "
                       "viewserversink name=server host=127.0.0.1 port=0 "
                       // Here slow clients are those that a test wants slow.
                       "buffers-max=10000 timeout=60000000000 " +
                       properties)),
        in(gst_bin_get_by_name(GST_BIN(pipeline), "in")),
        sink(gst_bin_get_by_name(GST_BIN(pipeline), "server")),
        bus(gst_element_get_bus(pipeline)) {
    fail_if(gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
    // The stream's head is there with the first frame.
    push();
    wait_for("packets", 4);
  }
  ~Server() {
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_NULL),
                           GST_STATE_CHANGE_SUCCESS);
    gst_object_unref(bus);
    gst_object_unref(sink);
    gst_object_unref(in);
    gst_object_unref(pipeline);
  }
  int port() const { return static_cast<int>(statistic(sink, "port")); }
  /// Serves the next frame.
  void push() {
    const Packet& bytes = recorded().payloads[pushed % frames];
    GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
    GST_BUFFER_PTS(buffer) = 40 * GST_MSECOND * pushed++;
    fail_unless_equals_int(gst_app_src_push_buffer(GST_APP_SRC(in), buffer), GST_FLOW_OK);
  }
  void wait_for(const char* counter, guint64 value) const {
    wait_for_statistic(sink, counter, value);
  }
  /// The same, with a frame now and then, of which the server learns who is gone.
  void push_until(const char* counter, guint64 value) {
    for (int i = 0; i < 6000 && statistic(sink, counter) < value; ++i) {
      push();
      g_usleep(10000);
    }
    wait_for(counter, value);
  }
  void expect_warning(const char* text) const { test::expect_warning(bus, text); }
  GstElement *pipeline, *in, *sink;
  GstBus* bus;
  std::size_t pushed = 0;
};

/// Serves a frame and waits until \p client has it, whatever it gets before.
void catch_up(Server& server, Client& client) {
  server.push();
  do {
    fail_if(client.next().empty());
  } while (client.time != 40 * GST_MSECOND * (server.pushed - 1));
}

/// Serves frames until \p client is served; from then on it has each.
void meet(Server& server, Client& client) {
  server.push_until("clients-now", 1);
  catch_up(server, client);
}

/// Frame by frame, the same bytes and none left out.
void expect_frames(Server& server, Client& client, int count) {
  for (int i = 0; i < count; ++i) {
    server.push();
    fail_unless(client.next() == recorded().payloads[(server.pushed - 1) % frames], "frame %d: %s",
                i, statistics_text(server.sink).c_str());
  }
}

/// A client that does nothing by itself.
class RawClient {
 public:
  /// \p from is its own address.
  explicit RawClient(int port, const char* from = "127.0.0.1") {
    GSocketClient* client = g_socket_client_new();
    GSocketAddress* address = g_inet_socket_address_new_from_string(from, 0);
    g_socket_client_set_local_address(client, address);
    g_object_unref(address);
    connection_ = G_IO_STREAM(g_socket_client_connect_to_host(
        client, "127.0.0.1", static_cast<guint16>(port), nullptr, nullptr));
    g_object_unref(client);
    fail_if(connection_ == nullptr);
  }
  ~RawClient() {
    // Without a goodbye.
    g_socket_close(g_socket_connection_get_socket(G_SOCKET_CONNECTION(connection_)), nullptr);
    g_clear_object(&secured_);
    g_object_unref(connection_);
  }
  RawClient(const RawClient&) = delete;
  /// Proves who it is, by \p keys as Keys::of() has them.
  void prove(const std::string& keys) {
    const std::size_t begin = keys.find('=') + 1;
    const std::string file = keys.substr(begin, keys.find(' ', begin) - begin);
    GError* error = nullptr;
    GTlsCertificate* certificate = g_tls_certificate_new_from_file(file.c_str(), &error);
    secured_ = g_tls_client_connection_new(connection_, nullptr, &error);
    fail_if(error != nullptr, "%s", error != nullptr ? error->message : "");
    g_tls_connection_set_certificate(G_TLS_CONNECTION(secured_), certificate);
    g_object_unref(certificate);
    const auto accept = +[](GTlsConnection*, GTlsCertificate*, GTlsCertificateFlags,
                            gpointer) -> gboolean { return TRUE; };
    g_signal_connect(secured_, "accept-certificate", G_CALLBACK(accept), nullptr);
    if (!g_tls_connection_handshake(G_TLS_CONNECTION(secured_), nullptr, &error))
      ck_abort_msg("%s", error->message);
  }
  /// How many bytes come until the server ends it.
  std::size_t read_all() {
    std::vector<char> bytes(1 << 20);
    std::size_t sum = 0;
    while (true) {
      const gssize count = g_input_stream_read(g_io_stream_get_input_stream(connection_),
                                               bytes.data(), bytes.size(), nullptr, nullptr);
      if (count <= 0) return sum;
      sum += static_cast<std::size_t>(count);
    }
  }
  /// Whether the server has ended it, or has said anything.
  bool is_cut() const {
    GSocket* socket = g_socket_connection_get_socket(G_SOCKET_CONNECTION(connection_));
    return g_socket_condition_check(socket, static_cast<GIOCondition>(G_IO_IN | G_IO_HUP)) != 0;
  }
  void write(const std::string& text) {
    GIOStream* stream = secured_ != nullptr ? secured_ : connection_;
    g_output_stream_write_all(g_io_stream_get_output_stream(stream), text.data(), text.size(),
                              nullptr, nullptr, nullptr);
  }

 private:
  GIOStream* connection_;
  GIOStream* secured_ = nullptr;
};

/// Keys of two authorities, made once: `here`, with machines "left", "right", "server" and two
/// addresses, and `there`, with "stranger".
class Keys {
 public:
  Keys() {
    run(script() + " " + folder_.file("here") + " left right server 10.0.0.8 10.0.0.9");
    run(script() + " " + folder_.file("there") + " stranger");
  }

  /// Properties that say who a machine is and whom it trusts.
  static std::string of(const std::string& machine, const std::string& who = "here",
                        const std::string& trusted = "here") {
    static const Keys keys;
    return " tls-certificate=" + keys.folder_.file(who) + "/" + machine +
           ".pem tls-authority=" + keys.folder_.file(trusted) + "/authority.pem ";
  }
  /// What a client needs beside.
  static std::string client(const std::string& properties) {
    return "max-age=0 tls-name=left " + properties;
  }

 private:
  static std::string script() {
    const char* source = g_getenv("POLYHULL_SOURCE");
    fail_if(source == nullptr, "POLYHULL_SOURCE is not set: the test needs its pipelines folder");
    return std::string(source) + "/pipelines/make-keys.sh";
  }
  static void run(const std::string& line) {
    gint status = 0;
    fail_unless(
        g_spawn_command_line_sync(line.c_str(), nullptr, nullptr, &status, nullptr) && status == 0,
        "%s", line.c_str());
  }
  Folder folder_;
};

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("viewserversink");
}

ELEMENT_TEST(test_same_bytes_for_two) {
  Server server;
  Client one(server.port());
  meet(server, one);
  Client two(server.port());
  server.push_until("clients-now", 2);
  catch_up(server, two);
  while (one.time != two.time) one.next();
  for (int i = 0; i < 12; ++i) {
    server.push();
    const Packet& frame = recorded().payloads[(server.pushed - 1) % frames];
    fail_unless(one.next() == frame && two.next() == frame, "frame %d", i);
  }
  fail_unless_equals_uint64(statistic(server.sink, "clients"), 2);
  fail_unless(statistic(server.sink, "bytes") > 0);
  fail_unless_equals_uint64(statistic(one.source, "connections"), 1);
}

// Whoever comes gets the stream's head before any frame, however soon its thread runs.
ELEMENT_TEST(test_head_first) {
  Server server;
  for (int i = 0; i < 40; ++i) {
    Client client(server.port());
    meet(server, client);
    fail_unless_equals_uint64(statistic(client.source, "connections"), 1);
    fail_unless_equals_uint64(statistic(client.source, "cuts"), 0);
    gst_element_set_state(client.pipeline, GST_STATE_NULL);
    server.push_until("clients-closed", static_cast<guint64>(i) + 1);
  }
}

ELEMENT_TEST(test_same_bytes_by_tls) {
  Server server(Keys::of("left"));
  Client client(server.port(), Keys::client(Keys::of("server")));
  meet(server, client);
  expect_frames(server, client, 30);
  fail_unless_equals_uint64(statistic(client.source, "connections"), 1);
  fail_unless_equals_uint64(statistic(server.sink, "refused-keys"), 0);
}

// Whoever is not trusted gets nothing, and both ends say why; who is trusted misses nothing.
ELEMENT_TEST(test_wrong_keys) {
  Server server(Keys::of("left"));
  Client client(server.port(), Keys::client(Keys::of("server")));
  meet(server, client);
  const std::pair<const char*, std::string> wrong[] = {
      {"a client of another authority", Keys::of("stranger", "there")},
      {"a client that trusts another authority", Keys::of("server", "here", "there")},
      {"a client that expects another machine", Keys::of("server") + "tls-name=right"},
  };
  guint64 refused = 0;
  for (const auto& [what, properties] : wrong) {
    Client stranger(server.port(), Keys::client(properties));
    stranger.wait_for("refused-keys", 1);
    stranger.expect_warning("do not trust each other");
    server.push_until("refused-keys", refused + 1);
    catch_up(server, client);
    expect_frames(server, client, 5);
    fail_unless_equals_uint64(statistic(stranger.source, "frames"), 0);
    refused = statistic(server.sink, "refused-keys");
  }
  server.expect_warning("tls-authority signs");
  fail_unless_equals_uint64(statistic(client.source, "connections"), 1);
}

// Of those whose certificates are good, only the named are served: by their names and addresses.
ELEMENT_TEST(test_clients_by_name) {
  Server server(Keys::of("left") + "tls-clients=\"10.0.0.9, server\"");
  Client client(server.port(), Keys::client(Keys::of("server")));
  meet(server, client);
  for (const char* other : {"right", "10.0.0.8"}) {
    const guint64 before = statistic(server.sink, "refused-keys");
    Client stranger(server.port(), Keys::client(Keys::of(other)));
    stranger.wait_for("refused-keys", 1);
    server.push_until("refused-keys", before + 1);
    server.expect_warning("none of the names in tls-clients");
    fail_unless_equals_uint64(statistic(stranger.source, "frames"), 0);
  }
  catch_up(server, client);
  expect_frames(server, client, 3);
  Client two(server.port(), Keys::client(Keys::of("10.0.0.9")));
  server.push_until("clients-now", 2);
  fail_unless_equals_uint64(statistic(client.source, "connections"), 1);
}

// One of the two has TLS, the other not.
ELEMENT_TEST(test_tls_and_none) {
  {
    Server server(Keys::of("left") + "timeout=1000000000");
    Client plain(server.port(), "max-age=0 timeout=3000000000");
    for (int i = 0;
         i < 3000 &&
         statistic(server.sink, "refused-keys") + statistic(server.sink, "handshakes-late") == 0;
         ++i) {
      server.push();
      g_usleep(10000);
    }
    server.push_until("handshakes-late", 1);
    fail_unless_equals_uint64(statistic(plain.source, "frames"), 0);
  }
  Server server;
  Client secured(server.port(), Keys::client(Keys::of("server")));
  secured.wait_for("connections-failed", 1);
  secured.expect_warning("before it said who it is");
  fail_unless_equals_uint64(statistic(secured.source, "refused-keys"), 0);
  fail_unless_equals_uint64(statistic(secured.source, "frames"), 0);
}

// A server that is full, or does not know the address, is not taken for one with other keys.
ELEMENT_TEST(test_turned_away_by_tls) {
  {
    Server server(Keys::of("left") + "max-clients=1");
    Client one(server.port(), Keys::client(Keys::of("server")));
    meet(server, one);
    Client two(server.port(), Keys::client(Keys::of("server")));
    two.wait_for("connections-failed", 2);
    two.expect_warning("max-clients");
    fail_unless_equals_uint64(statistic(two.source, "refused-keys"), 0);
    g_object_set(server.sink, "max-clients", 2, nullptr);
    server.push_until("clients-now", 2);
  }
  Server server(Keys::of("left") + "allow=10.0.0.1");
  Client client(server.port(), Keys::client(Keys::of("server")));
  client.wait_for("connections-failed", 1);
  client.expect_warning("not in its allow");
  fail_unless_equals_uint64(statistic(client.source, "refused-keys"), 0);
}

// Connections that are reset, or that their own end leaves, before TLS has begun on them.
ELEMENT_TEST(test_ended_before_tls) {
  const Sender sender([](int, Accepted& accepted) { accepted.reset_at_close(); });
  const std::string keys = Keys::client(Keys::of("server")) + "retry=1000000";
  Client client(sender.port(), keys);
  client.wait_for("connections-failed", 150);
  client.expect_warning("ended the connection before it said who it is");
  for (gulong i = 0; i < 40; ++i) {
    const Client brief(sender.port(), keys);
    g_usleep(75 * i);
  }
}

// Who draws out the handshake, a byte now and then, is left, too; and the states change at once.
ELEMENT_TEST(test_handshake_drawn_out) {
  const Sender sender([](int, Accepted& accepted) {
    // The head of a TLS record, then its content.
    std::uint8_t byte[] = {0x16, 3, 3, 0x40, 0};
    for (std::size_t i = 0; accepted.send(Bytes(byte).subspan(i, 1)); i += i < 4 ? 1 : 0)
      g_usleep(200'000);
  });
  Client client(sender.port(), Keys::client(Keys::of("server")) + "timeout=1500000000");
  client.wait_for("connections-failed", 2);
  client.expect_warning("has not agreed on TLS within 1500 ms");
  fail_unless_equals_uint64(statistic(client.source, "refused-keys"), 0);
  g_object_set(client.source, "timeout", 1000 * GST_SECOND, nullptr);
  g_usleep(2'500'000);  // what has begun before ends as it began
  const gint64 begin = g_get_monotonic_time();
  gst_element_set_state(client.pipeline, GST_STATE_READY);
  fail_unless(g_get_monotonic_time() - begin < 1'000'000);
}

// Thirty who say nothing keep nobody out, and are cut.
ELEMENT_TEST(test_half_open) {
  Server server(Keys::of("left") + "max-clients=2 timeout=2000000000");
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 30; ++i) silent.push_back(std::make_unique<RawClient>(server.port()));
  Client client(server.port(), Keys::client(Keys::of("server")));
  meet(server, client);
  expect_frames(server, client, 10);
  server.push_until("handshakes-late", 30);
  fail_unless(statistic(server.sink, "clients-now") == 1);
}

// However many come from one address, they cut none that comes from another.
ELEMENT_TEST(test_flood_of_one_address) {
  Server server(Keys::of("left"));
  std::vector<std::unique_ptr<RawClient>> flood;
  const auto come = [&](int count) {
    for (int i = 0; i < count; ++i)
      flood.push_back(std::make_unique<RawClient>(server.port(), "127.0.0.2"));
  };
  const RawClient early(server.port(), "127.0.0.3");
  come(30);
  const RawClient late(server.port(), "127.0.0.4");
  come(30);
  server.wait_for("handshakes-late", 62 - 8);
  fail_unless_equals_uint64(statistic(server.sink, "handshakes-late"), 62 - 8);
  fail_if(early.is_cut() || late.is_cut());
  Client client(server.port(), Keys::client(Keys::of("server")));
  meet(server, client);
  fail_unless_equals_uint64(statistic(client.source, "connections-failed"), 0);
}

ELEMENT_TEST(test_floods) {
  const int connections = sanitized() ? 40 : 200;
  for (const std::string& properties : {std::string(), Keys::of("left")}) {
    Server server("max-clients=4 " + properties);
    Client client(server.port(),
                  properties.empty() ? "max-age=0" : Keys::client(Keys::of("server")));
    meet(server, client);
    for (int i = 0; i < connections; ++i) {
      RawClient flood(server.port());
      flood.write(std::string(static_cast<std::size_t>(i), static_cast<char>(37 * i)));
      if (i % 20 == 0) expect_frames(server, client, 1);
    }
    expect_frames(server, client, 20);
    fail_unless_equals_uint64(statistic(client.source, "connections"), 1);
  }
}

// Who takes nothing is given up at once; the others miss nothing.
ELEMENT_TEST(test_slow_client) {
  for (const bool tls : {false, true}) {
    Server server("buffers-max=4 " + (tls ? Keys::of("left") : ""));
    Client client(server.port(), tls ? Keys::client(Keys::of("server")) : "max-age=0");
    meet(server, client);
    RawClient slow(server.port());
    if (tls) slow.prove(Keys::of("server"));
    server.push_until("clients", 2);
    server.push_until("clients-now", 2);
    catch_up(server, client);
    gint64 longest = 0;
    for (int i = 0; i < 20000 && statistic(server.sink, "clients-slow") == 0; ++i) {
      const gint64 begin = g_get_monotonic_time();
      expect_frames(server, client, 1);
      longest = std::max(longest, g_get_monotonic_time() - begin);
    }
    fail_unless_equals_uint64(statistic(server.sink, "clients-slow"), 1);
    expect_frames(server, client, 10);
    server.expect_warning("takes less than there is");
    // Far less than `timeout`, for which nobody waits.
    fail_unless(longest < 20'000'000, "TLS %d: %d ms", tls, static_cast<int>(longest / 1000));
  }
}

ELEMENT_TEST(test_addresses) {
  {
    Server server("allow=\"10.0.0.0/8, 192.168.0.7\"");
    Client client(server.port());
    server.push_until("refused-addresses", 1);
    server.expect_warning("not in allow");
    fail_unless_equals_uint64(statistic(client.source, "frames"), 0);
  }
  Server server("allow=\"10.0.0.0/8 127.0.0.0/8\"");
  Client client(server.port());
  meet(server, client);
  expect_frames(server, client, 5);
}

ELEMENT_TEST(test_most_clients) {
  Server server("max-clients=1");
  Client one(server.port());
  meet(server, one);
  Client two(server.port());
  server.push_until("refused-full", 1);
  server.expect_warning("max-clients");
  fail_unless_equals_uint64(statistic(two.source, "frames"), 0);
  g_object_set(server.sink, "max-clients", 2, nullptr);
  server.push_until("clients-now", 2);
}

// Two who prove at once who they are have one place between them.
ELEMENT_TEST(test_most_proven_clients) {
  Server server(Keys::of("left") + "max-clients=1");
  RawClient one(server.port()), two(server.port());
  two.prove(Keys::of("server"));
  server.push_until("clients-now", 1);
  one.prove(Keys::of("server"));
  server.push_until("refused-full", 1);
  fail_unless_equals_uint64(statistic(server.sink, "clients-now"), 1);
  fail_unless_equals_uint64(statistic(server.sink, "clients"), 1);
}

// Those who are gone keep nobody out, though nothing is sent of which their going would be learnt.
ELEMENT_TEST(test_gone_in_silence) {
  for (const bool tls : {false, true}) {
    Server server("max-clients=2 " + (tls ? Keys::of("left") : ""));
    for (guint64 i = 1; i <= 10; ++i) {
      RawClient client(server.port());
      if (tls) client.prove(Keys::of("server"));
      server.wait_for("clients", i);
    }
    fail_unless_equals_uint64(statistic(server.sink, "refused-full"), 0);
  }
}

/// Until \p client's server has \p value for its element's property.
void wait_for_property(Server& server, GstElement* element, const char* property, double value) {
  double found = -1.0;
  for (int i = 0; i < 6000; ++i) {
    g_object_get(element, property, &found, nullptr);
    if (found == value) return;
    server.push();
    g_usleep(10000);
  }
  ck_abort_msg("%s is %g, not %g", property, found, value);
}

// Settings of those who have proved who they are reach the element that may have them.
ELEMENT_TEST(test_settings_arrive) {
  Server server(Keys::of("left") + "settings-for=blur");
  GstElement* blur = gst_element_factory_make("gaussblur", "blur");
  gst_object_ref(blur);
  gst_bin_add(GST_BIN(server.pipeline), blur);
  gst_element_set_locked_state(blur, TRUE);
  Client client(server.port(), Keys::client(Keys::of("server")) + " settings=\"sigma=2.5\"");
  meet(server, client);
  wait_for_property(server, blur, "sigma", 2.5);
  g_object_set(client.source, "settings", "sigma=1.25", nullptr);
  wait_for_property(server, blur, "sigma", 1.25);
  guint64 refused = 0;
  for (const char* wrong : {"sigma=-7", "sigma=wide", "sigma", "name=other", "colour=3",
                            "sigma=3 colour=3", "\"sigma=4"}) {
    g_object_set(client.source, "settings", wrong, nullptr);
    for (int i = 0; i < 6000 && statistic(server.sink, "settings-refused") == refused; ++i) {
      server.push();
      g_usleep(5000);
    }
    fail_unless_equals_uint64(statistic(server.sink, "settings-refused"), ++refused);
  }
  double sigma = 0.0;
  g_object_get(blur, "sigma", &sigma, nullptr);
  fail_unless(sigma == 1.25);
  server.expect_warning("are not taken");
  // None asked for: it keeps what it has, and hears nothing; nor of what is too long for it.
  const guint64 taken = statistic(server.sink, "settings");
  g_object_set(client.source, "settings", "", nullptr);
  for (int i = 0; i < 3; ++i) catch_up(server, client);
  g_object_set(client.source, "settings", std::string(5000, 'x').c_str(), nullptr);
  catch_up(server, client);
  client.expect_warning("5000 bytes and is not sent");
  fail_unless_equals_uint64(statistic(client.source, "settings-refused"), 1);
  g_object_set(client.source, "settings", "sigma=3.5", nullptr);
  wait_for_property(server, blur, "sigma", 3.5);
  fail_unless_equals_uint64(statistic(server.sink, "settings"), taken + 1);
  fail_unless_equals_uint64(statistic(server.sink, "settings-refused"), refused);
  fail_unless_equals_uint64(statistic(client.source, "connections"), 1);
  gst_element_set_locked_state(blur, FALSE);
  gst_object_unref(blur);
}

// Clients reach no file, and no camera becomes another.
ELEMENT_TEST(test_settings_reach_no_files) {
  Server server(Keys::of("left") + "settings-for=keyer");
  GstElement* keyer = gst_element_factory_make("silhouette", "keyer");
  g_object_set(keyer, "camera", "cam0", nullptr);
  gst_object_ref(keyer);
  gst_bin_add(GST_BIN(server.pipeline), keyer);
  gst_element_set_locked_state(keyer, TRUE);
  Client client(server.port(), Keys::client(Keys::of("server")) +
                                   " settings=\"sigma=2.5 inside-polygon=\'1,1 9,1 9,9\'\"");
  meet(server, client);
  wait_for_property(server, keyer, "sigma", 2.5);
  guint64 refused = 0;
  const auto text = [&](const char* property) {
    g_autofree gchar* value = nullptr;
    g_object_get(keyer, property, &value, nullptr);
    return std::string(value != nullptr ? value : "");
  };
  fail_unless(text("inside-polygon") == "1,1 9,1 9,9");
  for (const char* name : {"rig", "camera", "clean-plate", "outside-mask", "inside-mask"}) {
    const std::string before = text(name);
    g_object_set(client.source, "settings", (std::string(name) + "=/dev/zero").c_str(), nullptr);
    server.push_until("settings-refused", ++refused);
    fail_unless(text(name) == before, "%s has changed", name);
  }
  server.expect_warning("no file or other text");
  gst_element_set_locked_state(keyer, FALSE);
  gst_object_unref(keyer);
}

// Who says much is not heard for ever; empty lines say nothing.
ELEMENT_TEST(test_settings_without_end) {
  Server server(Keys::of("left") + "settings-for=server");
  const auto until_warnings_come_again = [] { g_usleep(1'100'000); };
  RawClient client(server.port());
  client.prove(Keys::of("server"));
  client.write("\n\n\nlarge=1\n\n");
  server.push_until("settings-refused", 1);
  until_warnings_come_again();
  client.write(std::string(2000, '\n'));
  server.push_until("settings-refused", 2);
  server.push_until("clients-now", 0);
  server.expect_warning("lines a second");
  fail_unless_equals_uint64(statistic(server.sink, "clients-closed"), 0);
  until_warnings_come_again();
  RawClient other(server.port());
  other.prove(Keys::of("server"));
  other.write(std::string(100'000, 'x'));
  server.push_until("settings-refused", 3);
  server.expect_warning("a line of more than 4096 bytes");
}

// The end comes when all have all, however long the last of it is underway; and can be given up.
ELEMENT_TEST(test_end_of_stream) {
  for (const bool reads : {true, false}) {
    Server server;
    RawClient client(server.port());
    server.wait_for("clients", 1);
    std::size_t sum = 0;
    while (sum < 30'000'000) {
      sum += recorded().payloads[server.pushed % frames].size();
      server.push();
    }
    const guint64 all = server.pushed + 3;  // and the head
    server.wait_for("packets", all);
    fail_unless_equals_int(gst_app_src_end_of_stream(GST_APP_SRC(server.in)), GST_FLOW_OK);
    fail_if(wait_for_end(server.pipeline, GST_SECOND / 2).empty(), "it ends before all have all");
    std::size_t came = 0;
    std::thread reader([&] {
      if (reads) came = client.read_all();
    });
    if (reads) check_ended(wait_for_end(server.pipeline));
    const gint64 begin = g_get_monotonic_time();
    gst_element_set_state(server.pipeline, GST_STATE_NULL);
    reader.join();
    fail_unless(g_get_monotonic_time() - begin < 10'000'000);
    fail_if(reads && came < sum, "%zu of %zu bytes", came, sum);
  }
}

// What is set in READY holds.
ELEMENT_TEST(test_set_when_ready) {
  GstElement* pipeline = parse(
      "fakesrc num-buffers=1 ! application/x-gdp ! "
      "viewserversink name=server host=nobody allow=there");
  fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_READY),
                         GST_STATE_CHANGE_SUCCESS);
  GstElement* sink = named(pipeline, "server");
  g_object_set(sink, "host", "127.0.0.1", "port", 0, "allow", "", nullptr);
  fail_if(gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
  check_ended(wait_for_end(pipeline));
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

// A flood of strangers is none of messages.
ELEMENT_TEST(test_messages_of_a_flood) {
  Server server("allow=10.0.0.1");
  const gint64 begin = g_get_monotonic_time();
  for (int i = 0; i < 200; ++i) RawClient stranger(server.port());
  server.wait_for("refused-addresses", 200);
  const gint64 seconds = (g_get_monotonic_time() - begin) / 1'000'000 + 2;
  gint64 messages = 0;
  while (GstMessage* message = gst_bus_pop_filtered(server.bus, GST_MESSAGE_ELEMENT)) {
    if (gst_message_has_name(message, "polyhull-client")) ++messages;
    gst_message_unref(message);
  }
  fail_unless(messages > 0 && messages <= 10 * seconds, "%d messages in %d s",
              static_cast<int>(messages), static_cast<int>(seconds));
}

ELEMENT_TEST(test_flush) {
  Server server;
  Client client(server.port());
  meet(server, client);
  GstPad* pad = gst_element_get_static_pad(server.in, "src");
  fail_unless(gst_pad_push_event(pad, gst_event_new_flush_start()));
  fail_unless(gst_pad_push_event(pad, gst_event_new_flush_stop(FALSE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  fail_unless(gst_pad_push_event(pad, gst_event_new_segment(&segment)));
  gst_object_unref(pad);
  expect_frames(server, client, 6);
}

ELEMENT_TEST(test_states) {
  check_states(
      "rigtestsrc camera=cam0 num-buffers=3 ! silhouette camera=cam0 ! gdppay ! "
      "viewserversink host=127.0.0.1 port=0");
}

ELEMENT_TEST(test_bad_settings) {
  const auto refusal = [](const std::string& properties) {
    GstElement* pipeline = parse("fakesrc ! application/x-gdp ! viewserversink " + properties);
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_PLAYING),
                           GST_STATE_CHANGE_FAILURE);
    const std::string text = wait_for_end(pipeline, GST_SECOND);
    stop(pipeline);
    return text;
  };
  const auto expect = [&](const std::string& properties, const char* words) {
    const std::string text = refusal("host=127.0.0.1 port=0 " + properties);
    fail_unless(text.find(words) != std::string::npos, "\"%s\" is not in \"%s\"", words,
                text.c_str());
  };
  Server server;
  expect("port=" + std::to_string(server.port()), "cannot be served at 127.0.0.1");
  expect("host=nobody", "host is 'nobody'");
  expect("allow=\"10.0.0.1 there\"", "allow has 'there'");
  expect("allow=10.0.0.0/99", "allow has '10.0.0.0/99'");
  expect("tls-authority=/nowhere.pem", "Only tls-authority is set");
  expect("tls-certificate=/nowhere.pem tls-authority=/nowhere.pem", "'/nowhere.pem'");
  const Folder folder;
  const std::string broken = folder.file("polyhull-broken.pem");
  std::ofstream(broken) << "-----BEGIN CERTIFICATE-----\nnone\n-----END CERTIFICATE-----\n";
  expect("tls-certificate=" + broken + " tls-authority=" + broken, "polyhull-broken.pem");
  expect("settings-for=keyer", "without TLS");
  expect("tls-clients=server", "without TLS");
  expect(Keys::of("left") + "tls-clients=\", \"", "names nobody");
  expect("allow=\", \"", "names nobody");
  // An authority's file has no private key.
  const std::string keys = Keys::of("left");
  const std::string authority = keys.substr(keys.find("tls-authority=") + 14);
  expect("tls-certificate=" + authority + "tls-authority=" + authority, "no private key");
}
