// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/serialtrigger/set_listener.h"

#include <utility>

#include "base/error.h"
#include "plugins/common/pipeline.h"

namespace polyhull::element {
namespace {

constexpr char signal[] = "composited";

bool has_signal(GstElement* element) {
  return g_signal_lookup(signal, G_OBJECT_TYPE(element)) != 0;
}

using Heard = std::function<void()>;

void on_signal(GstElement*, guint64, gpointer heard) {
  (*static_cast<Heard*>(heard))();
}

GstPadProbeReturn on_buffer(GstPad*, GstPadProbeInfo*, gpointer heard) {
  (*static_cast<Heard*>(heard))();
  return GST_PAD_PROBE_OK;
}

/// A pad through which every buffer of \p element goes; a new reference, null where it has none.
GstPad* pad_of(GstElement* element) {
  for (const char* name : {"src", "sink"})
    if (GstPad* pad = gst_element_get_static_pad(element, name)) return pad;
  return nullptr;
}

}  // namespace

void SetListener::start(GstElement* seeker, const std::string& name, Heard heard) {
  stop();
  Ref<GstElement> element =
      find_in_pipeline(seeker, name, "listen-to", name.empty() ? "composite" : "element",
                       [&](GstElement* found) { return !name.empty() || has_signal(found); });
  auto* held = new Heard(std::move(heard));
  if (has_signal(element.get())) {
    handle_ = g_signal_connect_data(
        element.get(), signal, G_CALLBACK(on_signal), held,
        [](gpointer data, GClosure*) { delete static_cast<Heard*>(data); },
        static_cast<GConnectFlags>(0));
  } else {
    pad_ = pad_of(element.get());
    if (pad_ == nullptr) {
      delete held;
      throw Error(Error::Kind::bad_input,
                  "The element '{}' has neither a pad src nor a pad sink to listen to.", name);
    }
    handle_ = gst_pad_add_probe(
        pad_,
        static_cast<GstPadProbeType>(GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_BUFFER_LIST),
        on_buffer, held, [](gpointer data) { delete static_cast<Heard*>(data); });
  }
  element_ = element.release();
}

void SetListener::stop() {
  if (pad_ != nullptr) {
    gst_pad_remove_probe(pad_, handle_);
  } else if (element_ != nullptr) {
    g_signal_handler_disconnect(element_, handle_);
  }
  handle_ = 0;
  g_clear_pointer(&pad_, gst_object_unref);
  g_clear_pointer(&element_, gst_object_unref);
}

}  // namespace polyhull::element
