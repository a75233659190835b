// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/pads_as_children.h"

#include <fmt/core.h>
#include <gst/base/gstaggregator.h>
#include <gst/gst.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "plugins/common/live/live_pad.h"

namespace polyhull::element {
namespace {

// gst-launch keeps "mesh_0::scale=2" until the signal child-added tells of mesh_0; then it asks for
// the child of that name and sets the property, which the pad notifies. A pad that was asked for
// and not set has no such property (gst-launch says so, but not what there is) or the value cannot
// be read (gst-launch is silent; of a number out of range GLib tells). For a pad that never comes
// it waits for ever. Nothing tells an element what gst-launch still wants, so what was asked for is
// counted here, and said when a stream starts.

/// Of a pad, on what gst-launch asked and set while a child was announced.
struct PadRequests {
  std::atomic<int> asked{0}, set{0};
  std::atomic<bool> said{false};
  gulong notify = 0;  // handler of the pad's own signal
};

/// Of an element.
struct MissingPads {
  std::mutex mutex;                // protects names
  std::vector<std::string> names;  // asked for when there was no such pad
};

/// Enough for every launch line; an application may try out names for ever.
constexpr std::size_t most_missing = 64;

template <class T>
T& attached(gpointer object, const char* key) {
  const GQuark quark = g_quark_from_static_string(key);
  const ObjectLock lock(object);
  auto* data = static_cast<T*>(g_object_get_qdata(G_OBJECT(object), quark));
  if (data == nullptr) {
    data = new T;
    g_object_set_qdata_full(G_OBJECT(object), quark, data,
                            [](gpointer old) { delete static_cast<T*>(old); });
  }
  return *data;
}

PadRequests& requests_of(gpointer pad) {
  return attached<PadRequests>(pad, "polyhull-pad-requests");
}

MissingPads& missing_of(gpointer element) {
  return attached<MissingPads>(element, "polyhull-missing-pads");
}

guint child_added_signal() {
  return g_signal_lookup("child-added", GST_TYPE_CHILD_PROXY);
}

bool announcing(gpointer element) {
  const GSignalInvocationHint* hint = g_signal_get_invocation_hint(element);
  return hint != nullptr && hint->signal_id == child_added_signal();
}

/// A new reference, or null.
GstPad* sink_pad(gpointer element, const std::string& name) {
  const ObjectLock lock(element);
  for (GList* l = GST_ELEMENT_CAST(element)->sinkpads; l != nullptr; l = l->next)
    if (name == GST_OBJECT_NAME(l->data)) return GST_PAD_CAST(gst_object_ref(l->data));
  return nullptr;
}

/// "scale (0.001 to 1000), camera (text)": what our own pads have; the base class's is not for
/// users.
std::string properties_of(GstAggregatorPad* pad) {
  guint count = 0;
  g_autofree GParamSpec** specs = g_object_class_list_properties(G_OBJECT_GET_CLASS(pad), &count);
  std::string list;
  for (guint i = 0; i < count; ++i) {
    const GType owner = specs[i]->owner_type;
    if (owner == GST_TYPE_AGGREGATOR_PAD || !g_type_is_a(owner, GST_TYPE_AGGREGATOR_PAD)) continue;
    std::string kind = "text";
    if (G_IS_PARAM_SPEC_DOUBLE(specs[i])) {
      const auto* number = G_PARAM_SPEC_DOUBLE(specs[i]);
      kind = fmt::format("{:g} to {:g}", number->minimum, number->maximum);
    }
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", specs[i]->name, kind);
  }
  return list.empty() ? "no settings" : list;
}

void say_refused(GstElement* element, GstAggregatorPad* pad) {
  PadRequests& requests = requests_of(pad);
  if (requests.asked <= requests.set || requests.said.exchange(true)) return;
  const gchar* name = GST_OBJECT_NAME(pad);
  GST_ELEMENT_WARNING(element, RESOURCE, SETTINGS,
                      ("A setting %s::… was not taken: the pad has no property of that name, or "
                       "the value cannot be read. %s takes %s; numbers have a decimal point.",
                       name, name, properties_of(pad).c_str()),
                      (nullptr));
}

void say_missing(GstElement* element, const Pads& pads) {
  MissingPads& missing = missing_of(element);
  std::vector<std::string> names;
  {
    const std::scoped_lock lock(missing.mutex);
    names.swap(missing.names);
  }
  // A setting that waits listens for new children; an application that tries a name out does not.
  if (!g_signal_has_handler_pending(element, child_added_signal(), 0, TRUE)) return;
  std::string existing;
  for (GstAggregatorPad* pad : pads) {
    existing += std::string(existing.empty() ? "" : ", ") + GST_OBJECT_NAME(pad);
    std::erase(names, std::string(GST_OBJECT_NAME(pad)));
  }
  for (const std::string& name : names)
    GST_ELEMENT_WARNING(element, RESOURCE, SETTINGS,
                        ("A setting %s::… waits for a pad of that name, which %s does not have. It "
                         "has %s; request the pad, or set one of these.",
                         name.c_str(), GST_OBJECT_NAME(element), existing.c_str()),
                        (nullptr));
}

void count_setting(GObject* pad, GParamSpec*, gpointer) {
  g_autoptr(GstObject) element = gst_object_get_parent(GST_OBJECT_CAST(pad));
  if (element != nullptr && announcing(element)) ++requests_of(pad).set;
}

GstPadProbeReturn at_stream_start(GstPad* pad, GstPadProbeInfo* info, gpointer) {
  if (GST_EVENT_TYPE(GST_PAD_PROBE_INFO_EVENT(info)) != GST_EVENT_STREAM_START)
    return GST_PAD_PROBE_OK;
  g_clear_signal_handler(&requests_of(pad).notify, pad);
  g_autoptr(GstElement) element = gst_pad_get_parent_element(pad);
  if (element != nullptr) {
    const Pads pads(element);
    for (GstAggregatorPad* each : pads) say_refused(element, each);
    say_missing(element, pads);
  }
  return GST_PAD_PROBE_REMOVE;
}

// ---- the interface

/// Runs before those who listen to the signal.
void child_added(GstChildProxy*, GObject* child, const gchar*) {
  requests_of(child).notify = g_signal_connect(child, "notify", G_CALLBACK(count_setting), nullptr);
  gst_pad_add_probe(GST_PAD_CAST(child), GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, at_stream_start,
                    nullptr, nullptr);
}

GObject* child_by_name(GstChildProxy* proxy, const gchar* name) {
  GstPad* pad = sink_pad(proxy, name);
  if (pad != nullptr) {
    if (announcing(proxy)) ++requests_of(pad).asked;
    return G_OBJECT(pad);
  }
  MissingPads& missing = missing_of(proxy);
  const std::scoped_lock lock(missing.mutex);
  if (missing.names.size() < most_missing &&
      std::find(missing.names.begin(), missing.names.end(), name) == missing.names.end())
    missing.names.emplace_back(name);
  return nullptr;
}

GObject* child_by_index(GstChildProxy* proxy, guint index) {
  const ObjectLock lock(proxy);
  gpointer pad = g_list_nth_data(GST_ELEMENT_CAST(proxy)->sinkpads, index);
  if (pad != nullptr) gst_object_ref(pad);
  return static_cast<GObject*>(pad);
}

guint children_count(GstChildProxy* proxy) {
  const ObjectLock lock(proxy);
  return GST_ELEMENT_CAST(proxy)->numsinkpads;
}

}  // namespace

void pads_as_children(void* interface, void*) {
  auto* proxy = static_cast<GstChildProxyInterface*>(interface);
  proxy->child_added = child_added;
  proxy->get_child_by_name = child_by_name;
  proxy->get_child_by_index = child_by_index;
  proxy->get_children_count = children_count;
}

}  // namespace polyhull::element
