// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/video/video.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/composite/element.h"

namespace polyhull::element {
namespace {

/// A background's frame that waits: its time, and the time up to which it is shown.
struct WaitingFrame {
  const Arrival* arrival = nullptr;  ///< null: none waits
  std::int64_t begin = no_time, end = no_time;
};

WaitingFrame waiting_frame(const Composite& self, GstAggregatorPad* pad) {
  WaitingFrame frame;
  frame.arrival = peek(pad);
  if (frame.arrival == nullptr) return frame;
  frame.begin = frame.arrival->time();
  if (frame.begin == no_time) return frame;
  frame.end = frame.arrival->end();
  const int rate = GST_VIDEO_INFO_FPS_N(&self.background_info);
  if (frame.end == frame.begin && rate > 0)
    frame.end += static_cast<std::int64_t>(
        gst_util_uint64_scale_int(GST_SECOND, GST_VIDEO_INFO_FPS_D(&self.background_info), rate));
  // A frame without length lasts an instant.
  frame.end = std::max(frame.end, frame.begin + 1);
  return frame;
}

void show(Composite& self, GstAggregatorPad* pad, GstBuffer* buffer, std::int64_t time) {
  MeshPadState& state = state_of<MeshPadState>(pad);
  try {
    state.mesh = std::make_unique<MeshBuffer>(buffer);
    state.content = self.next_content++;
    state.time = time;
    self.newcomer = state.mesh->mesh().trigger;
    self.statistics.count("meshes");
    GST_LOG_OBJECT(pad, "shows %zu triangles from %" GST_TIME_FORMAT " on",
                   state.mesh->mesh().hull.triangles.size() / 3, GST_TIME_ARGS(clock_time(time)));
  } catch (const Error& error) {
    self.statistics.warn(
        GST_ELEMENT_CAST(self.element), "meshes-unusable",
        fmt::format("A buffer on {} was dropped: {}", GST_OBJECT_NAME(pad), error.what()));
  }
}

/// A live mesh that begins later than this after a frame's begin is not waited for: cameras and
/// background keep one grid only up to the jitter of their times. LiveTiming has 6 ms to spare.
constexpr std::int64_t same_instant = 5'000'000;

/// Whether what \p pad has brought is what a live \p frame shows, so that the next mesh need not be
/// waited for: it lasts beyond the frame's instant, as far as it says, or does not begin before it
/// but for that jitter.
bool is_of_now(GstAggregatorPad* pad, const WaitingFrame& frame) {
  const MeshPadState& state = state_of<MeshPadState>(pad);
  if (frame.begin == no_time || state.end == no_time) return false;
  const std::int64_t instant = std::min(frame.begin + same_instant, frame.end - 1);
  return state.end > instant || state.begin + same_instant >= frame.begin;
}

/// Whether nothing more is to be waited for on \p pad for \p frame. In files, where nothing hurries,
/// the next mesh tells.
bool is_settled(GstAggregatorPad* pad, const WaitingFrame& frame, bool live) {
  const Arrival* next = peek(pad);
  if (next == nullptr) return gst_aggregator_pad_is_eos(pad) || (live && is_of_now(pad, frame));
  const std::int64_t time = next->time();
  return time != no_time && frame.end != no_time && time >= frame.end;
}

/// Takes from the pad what belongs to \p frame: the last mesh that begins before its end. False:
/// more may come that belongs to it.
bool catch_up(Composite& self, GstAggregatorPad* pad, const WaitingFrame& frame, bool live) {
  MeshPadState& state = state_of<MeshPadState>(pad);
  while (!is_settled(pad, frame, live)) {
    const Arrival* next = peek(pad);
    if (next == nullptr) return false;
    const std::int64_t time = next->time();
    state.begin = time;
    state.end = next->end();
    if (!next->gap()) show(self, pad, next->buffer, time);
    pop(pad);
    // Without times, one mesh goes with one frame.
    if (time == no_time || frame.end == no_time) return true;
  }
  return true;
}

/// Whether there is anything to draw of \p mesh: triangles, or a silhouette in each view.
bool is_something(const Mesh& mesh) {
  if (mesh.opacity <= 0.0f) return false;
  if (!mesh.hull.empty()) return true;
  return mesh.views.size() >= 2 &&
         std::none_of(mesh.views.begin(), mesh.views.end(),
                      [](const MeshView& view) { return view.view.contours.empty(); });
}

/// The meshes that are shown with a frame that ends at \p end.
std::vector<GstAggregatorPad*> shown(const CompositePads& pads, std::int64_t end,
                                     std::uint64_t max_age) {
  std::vector<GstAggregatorPad*> out;
  for (GstAggregatorPad* pad : pads.meshes) {
    const MeshPadState& state = state_of<MeshPadState>(pad);
    if (!state.mesh || !is_something(state.mesh->mesh())) continue;
    const bool aged = state.time != no_time && end != no_time && end > state.time &&
                      static_cast<std::uint64_t>(end - state.time) > max_age;
    if (!aged) out.push_back(pad);
  }
  return out;
}

GstBuffer* acquire(GstAggregator* aggregator, const GstVideoInfo& info) {
  g_autoptr(GstBufferPool) pool = gst_aggregator_get_buffer_pool(aggregator);
  if (!pool) return gst_buffer_new_allocate(nullptr, info.size, nullptr);
  if (!gst_buffer_pool_is_active(pool)) gst_buffer_pool_set_active(pool, TRUE);
  GstBuffer* buffer = nullptr;
  return gst_buffer_pool_acquire_buffer(pool, &buffer, nullptr) == GST_FLOW_OK ? buffer : nullptr;
}

/// The composite of \p frame, whose reference it takes, of the stream time \p time, in a stream that is
/// \p live or not; null: the pool is flushing. \p place is set where it is still to be taken from there.
GstBuffer* compose(Composite& self, const CompositeSettings& settings, GstBuffer* frame,
                   GstClockTime time, bool live, const std::vector<GstAggregatorPad*>& meshes,
                   std::optional<unsigned>& place) {
  g_autoptr(GstBuffer) held = frame;
  const bool video = is_video_output(self.output_info);
  const bool same_memory = !video && self.background_on_gpu == self.output_on_gpu;
  const FrameBuffers buffers{frame, &self.background_info, &self.output_info,
                             self.background_on_gpu, self.output_on_gpu};
  self.composer.prepare(settings, self.background_info, frame, time, live, meshes,
                        self.background_on_gpu || self.output_on_gpu);
  if (meshes.empty()) self.statistics.count("no-mesh");
  if (self.composer.unusable() > 0)
    self.statistics.warn(GST_ELEMENT_CAST(self.element), "meshes-unusable",
                         "A mesh is not drawn: it has vertices that are not finite, or more than a "
                         "million kilometres away. Look at its placement (translate, scale) and at "
                         "the unit of its rig.");
  const auto copy_times = [&](GstBuffer* to) {
    gst_buffer_copy_into(
        to, frame,
        static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0, -1);
  };
  g_autoptr(GstBuffer) output = nullptr;
  if (self.composer.untouched() && (same_memory || video)) {
    self.statistics.count("passed-through");
    if (!video) return g_steal_pointer(&held);
    output = self.composer.background_as_video(buffers);
    copy_times(output);
    return g_steal_pointer(&output);
  }
  if (same_memory && !self.output_on_gpu && is_sole_owner(frame)) {
    output = g_steal_pointer(&held);  // its untouched part need not even be copied
  } else {
    output = acquire(self.element, self.output_info);
    if (!output) return nullptr;
    copy_times(output);
  }
  place = self.composer.draw(buffers, output, settings.async_readback);
  return g_steal_pointer(&output);
}

/// Leaves out the frames of a live background that nobody can use: whole, before anything is done
/// for them.
void drop_useless(Composite& self, GstAggregatorPad* background) {
  const std::int64_t now = self.timing.now();
  for (;;) {
    const WaitingFrame frame = waiting_frame(self, background);
    if (frame.arrival == nullptr || frame.begin == no_time || now == no_time) return;
    const bool unwanted = !self.pace.wanted(frame.begin);
    const bool overdue = self.pace.too_late(frame.begin) ||
                         (more_wait(background) && now > frame.end + self.timing.latency());
    if (!unwanted && !overdue) return;
    self.statistics.count(unwanted ? "frames-unwanted" : "frames-overdue");
    GST_DEBUG_OBJECT(
        self.element, "the frame of %" GST_TIME_FORMAT " is left out: %s, at %" GST_TIME_FORMAT,
        GST_TIME_ARGS(clock_time(frame.begin)),
        unwanted ? "not all can be drawn" : "too late to be used", GST_TIME_ARGS(clock_time(now)));
    if (!unwanted) self.pace.note(frame.begin, frame.end - frame.begin, true);
    pop(background);
  }
}

/// A frame that is sent, or the reason why none is.
struct Made {
  GstBuffer* buffer = nullptr;
  GstFlowReturn flow = GST_FLOW_OK;
  std::optional<unsigned> place = {};  ///< it is still to be taken from there
  std::int64_t duration = 0;
  std::optional<std::uint64_t> newcomer = {};  ///< as Composite::newcomer, of this frame
};

/// Hands on \p buffer, whose reference it takes, and says so if it is the first of a set.
GstFlowReturn hand_on(Composite& self, GstBuffer* buffer, std::optional<std::uint64_t> newcomer) {
  const GstFlowReturn flow = gst_aggregator_finish_buffer(self.element, buffer);
  if (flow == GST_FLOW_OK) self.tell_composited(newcomer);
  return flow;
}

/// Hands on the frame that is held, if there is one.
GstFlowReturn send_held(Composite& self) {
  // The base class takes a refusal to negotiate for the last word.
  if (std::exchange(self.send_held_first, false)) gst_pad_mark_reconfigure(self.element->srcpad);
  g_autoptr(GstBuffer) buffer = g_steal_pointer(&self.held.buffer);
  if (!buffer) return GST_FLOW_OK;
  if (self.composer.take(self.held.place, self.held.info, buffer))
    return hand_on(self, g_steal_pointer(&buffer), std::exchange(self.held.newcomer, {}));
  self.statistics.count("frames-lost");
  return GST_FLOW_OK;
}

/// Hands on what was held, then \p made, or holds that back while OpenGL draws it.
GstFlowReturn send(Composite& self, const Made& made) {
  g_autoptr(GstBuffer) buffer = made.buffer;
  const GstFlowReturn flow = send_held(self);
  if (flow != GST_FLOW_OK) return flow;
  if (!made.place) return hand_on(self, g_steal_pointer(&buffer), made.newcomer);
  const std::int64_t now = self.timing.now();
  self.held = {g_steal_pointer(&buffer), self.output_info, *made.place,
               now == no_time ? no_time : now + made.duration, made.newcomer};
  self.timing.hold(made.duration);
  return GST_FLOW_OK;
}

Made make_frame(Composite& self, const CompositePads& pads, bool live, bool timeout) {
  const Stopwatch watch;
  const WaitingFrame frame = waiting_frame(self, pads.background);
  if (frame.arrival == nullptr)
    return {nullptr, gst_aggregator_pad_is_eos(pads.background) ? GST_FLOW_EOS
                                                                : GST_AGGREGATOR_FLOW_NEED_DATA};
  bool complete = true;
  for (GstAggregatorPad* pad : pads.meshes) complete = catch_up(self, pad, frame, live) && complete;
  const std::int64_t now = self.timing.now();
  const bool due = live && frame.begin != no_time && now != no_time
                       ? now >= frame.begin + self.timing.wait()
                       : timeout;
  if (!complete && !due) {
    GST_LOG_OBJECT(self.element, "the frame of %" GST_TIME_FORMAT " waits for its meshes",
                   GST_TIME_ARGS(clock_time(frame.begin)));
    return {nullptr, GST_AGGREGATOR_FLOW_NEED_DATA};
  }
  const GstClockTime stream_time = frame.arrival->stream_time();
  const GstSegment segment = frame.arrival->segment;
  const bool gap = frame.arrival->gap();
  g_autoptr(GstBuffer) picture = gst_buffer_ref(frame.arrival->buffer);
  pop(pads.background);
  if (gap) return {};
  if (GST_CLOCK_TIME_IS_VALID(stream_time)) {
    gst_object_sync_values(GST_OBJECT(self.element), stream_time);
    for (GstAggregatorPad* pad : pads.meshes) gst_object_sync_values(GST_OBJECT(pad), stream_time);
  }
  const CompositeSettings settings = snapshot(self.element, self.settings);
  std::optional<unsigned> place;
  const std::vector<GstAggregatorPad*> meshes = shown(pads, frame.end, settings.max_mesh_age);
  picture = self.picture.of(g_steal_pointer(&picture));
  GstBuffer* out =
      compose(self, settings, g_steal_pointer(&picture), stream_time, live, meshes, place);
  if (!out) return {nullptr, GST_FLOW_FLUSHING};
  GST_LOG_OBJECT(self.element, "%zu of %zu meshes, %s%s, in %.1f ms: %" GST_PTR_FORMAT,
                 meshes.size(), pads.meshes.size(), self.composer.drawn_by(),
                 complete ? "" : ", without waiting any longer", watch.milliseconds(),
                 printed(out));
  self.statistics.count("frames");
  self.statistics.set("frame-ms", watch.milliseconds());
  self.timing.note_work(watch.seconds());
  if (live && frame.begin != no_time) self.pace.note(frame.begin, frame.end - frame.begin, false);
  self.follow(segment);
  return {out, GST_FLOW_OK, place, frame.end != no_time ? frame.end - frame.begin : 0,
          std::exchange(self.newcomer, {})};
}

}  // namespace

CompositePads::CompositePads(gpointer element) : all(element) {
  for (GstAggregatorPad* pad : all) {
    if (is_mesh_pad(pad)) {
      meshes.push_back(pad);
    } else {
      background = pad;
    }
  }
}

void check_background(const CompositePads& pads) {
  if (pads.background) return;
  throw Error(
      Error::Kind::bad_input,
      "Composite has no background. Link a video source, such as scenesrc, to its pad background.");
}

GstFlowReturn composite_aggregate(GstAggregator* aggregator, gboolean timeout) {
  Composite& self = state_of<Composite>(aggregator);
  return guarded(GST_ELEMENT(self.element), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const CompositePads pads(self.element);
    check_background(pads);
    self.forget_flushed(pads.all, [&self](GstAggregatorPad* pad) {
      if (is_mesh_pad(pad)) state_of<MeshPadState>(pad).forget();
      if (!is_mesh_pad(pad)) gst_clear_buffer(&self.held.buffer);
      if (!is_mesh_pad(pad)) self.composer.forget_motion();
    });
    // It belongs to the segment and the format before.
    if (self.held.buffer && (self.new_segment || self.send_held_first)) return send_held(self);
    const bool live = self.keep_time(snapshot(self.element, self.settings).live());
    if (live) drop_useless(self, pads.background);
    const Made made = make_frame(self, pads, live, timeout);
    if (made.buffer) return send(self, made);
    const bool overdue = live && made.flow == GST_AGGREGATOR_FLOW_NEED_DATA &&
                         !peek(pads.background) && self.held.due != no_time &&
                         self.timing.now() >= self.held.due;
    if (self.held.buffer && (made.flow == GST_FLOW_EOS || made.flow == GST_FLOW_OK || overdue))
      return send_held(self);
    return made.flow;
  });
}

/// A frame is due when the background's is. While none waits there is no deadline: with that of the
/// last frame the base class would ask again and again without a pause.
GstClockTime composite_next_time(GstAggregator* aggregator) {
  Composite& self = state_of<Composite>(aggregator);
  const CompositePads pads(aggregator);
  if (!pads.background) return self.timing.wake_at(0);
  const WaitingFrame frame = waiting_frame(self, pads.background);
  if (frame.arrival == nullptr) {
    if (gst_aggregator_pad_is_eos(pads.background)) return self.timing.wake_at(0);
    const bool held = self.held.buffer && self.held.due != no_time;
    return held ? self.timing.wake_at(self.held.due) : GST_CLOCK_TIME_NONE;
  }
  if (frame.begin == no_time) return self.timing.wake_at(0);
  for (GstAggregatorPad* pad : pads.meshes) {
    const bool waits = peek(pad) == nullptr;
    if (waits && !is_settled(pad, frame, true))
      return self.timing.now() == no_time ? GST_CLOCK_TIME_NONE
                                          : self.timing.wake_at(frame.begin + self.timing.wait());
  }
  return self.timing.wake_at(0);
}

GstFlowReturn composite_flush(GstAggregator* aggregator) {
  state_of<Composite>(aggregator).new_segment = true;
  return GST_FLOW_OK;
}

gboolean composite_start(GstAggregator* aggregator) {
  Composite& self = state_of<Composite>(aggregator);
  self.statistics.reset();
  self.announced = false;
  self.forget_formats();
  self.newcomer.reset();
  self.begin(snapshot(aggregator, self.settings).live());
  return TRUE;
}

gboolean composite_stop(GstAggregator* aggregator) {
  Composite& self = state_of<Composite>(aggregator);
  self.end();
  const CompositePads pads(aggregator);
  for (GstAggregatorPad* pad : pads.meshes) state_of<MeshPadState>(pad).forget();
  gst_clear_buffer(&self.held.buffer);
  self.picture.reset();
  return guarded(GST_ELEMENT_CAST(aggregator), gboolean{FALSE}, [&]() -> gboolean {
    self.gl.release();
    self.composer.reset();
    return TRUE;
  });
}

}  // namespace polyhull::element
