// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// triggerstamp: gives each frame of a camera the number of the pulse that it answers to. It stands
/// in the pipeline of a serialtrigger, whose pulses it compares with the frames' times, right behind
/// the camera's source; or, where a capture machine has the camera, behind viewclientsrc, as views
/// carry those times. Frames pass through, with the number (see plugins/common/trigger.h) where
/// exactly one pulse explains them.
#include <gst/base/gstbasetransform.h>

#include <mutex>
#include <optional>

#include "base/error.h"
#include "mesh/view.h"
#include "plugins/common/capture_clock.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/transform.h"
#include "plugins/common/trigger.h"
#include "trigger/frame_matcher.h"
#include "trigger/jitter.h"

GST_DEBUG_CATEGORY_STATIC(triggerstamp_debug);
#define GST_CAT_DEFAULT triggerstamp_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

/// A pulse's frame may be on its way for so long after its window, ns, before `stats` says that the
/// pulse has none.
constexpr std::int64_t patience = GST_SECOND;

struct Settings {
  std::string trigger;
  std::uint64_t delay = 0;
  std::uint64_t window = 15 * GST_MSECOND;

  FrameMatchSettings matching() const {
    return {static_cast<std::int64_t>(delay), static_cast<std::int64_t>(window)};
  }
};

struct TriggerStamp {
  static constexpr char type_name[] = "PolyhullTriggerStamp";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit TriggerStamp(gpointer object) {
    statistics.declare({"frames", "frames-numbered", "frames-unexplained", "frames-repeated",
                        "frames-ambiguous", "frames-untimed", "views-unusable",
                        "pulses-unanswered"});
    for (const char* figure : {"mean-delay-us", "delay-jitter-us"}) statistics.set(figure, 0.0);
    // A frame left out here would be missing from its set.
    gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(object), FALSE);
  }
  GstStructure* statistics_of(gpointer object);

  Settings settings;  // under the object lock

  Statistics statistics{"triggerstamp-stats"};
  std::mutex mutex;                          // protects the following
  std::shared_ptr<const PulseTable> pulses;  // from PAUSED on
  std::optional<FrameMatcher> matcher;       // then, too
  Jitter delays;                             // of the streaming thread, as is the next
  bool views = false;                        // views come, not a camera's frames
  ViewWriter writer;
};

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::trigger>("trigger",
                            "Name of the serialtrigger whose pulses the camera answers to. Empty: "
                            "the only one of the pipeline.",
                            0, 0, Change::when_ready),
      property<&S::delay>(
          "delay",
          "How much later than its pulse a frame's time is at least, in nanoseconds (0 to 10 s): "
          "exposure, readout and transfer, as far as the source's times include them.",
          0, 10.0 * GST_SECOND),
      property<&S::window>("window",
                           "By how much more than the delay a frame's time may be later than its "
                           "pulse, in nanoseconds (0 to 10 s). Keep it below the time between two "
                           "pulses: a frame in the windows of several gets no number.",
                           0, 10.0 * GST_SECOND),
  };
  return table;
}

/// "31.2 ms after a pulse", for messages.
std::string after_pulse(const FrameMatcher::Match& match) {
  if (match.after < 0) return "and no pulse was given before it";
  return fmt::format("and comes {:.1f} ms after one", static_cast<double>(match.after) * 1e-6);
}

void tell(GstElement* element, const FrameMatcher::Match& match, const Settings& settings) {
  Statistics& statistics = state_of<TriggerStamp>(element).statistics;
  const auto milliseconds = [](std::uint64_t time) { return static_cast<double>(time) * 1e-6; };
  const double from = milliseconds(settings.delay);
  const double to = from + milliseconds(settings.window);
  using Kind = FrameMatcher::Kind;
  if (match.kind == Kind::unexplained)
    statistics.warn(
        element, "frames-unexplained",
        fmt::format("A frame answers to no pulse: it has to come {:.1f} to {:.1f} ms after one, "
                    "{}. Look whether the camera waits for the trigger, whether its source gives "
                    "times of the pipeline's clock (do-timestamp=true), and at delay and window.",
                    from, to, after_pulse(match)));
  if (match.kind == Kind::repeated)
    statistics.warn(element, "frames-repeated",
                    fmt::format("Pulse {} has two frames; the second gets no number. Look whether "
                                "the camera waits for the trigger.",
                                match.number));
  if (match.kind == Kind::ambiguous)
    statistics.warn(element, "frames-ambiguous",
                    fmt::format("A frame may answer to several pulses and gets no number: the "
                                "window of {:.1f} ms is longer than the time between two pulses.",
                                to - from));
}

/// Of FrameMatcher::Kind.
constexpr const char* kinds[] = {"numbered", "unexplained", "repeated", "ambiguous"};

/// The number that the frame \p buffer of the pipeline clock's time \p time has earned; no_trigger:
/// none.
std::uint64_t number_of(GstElement* element, GstBuffer* buffer, std::int64_t time) {
  TriggerStamp& self = state_of<TriggerStamp>(element);
  self.statistics.count("frames");
  if (time == no_time) {
    self.statistics.warn(
        element, "frames-untimed",
        self.views ? "A view whose time is not of the pipeline's clock gets no number: its "
                     "camera's own clock stamps it, or nobody does."
                   : "A frame without a time gets no number: give the source do-timestamp=true.");
    GST_LOG_OBJECT(element, "no time, so no number: %" GST_PTR_FORMAT, printed(buffer));
    return no_trigger;
  }
  const Settings settings = snapshot(element, self.settings);
  FrameMatcher::Match match;
  std::uint64_t unanswered = 0;
  {
    const std::scoped_lock lock(self.mutex);
    match = self.matcher->match(*self.pulses, time, settings.matching());
    unanswered = self.matcher->unanswered();
  }
  self.statistics.set_count("pulses-unanswered", unanswered);
  GST_LOG_OBJECT(element, "%s, %.1f ms after pulse %" G_GUINT64_FORMAT ": %" GST_PTR_FORMAT,
                 kinds[static_cast<std::size_t>(match.kind)],
                 1e-6 * static_cast<double>(match.after), guint64{match.number}, printed(buffer));
  if (match.kind != FrameMatcher::Kind::numbered) {
    tell(element, match, settings);
    return no_trigger;
  }
  self.delays.add(match.after);
  self.statistics.count("frames-numbered");
  self.statistics.set("mean-delay-us", self.delays.mean());
  self.statistics.set("delay-jitter-us", self.delays.deviation());
  return match.number;
}

GstFlowReturn stamp(GstBaseTransform* base, GstBuffer* buffer) {
  auto* element = GST_ELEMENT_CAST(base);
  if (state_of<TriggerStamp>(element).views) return GST_FLOW_OK;  // numbered_view() has done it
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const Capture capture = capture_of(element, base->segment, buffer, false);
    // Pulses have the pipeline clock's times. Beside the number stands no time of another clock, and
    // none of the frame's arrival: whoever finds one there takes it for that of the exposure.
    attach_trigger(buffer, number_of(element, buffer, capture.on_pipeline_clock),
                   capture.clock == CaptureClock::pipeline ? capture.time : no_time);
    return GST_FLOW_OK;
  });
}

/// The view in \p in with the number that it has earned. Throws Error for bytes that are no view.
GstBuffer* numbered_view(GstElement* element, GstBuffer* in) {
  const ViewBuffer read(in);
  View view = read.view();
  view.trigger = number_of(element, in, is_pipelines(view.clock) ? view.capture_time : no_time);
  return state_of<TriggerStamp>(element).writer.write(view, read.pixels(), in);
}

/// Views are made anew.
GstFlowReturn prepare_output_buffer(GstBaseTransform* base, GstBuffer* in, GstBuffer** out) {
  auto* element = GST_ELEMENT_CAST(base);
  TriggerStamp& self = state_of<TriggerStamp>(element);
  if (!self.views) return writable_output(base, in, out);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    try {
      *out = numbered_view(element, in);
      return GST_FLOW_OK;
    } catch (const Error& error) {
      self.statistics.warn(element, "views-unusable",
                           fmt::format("A view was left out: {}", error.what()));
      return GST_BASE_TRANSFORM_FLOW_DROPPED;
    }
  });
}

/// Not set_caps(), with which GstBaseTransform refuses frames that come without any caps.
gboolean sink_event(GstBaseTransform* base, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS) {
    GstCaps* caps = nullptr;
    gst_event_parse_caps(event, &caps);
    state_of<TriggerStamp>(base).views =
        gst_structure_has_name(gst_caps_get_structure(caps, 0), view_caps);
  }
  return GST_BASE_TRANSFORM_CLASS(parent_class<TriggerStamp>())->sink_event(base, event);
}

gboolean start(GstBaseTransform* base) {
  TriggerStamp& self = state_of<TriggerStamp>(base);
  auto* element = GST_ELEMENT_CAST(base);
  return guarded(element, gboolean{FALSE}, [&]() -> gboolean {
    auto pulses = find_pulses(element, snapshot(element, self.settings).trigger);
    self.statistics.reset();
    self.delays = Jitter();
    self.views = false;
    const std::scoped_lock lock(self.mutex);
    self.pulses = std::move(pulses);
    self.matcher.emplace(*self.pulses);
    return TRUE;
  });
}

gboolean stop(GstBaseTransform* base) {
  TriggerStamp& self = state_of<TriggerStamp>(base);
  const std::scoped_lock lock(self.mutex);
  self.pulses.reset();
  return TRUE;
}

/// Pulses that no frame came for to tell of are counted, too: a camera may be silent.
GstStructure* TriggerStamp::statistics_of(gpointer object) {
  GstStructure* result = statistics.structure();
  g_autoptr(GstClock) clock = gst_element_get_clock(GST_ELEMENT(object));
  const Settings now = snapshot(object, settings);
  const std::scoped_lock lock(mutex);
  if (clock == nullptr || pulses == nullptr) return result;
  const auto time = static_cast<std::int64_t>(gst_clock_get_time(clock));
  gst_structure_set(result, "pulses-unanswered", G_TYPE_UINT64,
                    guint64{matcher->unanswered(*pulses, time, patience, now.matching())}, nullptr);
  return result;
}

void TriggerStamp::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(triggerstamp_debug, "triggerstamp", 0, "frames and their pulses");
  add_properties<TriggerStamp>(klass, properties(), &TriggerStamp::settings);
  add_statistics<TriggerStamp>(
      klass,
      "Counters since the start: frames, frames-numbered, frames-unexplained (no pulse is theirs), "
      "frames-repeated (their pulse has its frame), frames-ambiguous (several pulses may be "
      "theirs), frames-untimed, views-unusable (left out), pulses-unanswered (their time for a "
      "frame is over); and of the numbered frames mean-delay-us and delay-jitter-us (standard "
      "deviation), by how much later than its pulse a frame's time is.");
  set_metadata(klass, "Trigger stamp", "Filter/Video",
               "Gives each frame the number of the trigger pulse that it answers to");
  add_template(klass, "sink", GST_PAD_SINK, "ANY");
  add_template(klass, "src", GST_PAD_SRC, "ANY");
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->start = start;
  base_class->stop = stop;
  base_class->sink_event = sink_event;
  base_class->before_transform = sync_controlled_properties;
  base_class->prepare_output_buffer = prepare_output_buffer;
  base_class->transform_ip = stamp;
  base_class->passthrough_on_same_caps = FALSE;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(triggerstamp, "triggerstamp", GST_RANK_NONE, type_of<TriggerStamp>())
