// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// steadystamp: puts a camera's own times onto the pipeline's clock. It stands right behind a live
/// source whose frames' times are even but begin at any time, such as aravissrc's; frames pass
/// through with the time at which they were taken, as near as that can be told
/// (lib/live/steady_times.h).
#include <gst/base/gstbasesrc.h>
#include <gst/base/gstbasetransform.h>

#include <atomic>
#include <string_view>

#include "live/steady_times.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/references.h"
#include "plugins/common/transform.h"

GST_DEBUG_CATEGORY_STATIC(steadystamp_debug);
#define GST_CAT_DEFAULT steadystamp_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Settings {
  std::uint64_t settle = SteadyTimes::Settings{}.settle;
  double drift = 1e6 * SteadyTimes::Settings{}.drift;
};

struct SteadyStamp {
  static constexpr char type_name[] = "PolyhullSteadyStamp";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit SteadyStamp(gpointer object) {
    statistics.declare({"frames", "frames-settling", "frames-untimed", "clock-restarts"});
    for (const char* figure : {"delay-ms", "held-up-ms"}) statistics.set(figure, 0.0);
    // A frame left out here would be missing from its set.
    gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(object), FALSE);
  }
  GstStructure* statistics_of(gpointer) { return statistics.structure(); }

  Settings settings;  // under the object lock
  Statistics statistics{"steadystamp-stats"};
  std::atomic<bool> flushed{false};
  SteadyTimes times;  // of the streaming thread
};

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::settle>(
          "settle",
          "How long frames are only looked at after the camera's start, in nanoseconds (0 to 10 "
          "s): of them the quickest says how late frames come. They are dropped.",
          0, 10.0 * GST_SECOND),
      property<&S::drift>("drift",
                          "By how many millionths the pipeline's clock may run faster than the "
                          "camera's (0 to 10000). A slower one is followed at once.",
                          0.0, 1e4),
  };
  return table;
}

GstFlowReturn place(GstBaseTransform* base, GstBuffer* buffer) {
  auto* element = GST_ELEMENT_CAST(base);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    SteadyStamp& self = state_of<SteadyStamp>(element);
    const Settings settings = snapshot(element, self.settings);
    self.statistics.count("frames");
    const GstClockTime time =
        gst_segment_to_running_time(&base->segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
    const GstClockTime now = gst_element_get_current_running_time(element);
    constexpr auto most = static_cast<GstClockTime>(G_MAXINT64 / 4);
    if (base->segment.format != GST_FORMAT_TIME || !GST_CLOCK_TIME_IS_VALID(time) || time > most ||
        !GST_CLOCK_TIME_IS_VALID(now) || now > most) {
      self.statistics.warn(element, "frames-untimed",
                           "A frame passes as it is: it has no time, or the pipeline has no clock. "
                           "The source must give its frames the camera's times, and be live.");
      return GST_FLOW_OK;
    }
    if (self.flushed.exchange(false)) self.times.reset();
    const std::uint64_t restarts = self.times.restarts();
    const auto placed =
        self.times.place(static_cast<std::int64_t>(time), static_cast<std::int64_t>(now),
                         {static_cast<std::int64_t>(settings.settle), 1e-6 * settings.drift});
    if (self.times.restarts() != restarts)
      self.statistics.warn(
          element, "clock-restarts",
          "The camera's times have begun anew, so how late its frames come is learned again. Look "
          "whether the camera was started again, or its clock was set.");
    self.statistics.set("delay-ms", 1e-6 * static_cast<double>(self.times.delay()));
    if (!placed) {
      self.statistics.count("frames-settling");
      GST_LOG_OBJECT(base, "dropped while the delay is learned, now %.1f ms: %" GST_PTR_FORMAT,
                     1e-6 * static_cast<double>(self.times.delay()), printed(buffer));
      return GST_BASE_TRANSFORM_FLOW_DROPPED;
    }
    self.statistics.set("held-up-ms", 1e-6 * static_cast<double>(placed->held_up));
    GST_LOG_OBJECT(base, "was taken at running time %" GST_TIME_FORMAT ": %" GST_PTR_FORMAT,
                   GST_TIME_ARGS(clock_time(placed->time)), printed(buffer));
    GST_BUFFER_PTS(buffer) = gst_segment_position_from_running_time(
        &base->segment, GST_FORMAT_TIME,
        static_cast<guint64>(std::max<std::int64_t>(0, placed->time)));
    GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
    return GST_FLOW_OK;
  });
}

gboolean start(GstBaseTransform* base) {
  SteadyStamp& self = state_of<SteadyStamp>(base);
  self.statistics.reset();
  self.times = SteadyTimes();
  self.flushed = false;
  return TRUE;
}

/// The source in front, also through elements of one input and out of bins; null where it is none that
/// makes its frames itself.
Ref<GstElement> source_of(GstElement* element) {
  Ref<GstElement> found(GST_ELEMENT(gst_object_ref(element)));
  while (found && !GST_IS_BASE_SRC(found.get())) {
    const Ref<GstPad> sink(gst_element_get_static_pad(found.get(), "sink"));
    Ref<GstPad> peer(sink ? gst_pad_get_peer(sink.get()) : nullptr);
    while (peer && GST_IS_GHOST_PAD(peer.get()))
      peer.reset(gst_ghost_pad_get_target(GST_GHOST_PAD(peer.get())));
    found.reset(peer ? gst_pad_get_parent_element(peer.get()) : nullptr);
  }
  return found;
}

/// Lets aravissrc send each frame as soon as it has come. By its clock it would keep frames until
/// their distance to the first one is over: where that one came late, as when a camera is started on a
/// busy machine, all would come as late, and the least delay would say nothing.
void send_at_once(GstElement* element) {
  const Ref<GstElement> source = source_of(element);
  GstElementFactory* factory = source ? gst_element_get_factory(source.get()) : nullptr;
  if (factory == nullptr || GST_OBJECT_NAME(factory) != std::string_view("aravissrc") ||
      gst_base_src_get_do_timestamp(GST_BASE_SRC(source.get())))
    return;
  GST_DEBUG_OBJECT(element, "takes the clock from %" GST_PTR_FORMAT, source.get());
  gst_element_set_clock(source.get(), nullptr);
}

/// The pipeline has given all its elements the clock, and a live source begins to send after this.
GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  if (transition == GST_STATE_CHANGE_PAUSED_TO_PLAYING) send_at_once(element);
  return GST_ELEMENT_CLASS(parent_class<SteadyStamp>())->change_state(element, transition);
}

gboolean sink_event(GstBaseTransform* base, GstEvent* event) {
  SteadyStamp& self = state_of<SteadyStamp>(base);
  // Of a source that was put before an element that plays already.
  if (GST_EVENT_TYPE(event) == GST_EVENT_STREAM_START) send_at_once(GST_ELEMENT(base));
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP) self.flushed = true;
  return GST_BASE_TRANSFORM_CLASS(parent_class<SteadyStamp>())->sink_event(base, event);
}

void SteadyStamp::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(steadystamp_debug, "steadystamp", 0, "cameras' times");
  add_properties<SteadyStamp>(klass, properties(), &SteadyStamp::settings);
  add_statistics<SteadyStamp>(
      klass,
      "Counters since the start: frames, frames-settling (dropped while the delay was learned), "
      "frames-untimed (passed as they came), clock-restarts; and delay-ms, by how much the "
      "pipeline's running time is ahead of the camera's times, held-up-ms, by how much later than "
      "the quickest the last frame came.");
  set_metadata(klass, "Steady stamp", "Filter/Video",
               "Puts a camera's own times onto the pipeline's clock");
  add_template(klass, "sink", GST_PAD_SINK, "ANY");
  add_template(klass, "src", GST_PAD_SRC, "ANY");
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->start = start;
  base_class->sink_event = sink_event;
  base_class->before_transform = sync_controlled_properties;
  base_class->prepare_output_buffer = writable_output;
  base_class->transform_ip = place;
  base_class->passthrough_on_same_caps = FALSE;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(steadystamp, "steadystamp", GST_RANK_NONE, type_of<SteadyStamp>())
