// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// viewclientsrc: the views or meshes of another machine, over TCP, from a pipeline that ends in
/// gdppay and viewserversink or tcpserversink. It connects again after every cut, trusts nothing
/// that comes before it has been read from end to end, and drops what a cut has made old. Each loss
/// and return of the connection is announced by an element message "polyhull-link" with the fields
/// host, port, connected and reason.
#include <gst/base/gstpushsrc.h>

#include <memory>

#include "base/error.h"
#include "plugins/common/guard.h"
#include "plugins/viewclientsrc/private.h"

GST_DEBUG_CATEGORY(viewclientsrc_debug);

namespace polyhull::element {
namespace {

GstFlowReturn create(GstPushSrc* push, GstBuffer** created) {
  auto* element = GST_ELEMENT(push);
  ViewClientSrc& self = state_of<ViewClientSrc>(push);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    self.waits = g_get_monotonic_time();  // what holds up the stream is not the sender
    while (!g_cancellable_is_cancelled(self.cancel.get())) {
      const ViewClientSettings now = snapshot(push, self.settings);
      if (self.link == nullptr && !self.connect(element, now)) {
        wait_for(self.cancel.get(), static_cast<std::int64_t>(now.retry));
        continue;
      }
      GstBuffer* buffer = nullptr;
      self.tell(element, now);
      try {
        buffer = self.receive(element, now);
      } catch (const Cut& reason) {
        self.cut(element, now, reason);
        if (!reason.waited) wait_for(self.cancel.get(), static_cast<std::int64_t>(now.retry));
        continue;
      } catch (const EndOfStream&) {
        self.link.reset();
        return GST_FLOW_EOS;
      }
      if (buffer == nullptr) continue;
      if (self.agreed == nullptr || !gst_caps_is_equal(self.agreed.get(), self.format.get())) {
        if (!gst_base_src_set_caps(GST_BASE_SRC(push), self.format.get())) {
          gst_buffer_unref(buffer);
          return GST_FLOW_NOT_NEGOTIATED;
        }
        self.agreed.reset(gst_caps_ref(self.format.get()));
      }
      if (self.first) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
      if (self.lost) announce(element, now, true, "frames come again");
      self.first = self.lost = false;
      self.statistics.count("frames");
      GST_LOG_OBJECT(push, "received %" GST_PTR_FORMAT, printed(buffer));
      *created = buffer;
      return GST_FLOW_OK;
    }
    // What comes until there is a return is old by then.
    self.link.reset();
    return GST_FLOW_FLUSHING;
  });
}

gboolean unlock(GstBaseSrc* source) {
  g_cancellable_cancel(state_of<ViewClientSrc>(source).cancel.get());
  return TRUE;
}

gboolean unlock_stop(GstBaseSrc* source) {
  g_cancellable_reset(state_of<ViewClientSrc>(source).cancel.get());
  return TRUE;
}

/// The format is the sender's: there is none before it has said so.
gboolean negotiate(GstBaseSrc*) {
  return TRUE;
}

gboolean answer(GstBaseSrc* source, GstQuery* query) {
  if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY)
    return GST_BASE_SRC_CLASS(parent_class<ViewClientSrc>())->query(source, query);
  const ViewClientSettings now = snapshot(source, state_of<ViewClientSrc>(source).settings);
  gst_query_set_latency(query, TRUE, now.latency, GST_CLOCK_TIME_NONE);
  return TRUE;
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  ViewClientSrc& self = state_of<ViewClientSrc>(element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !guarded(element, false, [&] {
        const ViewClientSettings now = snapshot(element, self.settings);
        if (now.host.empty())
          throw Error(Error::Kind::bad_input,
                      "host is empty; set it to the name or address of the machine that sends.");
        if (now.settings.size() > longest_settings)
          throw Error(Error::Kind::bad_input, "{}", too_long(now.settings));
        self.identity = TlsIdentity(now.tls_certificate, now.tls_authority);
        self.statistics.reset();
        self.agreed.reset();
        self.lost = false;
        return true;
      }))
    return GST_STATE_CHANGE_FAILURE;
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<ViewClientSrc>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) self.link.reset();
  return result;
}

}  // namespace

void ViewClientSrc::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(viewclientsrc_debug, "viewclientsrc", 0, "views from other machines");
  add_properties<ViewClientSrc>(klass, view_client_properties(), &ViewClientSrc::settings);
  add_statistics<ViewClientSrc>(
      klass,
      "Counters since the start: connections, connections-failed (attempts), cuts, silences (cuts "
      "for want of frames), ends-of-sender, packets and bytes (whole packets), frames (sent on), "
      "frames-stale (dropped), frames-of-another-clock (passed), refused-packets (no packet of the "
      "protocol), refused-sizes, refused-rates, refused-formats, refused-keys (of TLS), "
      "refused-frames (dropped, the connection stays), settings-refused (not sent); and age-ms, "
      "how long ago the last frame was taken.");
  set_metadata(klass, "View client source", "Source/Network",
               "Receives views or meshes of another machine, connecting again after every cut");
  add_template(klass, "src", GST_PAD_SRC,
               "application/x-polyhull-view; application/x-polyhull-mesh");
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  GstBaseSrcClass* source = GST_BASE_SRC_CLASS(klass);
  source->unlock = unlock;
  source->unlock_stop = unlock_stop;
  source->negotiate = negotiate;
  source->query = answer;
  GST_PUSH_SRC_CLASS(klass)->create = create;
}

}  // namespace polyhull::element

using namespace polyhull::element;
GST_ELEMENT_REGISTER_DEFINE(viewclientsrc, "viewclientsrc", GST_RANK_NONE, type_of<ViewClientSrc>())
