// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// serialtrigger: gives trigger pulses to cameras over a serial device, at a rate on the pipeline's
/// clock, on demand, or when the last set has been shown. It has no pads: it stands beside the
/// sources in their pipeline and works while that plays. Each pulse has a number, counted from 0
/// since READY, which triggerstamp gives to the frames that answer it, and is announced by an
/// element message "polyhull-trigger" with the fields number, clock-time, running-time and lateness
/// (nanoseconds).
#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>

#include "base/error.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/trigger.h"
#include "plugins/serialtrigger/set_listener.h"
#include "trigger/jitter.h"
#include "trigger/pulse_thread.h"

GST_DEBUG_CATEGORY_STATIC(serialtrigger_debug);
#define GST_CAT_DEFAULT serialtrigger_debug

namespace polyhull::element {

/// What a pulse is given for.
enum class FireOn { rate, composited };

template <>
GType enum_type<PulseMode>() {
  return register_enum<PulseMode>(
      "PolyhullPulseMode",
      {{PulseMode::zeros, "Zero bytes hold the line TX for at least the pulse", "zeros"},
       {PulseMode::line_break, "The break condition holds the line TX", "break"},
       {PulseMode::rts, "The line RTS", "rts"},
       {PulseMode::dtr, "The line DTR", "dtr"}});
}

template <>
GType enum_type<FireOn>() {
  return register_enum<FireOn>(
      "PolyhullFireOn",
      {{FireOn::rate, "The rate's time has come, or a pulse is demanded", "rate"},
       {FireOn::composited, "The last set has left the element listen-to", "composited"}});
}

}  // namespace polyhull::element

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Settings {
  std::string device = "/dev/ttyS0";
  PulseMode mode = PulseMode::zeros;
  std::uint32_t baud = 9600;
  std::uint64_t pulse = 2 * GST_MSECOND;
  Fraction rate{15, 1};
  FireOn fire_on = FireOn::rate;
  std::string listen_to;
  std::uint64_t timeout = GST_SECOND;
};

struct SerialTrigger {
  static constexpr char type_name[] = "PolyhullSerialTrigger";
  static GType base_type() { return GST_TYPE_ELEMENT; }
  static void class_init(gpointer klass);

  explicit SerialTrigger(gpointer object) {
    statistics.declare({"pulses", "pulses-skipped", "pulses-blocked", "timeouts", "device-losses",
                        "device-returns", "changes-refused", "real-time"});
    for (const char* figure :
         {"mean-lateness-us", "jitter-us", "p99-lateness-us", "largest-lateness-us"})
      statistics.set(figure, 0.0);
    publish_pulses(GST_ELEMENT(object), pulses);
  }
  ~SerialTrigger() { stop_pulses(); }
  void property_set(gpointer element, std::string_view name);
  void stop_pulses();

  Settings settings;  // under the object lock

  Statistics statistics{"serialtrigger-stats"};
  const std::shared_ptr<PulseTable> pulses = std::make_shared<PulseTable>();
  SetListener listener;              // between PAUSED and PLAYING; changes of state only
  Jitter jitter;                     // the pulse thread's
  std::unique_ptr<SerialLine> line;  // open between READY and PLAYING; changes of state only
  std::uint64_t next_number = 0;
  GstClockTime base_time = 0;
  std::mutex thread_mutex;              // protects the following pointer, not the thread's work
  std::unique_ptr<PulseThread> thread;  // while PLAYING
};

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::device>("device",
                           "Path of the serial device that the cameras' trigger inputs hang on.", 0,
                           0, Change::when_ready),
      property<&S::mode>("mode", "Which line of the device carries the pulse, and how.", 0, 0,
                         Change::when_ready),
      property<&S::baud>("baud",
                         "Bits per second of the device (300 to 921600, the usual steps). With "
                         "mode=zeros a pulse takes whole bytes of ten bits each.",
                         300, 921600, Change::when_ready),
      property<&S::pulse>("pulse",
                          "How long a pulse lasts, in nanoseconds (1 ms to 1 s). It must fit "
                          "between two pulses with a millisecond to spare.",
                          GST_MSECOND, GST_SECOND),
      property<&S::rate>("rate",
                         "Pulses per second as a fraction (0/1 to 1000/1); 0/1 gives pulses only "
                         "on demand, by the action signal fire or the event polyhull-fire. With "
                         "fire-on=composited the highest rate; 0/1 sets none.",
                         0, 1000),
      property<&S::fire_on>("fire-on", "What a pulse is given for.", 0, 0, Change::when_ready),
      property<&S::listen_to>("listen-to",
                              "With fire-on=composited, name of the element that the last set "
                              "leaves: a composite, or any other, each of whose buffers is taken "
                              "for a set. Empty: the only composite of the pipeline.",
                              0, 0, Change::when_ready),
      property<&S::timeout>(
          "timeout",
          "With fire-on=composited, a pulse is given without a set where none has left for so many "
          "nanoseconds (1 ms to 1000 s) since the last pulse, as after a lost frame.",
          GST_MSECOND, 1000.0 * GST_SECOND),
  };
  return table;
}

PulseParameters parameters_of(gpointer element) {
  const Settings settings = snapshot(element, state_of<SerialTrigger>(element).settings);
  return {settings.device,
          settings.baud,
          settings.mode,
          settings.rate.numerator,
          settings.rate.denominator,
          static_cast<std::int64_t>(settings.pulse),
          settings.fire_on == FireOn::composited,
          static_cast<std::int64_t>(settings.timeout)};
}

/// A change while playing: taken over where it fits, otherwise a warning and the former pulses go
/// on.
void SerialTrigger::property_set(gpointer element, std::string_view) {
  std::string refused;
  {
    const std::scoped_lock lock(thread_mutex);
    if (thread == nullptr) return;
    const PulseParameters parameters = parameters_of(element);
    try {
      parameters.check();
      thread->set(parameters);
    } catch (const Error& error) {
      refused = error.what();
    }
  }
  // Without the lock: a synchronous bus handler may set properties.
  if (!refused.empty())
    statistics.warn(GST_ELEMENT_CAST(element), "changes-refused",
                    fmt::format("The pulses go on as they were: {}", refused));
}

void fire(GstElement* element) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  const std::scoped_lock lock(self.thread_mutex);
  if (self.thread != nullptr) self.thread->fire();
}

/// The event polyhull-fire does what the action signal fire does, in languages without signals.
gboolean send_event(GstElement* element, GstEvent* event) {
  if (!gst_event_has_name(event, "polyhull-fire"))
    return GST_ELEMENT_CLASS(parent_class<SerialTrigger>())->send_event(element, event);
  gst_event_unref(event);
  fire(element);
  return TRUE;
}

// ---- called on the pulse thread

void announce(GstElement* element, const Pulse& pulse) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  self.jitter.add(pulse.lateness);
  self.statistics.count("pulses");
  self.statistics.set("mean-lateness-us", self.jitter.mean());
  self.statistics.set("jitter-us", self.jitter.deviation());
  self.statistics.set("p99-lateness-us", self.jitter.p99());
  self.statistics.set("largest-lateness-us", self.jitter.largest());
  const auto time = static_cast<guint64>(pulse.time);
  GST_LOG_OBJECT(
      element, "pulse %" G_GUINT64_FORMAT " at the clock's %" GST_TIME_FORMAT ", %.1f us late",
      guint64{pulse.number}, GST_TIME_ARGS(time), 1e-3 * static_cast<double>(pulse.lateness));
  gst_element_post_message(
      element,
      gst_message_new_element(
          GST_OBJECT(element),
          gst_structure_new("polyhull-trigger", "number", G_TYPE_UINT64,
                            static_cast<guint64>(pulse.number), "clock-time", G_TYPE_UINT64, time,
                            "running-time", G_TYPE_UINT64,
                            time > self.base_time ? time - self.base_time : guint64{0}, "lateness",
                            G_TYPE_INT64, static_cast<gint64>(pulse.lateness), nullptr)));
}

PulseListener listener_of(GstElement* element) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  const std::string device = snapshot(element, self.settings).device;
  return {[&self](const Pulse& pulse) { self.pulses->add(pulse); },
          [&self] { self.pulses->withdraw(); },
          [element](const Pulse& pulse) { announce(element, pulse); },
          [&self, element] {
            GST_DEBUG_OBJECT(element, "no set has come in time: a pulse is given without one");
            self.statistics.count("timeouts");
          },
          [&self, element](std::uint64_t count) {
            GST_DEBUG_OBJECT(element, "%" G_GUINT64_FORMAT " pulses are skipped as too late",
                             guint64{count});
            self.statistics.count("pulses-skipped", count);
          },
          [&self, element, device] {
            self.statistics.warn(
                element, "pulses-blocked",
                fmt::format("The serial device '{}' takes no bytes: a pulse was not given. Look "
                            "whether a handshake waits, or nobody reads.",
                            device));
          },
          [&self, element, device](const std::string& why) {
            self.statistics.warn(element, "device-losses",
                                 fmt::format("The serial device '{}' does not answer: {}. Plug it "
                                             "in again: it is tried until it answers.",
                                             device, why));
          },
          [&self] { self.statistics.count("device-returns"); }};
}

// ---- states

gboolean open_line(GstElement* element) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  return guarded(element, gboolean{FALSE}, [&]() -> gboolean {
    const PulseParameters parameters = parameters_of(element);
    parameters.check();
    self.line = std::make_unique<SerialLine>(parameters.device, parameters.baud, parameters.mode);
    self.statistics.reset();
    self.jitter = Jitter();
    self.next_number = 0;
    self.pulses->begin_round();
    return TRUE;
  });
}

/// With fire-on=composited: hears of sets from now on.
gboolean listen(GstElement* element) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  return guarded(element, gboolean{FALSE}, [&]() -> gboolean {
    const Settings settings = snapshot(element, self.settings);
    if (settings.fire_on == FireOn::composited)
      self.listener.start(element, settings.listen_to, [element] { fire(element); });
    return TRUE;
  });
}

gboolean start_pulses(GstElement* element) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  return guarded(element, gboolean{FALSE}, [&]() -> gboolean {
    const PulseParameters parameters = parameters_of(element);
    parameters.check();
    g_autoptr(GstClock) clock = gst_element_get_clock(element);
    if (clock == nullptr) clock = gst_system_clock_obtain();
    self.base_time = gst_element_get_base_time(element);
    const std::scoped_lock lock(self.thread_mutex);
    const std::shared_ptr<GstClock> held(g_steal_pointer(&clock), gst_object_unref);
    self.thread = std::make_unique<PulseThread>(
        std::move(self.line), parameters,
        [held] { return static_cast<std::int64_t>(gst_clock_get_time(held.get())); },
        self.next_number, listener_of(element));
    self.statistics.set_count("real-time", self.thread->real_time());
    if (!self.thread->real_time())
      GST_INFO_OBJECT(element,
                      "no real-time scheduling: pulses may come late under load. Allow it with an "
                      "rtprio limit or CAP_SYS_NICE");
    return TRUE;
  });
}

void SerialTrigger::stop_pulses() {
  std::unique_ptr<PulseThread> stopped;
  {
    const std::scoped_lock lock(thread_mutex);
    stopped = std::move(thread);
  }
  if (stopped != nullptr) line = stopped->stop(next_number);
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  SerialTrigger& self = state_of<SerialTrigger>(element);
  if (transition == GST_STATE_CHANGE_NULL_TO_READY && !open_line(element))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !listen(element))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_PAUSED_TO_PLAYING && !start_pulses(element))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_PLAYING_TO_PAUSED) self.stop_pulses();
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<SerialTrigger>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) self.listener.stop();
  if (transition == GST_STATE_CHANGE_READY_TO_NULL) self.line.reset();
  return result;
}

void SerialTrigger::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(serialtrigger_debug, "serialtrigger", 0, "trigger pulses");
  add_properties<SerialTrigger>(klass, properties(), &SerialTrigger::settings);
  add_statistics<SerialTrigger>(
      klass,
      "Counters since READY: pulses, pulses-skipped (their time had passed), pulses-blocked (the "
      "device took no bytes), timeouts (pulses of fire-on=composited that no set brought, besides "
      "the first), device-losses, device-returns, changes-refused; real-time is 1 if the system "
      "granted real-time scheduling; mean-lateness-us, jitter-us (standard deviation), "
      "p99-lateness-us (of the last 1000, 99 in 100 began less early or late) and "
      "largest-lateness-us of the pulses' starts.");
  g_signal_new_class_handler("fire", G_TYPE_FROM_CLASS(klass),
                             static_cast<GSignalFlags>(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
                             G_CALLBACK(fire), nullptr, nullptr, nullptr, G_TYPE_NONE, 0);
  set_metadata(klass, "Serial trigger", "Generic/Hardware",
               "Gives numbered trigger pulses to cameras over a serial device");
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  GST_ELEMENT_CLASS(klass)->send_event = send_event;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(serialtrigger, "serialtrigger", GST_RANK_NONE, type_of<SerialTrigger>())
