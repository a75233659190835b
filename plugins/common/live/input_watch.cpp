// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/input_watch.h"

#include <string>
#include <vector>

#include "plugins/common/live/live_pad.h"

namespace polyhull::element {
namespace {

// A scene takes its time for the first light.
constexpr gint64 unlinked_patience = 3 * G_USEC_PER_SEC, patience = 8 * G_USEC_PER_SEC;

/// A pad that keeps the others waiting, and why.
struct Silent {
  std::string pad;
  bool linked;
  bool ever;
};

/// Whether the pipeline is to play: its elements are told so only when all have their first buffer.
bool is_to_play(GstElement* element) {
  g_autoptr(GstObject) top = GST_OBJECT(gst_object_ref(element));
  while (GstObject* parent = gst_object_get_parent(top)) {
    gst_object_unref(top);
    top = parent;
  }
  return GST_STATE_TARGET(top) == GST_STATE_PLAYING;
}

/// The pads on which nothing waits, while others are kept waiting.
std::vector<Silent> silent_pads(GstElement* element) {
  std::vector<Silent> silent;
  std::vector<LivePadState*> states;
  bool others_wait = false;
  const gint64 now = g_get_monotonic_time();
  const bool playing = is_to_play(element);
  const Pads pads(element);
  for (GstAggregatorPad* pad : pads) {
    LivePadState& state = state_of<LivePadState>(pad);
    if (!playing) state.last_buffer = now;  // what is paused is silent
    const gint64 last = state.last_buffer;
    if (gst_aggregator_pad_has_buffer(pad) || now - last < G_USEC_PER_SEC) {
      others_wait = true;
      continue;
    }
    if (gst_aggregator_pad_is_eos(pad) || state.said_silent) continue;
    const bool linked = gst_pad_is_linked(GST_PAD(pad)) != FALSE;
    if (now - last <= (linked ? patience : unlinked_patience)) continue;
    silent.push_back({GST_OBJECT_NAME(pad), linked, state.begun.load()});
    states.push_back(&state);
  }
  if (playing && others_wait) {
    for (LivePadState* state : states) state->said_silent = true;
  } else {
    silent.clear();
  }
  return silent;
}

/// What the clock's thread has: it may outlast the element.
struct Watched {
  GWeakRef element;
  InputWatch::In in;
};

gboolean look(GstClock*, GstClockTime, GstClockID, gpointer data) {
  auto* watched = static_cast<Watched*>(data);
  g_autoptr(GstElement) element = static_cast<GstElement*>(g_weak_ref_get(&watched->element));
  if (element == nullptr) return FALSE;
  const bool live = GST_CLOCK_TIME_IS_VALID(gst_aggregator_get_latency(GST_AGGREGATOR(element)));
  if (live && watched->in == InputWatch::In::files) return TRUE;
  for (const Silent& silent : silent_pads(element)) {
    const std::string why =
        !silent.linked ? "which is not linked to anything. Link it or do not request it"
        : silent.ever  ? "where nothing has come for eight seconds. Look for what has stopped there"
                       : "where nothing has come yet. Look whether its source runs, and that every "
                         "source starts playing with the pipeline";
    GST_ELEMENT_WARNING(element, STREAM, FAILED,
                        ("%s waits for its input %s, %s.", GST_OBJECT_NAME(element),
                         silent.pad.c_str(), why.c_str()),
                        (nullptr));
  }
  return TRUE;
}

void forget(gpointer data) {
  g_weak_ref_clear(&static_cast<Watched*>(data)->element);
  delete static_cast<Watched*>(data);
}

}  // namespace

void InputWatch::start() {
  stop();
  for (GstAggregatorPad* pad : Pads(element_)) {
    state_of<LivePadState>(pad).last_buffer = g_get_monotonic_time();
    state_of<LivePadState>(pad).said_silent = false;
  }
  g_autoptr(GstClock) clock = gst_system_clock_obtain();
  id_ = gst_clock_new_periodic_id(clock, gst_clock_get_time(clock) + GST_SECOND, GST_SECOND);
  auto* watched = new Watched;
  g_weak_ref_init(&watched->element, element_);
  watched->in = in_;
  gst_clock_id_wait_async(id_, look, watched, forget);
}

void InputWatch::stop() {
  if (id_ == nullptr) return;
  gst_clock_id_unschedule(id_);
  gst_clock_id_unref(id_);
  id_ = nullptr;
}

}  // namespace polyhull::element
