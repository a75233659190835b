// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// viewserversink: the end of a capture machine's pipeline, behind gdppay: serves its views over TCP to
/// those that may have them, by address and by TLS. Nobody who is slow, silent or not trusted holds up
/// the stream or the others. Each client that is served, or not any more, or refused is announced by an
/// element message "polyhull-client" with the fields address, served and reason.
#include <gst/base/gstbasesink.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/viewserversink/remote_settings.h"
#include "plugins/viewserversink/settings.h"
#include "plugins/viewserversink/view_server.h"

GST_DEBUG_CATEGORY_STATIC(viewserversink_debug);
#define GST_CAT_DEFAULT viewserversink_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct ViewServerSink {
  static constexpr char type_name[] = "PolyhullViewServerSink";
  static GType base_type() { return GST_TYPE_BASE_SINK; }
  static void class_init(gpointer klass);

  explicit ViewServerSink(gpointer object) {
    statistics.declare({"port", "clients", "clients-now", "clients-closed", "clients-slow",
                        "refused-addresses", "refused-full", "refused-keys", "refused-resources",
                        "handshakes-late", "settings", "settings-refused", "packets", "bytes"});
    gst_base_sink_set_sync(GST_BASE_SINK(object), FALSE);
    // Whoever listens for clients is ready before the first frame.
    gst_base_sink_set_async_enabled(GST_BASE_SINK(object), FALSE);
  }

  /// Whether one more client that is not served is told of: ten a second are.
  bool may_tell() {
    const std::scoped_lock lock(told_mutex);
    const std::int64_t now = g_get_monotonic_time() / 1'000'000;
    if (now != told_second) told = 0;
    told_second = now;
    return ++told <= 10;
  }

  ViewServerSettings settings;  // under the object lock
  Statistics statistics{"viewserversink-stats"};
  std::optional<ViewServer> server;  // from PAUSED on
  std::mutex told_mutex;             // protects the two below
  std::int64_t told_second = 0;
  int told = 0;
  std::atomic<bool> unlocked{false};  // what waits in the stream's thread is to leave
};

/// What becomes of a client that is not served, or not any more.
struct Refusal {
  std::string_view event;  // as ViewServer has it
  const char* counter;
  const char* sentence;
  bool says_why;       // what GIO or the system says comes behind it
  bool before_served;  // it has never been
};
constexpr Refusal refusals[] = {
    {"clients-slow", "clients-slow",
     "is not served any more: it takes less than there is; it may connect again. Look at the link, "
     "or pack views more (viewencode)",
     false, false},
    {"refused-keys", "refused-keys",
     "is not served: it has not proved who it is by a certificate that tls-authority signs", true,
     true},
    {"refused-names", "refused-keys",
     "is not served: its certificate is good, but for none of the names in tls-clients", false,
     true},
    {"refused-noise", "settings-refused", "is not served any more", true, false},
    {"handshakes-late", "handshakes-late",
     "is not served: it has not proved in time who it is; is it a client without TLS?", false,
     true},
    {"refused-resources", "refused-resources",
     "is not served: this machine has no thread for it; look at the process's limits", true, true},
    {"refused-full", "refused-full",
     "is not served: as many as max-clients allows are served already", false, true},
    {"refused-addresses", "refused-addresses", "is not served: its address is not in allow", false,
     true},
};

/// Of the clients that come and go.
void tell(GstElement* element, const char* event, const std::string& address,
          const std::string& why) {
  ViewServerSink& self = state_of<ViewServerSink>(element);
  Statistics& statistics = self.statistics;
  GST_DEBUG_OBJECT(element, "%s: %s%s%s", address.c_str(), event, why.empty() ? "" : ", ",
                   why.c_str());
  const char* counter = event;
  const auto* refusal = std::find_if(std::begin(refusals), std::end(refusals),
                                     [&](const Refusal& r) { return r.event == event; });
  if (refusal == std::end(refusals)) {
    statistics.count(counter);
  } else {
    counter = refusal->counter;
    statistics.warn(element, counter,
                    fmt::format("{} {}{}.", address, refusal->sentence,
                                refusal->says_why && !why.empty() ? " (" + why + ")" : ""));
  }
  const bool served = std::string_view(counter) == "clients";
  // A flood of those who may not come is no flood of messages: `stats` count all.
  if (refusal != std::end(refusals) && refusal->before_served && !self.may_tell()) return;
  gst_element_post_message(
      element, gst_message_new_element(
                   GST_OBJECT(element),
                   gst_structure_new("polyhull-client", "address", G_TYPE_STRING, address.c_str(),
                                     "served", G_TYPE_BOOLEAN, served, "reason", G_TYPE_STRING,
                                     served ? "" : counter, nullptr)));
}

/// Settings of the client at \p address for the element \p name.
void change(GstElement* element, const std::string& name, const std::string& address,
            const std::string& line) {
  Statistics& statistics = state_of<ViewServerSink>(element).statistics;
  try {
    GST_DEBUG_OBJECT(element, "%s sets '%s' of %s", address.c_str(), line.c_str(), name.c_str());
    apply_remote_settings(element, name, line);
    statistics.count("settings");
  } catch (const std::exception& error) {
    statistics.warn(element, "settings-refused",
                    fmt::format("Settings that {} sends are not taken: {}", address, error.what()));
  }
}

bool start(GstElement* element) {
  ViewServerSink& self = state_of<ViewServerSink>(element);
  return guarded(element, false, [&] {
    self.statistics.reset();
    const ViewServerSettings settings = snapshot(element, self.settings);
    ViewServer::Settings said;
    if (!settings.settings_for.empty())
      said = [element, name = settings.settings_for](const std::string& address,
                                                     const std::string& line) {
        change(element, name, address, line);
      };
    self.server.emplace(
        settings,
        [element](const char* counter, const std::string& address, const std::string& why) {
          tell(element, counter, address, why);
        },
        std::move(said));
    GST_DEBUG_OBJECT(element, "serves at port %d", self.server->port());
    self.statistics.set_count("port", static_cast<std::uint64_t>(self.server->port()));
    return true;
  });
}

void stop(GstElement* element) {
  ViewServerSink& self = state_of<ViewServerSink>(element);
  if (self.server) self.statistics.set_count("bytes", self.server->bytes());
  self.server.reset();
  self.statistics.set_count("clients-now", 0);
}

/// Not GstBaseSink's start() and stop(), which come before READY, in which settings are still made.
GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !start(element))
    return GST_STATE_CHANGE_FAILURE;
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<ViewServerSink>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY ||
      (transition == GST_STATE_CHANGE_READY_TO_PAUSED && result == GST_STATE_CHANGE_FAILURE))
    stop(element);
  return result;
}

gboolean unlock(GstBaseSink* sink) {
  state_of<ViewServerSink>(sink).unlocked = true;
  return TRUE;
}

gboolean unlock_stop(GstBaseSink* sink) {
  state_of<ViewServerSink>(sink).unlocked = false;
  return TRUE;
}

/// The stream has ended when its clients have its end.
GstFlowReturn wait_event(GstBaseSink* sink, GstEvent* event) {
  const GstFlowReturn before =
      GST_BASE_SINK_CLASS(parent_class<ViewServerSink>())->wait_event(sink, event);
  if (before != GST_FLOW_OK || GST_EVENT_TYPE(event) != GST_EVENT_EOS) return before;
  ViewServerSink& self = state_of<ViewServerSink>(sink);
  const std::int64_t end =
      g_get_monotonic_time() +
      static_cast<std::int64_t>(snapshot(sink, self.settings).timeout / GST_USECOND);
  while (self.server && !self.server->all_have_all() && g_get_monotonic_time() < end) {
    if (self.unlocked) {  // paused, which may last, or flushed
      const GstFlowReturn result = gst_base_sink_wait_preroll(sink);
      if (result != GST_FLOW_OK) return result;
    }
    g_usleep(5'000);
  }
  return GST_FLOW_OK;
}

/// What gdppay repeats for everybody who comes later.
gboolean set_caps(GstBaseSink* sink, GstCaps* caps) {
  const GValue* header = gst_structure_get_value(gst_caps_get_structure(caps, 0), "streamheader");
  std::vector<Ref<GstBuffer>> head;
  if (header != nullptr && GST_VALUE_HOLDS_ARRAY(header))
    for (guint i = 0; i < gst_value_array_get_size(header); ++i) {
      GstBuffer* packet = gst_value_get_buffer(gst_value_array_get_value(header, i));
      if (packet != nullptr) head.emplace_back(gst_buffer_ref(packet));
    }
  ViewServerSink& self = state_of<ViewServerSink>(sink);
  if (self.server) self.server->set_head(std::move(head));
  return TRUE;
}

GstFlowReturn render(GstBaseSink* sink, GstBuffer* buffer) {
  ViewServerSink& self = state_of<ViewServerSink>(sink);
  if (!self.server) return GST_FLOW_FLUSHING;
  self.server->send(buffer, snapshot(sink, self.settings));
  self.statistics.count("packets");
  self.statistics.set_count("clients-now", self.server->clients());
  self.statistics.set_count("bytes", self.server->bytes());
  GST_LOG_OBJECT(sink, "sent to %zu clients: %" GST_PTR_FORMAT, self.server->clients(),
                 printed(buffer));
  return GST_FLOW_OK;
}

void ViewServerSink::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(viewserversink_debug, "viewserversink", 0, "views for other machines");
  add_properties<ViewServerSink>(klass, view_server_properties(), &ViewServerSink::settings);
  add_statistics<ViewServerSink>(
      klass,
      "Counters since the start: port (at which clients are served), clients (that were served), "
      "clients-now, clients-closed (gone by themselves), clients-slow (given up), "
      "refused-addresses, refused-full, refused-keys (no certificate that is trusted, or of none "
      "of "
      "tls-clients), "
      "refused-resources (no thread is to be had), "
      "handshakes-late, settings (lines that clients have sent and that hold), settings-refused "
      "(or too many), "
      "packets, and bytes that clients have taken.");
  set_metadata(klass, "View server sink", "Sink/Network",
               "Serves views or meshes to the machines that may have them");
  add_template(klass, "sink", GST_PAD_SINK, "application/x-gdp");
  GstBaseSinkClass* sink = GST_BASE_SINK_CLASS(klass);
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  sink->unlock = unlock;
  sink->unlock_stop = unlock_stop;
  sink->wait_event = wait_event;
  sink->set_caps = set_caps;
  sink->render = render;
  gst_type_mark_as_plugin_api(type_of<ViewServerSink>(), static_cast<GstPluginAPIFlags>(0));
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(viewserversink, "viewserversink", GST_RANK_NONE,
                            type_of<ViewServerSink>())
