// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// serialtrigger: gives trigger pulses to cameras over a serial device, at a rate on the pipeline's
/// clock or on demand. It has no pads: it stands beside the sources in their pipeline and works
/// while that plays. Each pulse has a number, counted from 0 since READY, and is announced by an
/// element message "polyhull-trigger" with the fields number, clock-time, running-time and lateness
/// (nanoseconds).
///
/// Properties that matter: `device`; `mode`, the line that carries the pulse; `rate`, 0/1 for
/// pulses on demand by the action signal `fire`; `pulse`, its length.
///
/// gst-launch-1.0 -m serialtrigger device=/dev/ttyUSB0 rate=15/1 pulse=2000000 mode=break
#include "plugins/serialtrigger/serialtrigger.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>

#include "base/error.h"
#include "plugins/common/guard.h"
#include "plugins/common/property_table.h"
#include "plugins/common/statistics.h"
#include "plugins/serialtrigger/pulse_thread.h"

GST_DEBUG_CATEGORY_STATIC(serialtrigger_debug);
#define GST_CAT_DEFAULT serialtrigger_debug

namespace polyhull::element {

template <>
GType enum_type<PulseMode>() {
  static const GEnumValue values[] = {
      {static_cast<gint>(PulseMode::zeros), "Zero bytes hold the line TX for at least the pulse",
       "zeros"},
      {static_cast<gint>(PulseMode::line_break), "The break condition holds the line TX", "break"},
      {static_cast<gint>(PulseMode::rts), "The line RTS", "rts"},
      {static_cast<gint>(PulseMode::dtr), "The line DTR", "dtr"},
      {0, nullptr, nullptr}};
  static const GType type = register_enum("PolyhullPulseMode", values);
  return type;
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
};

constexpr int default_rate = 15;

/// Mean and spread of how late pulses begin (Welford's method).
class Jitter {
 public:
  void add(std::int64_t lateness) {
    const double x = lateness * 1e-3;
    ++count_;
    const double step = x - mean_;
    mean_ += step / count_;
    squares_ += step * (x - mean_);
    largest_ = std::max(largest_, std::abs(x));
  }
  double mean() const { return mean_; }
  double deviation() const { return count_ > 1 ? std::sqrt(squares_ / (count_ - 1)) : 0.0; }
  double largest() const { return largest_; }

 private:
  double count_ = 0.0, mean_ = 0.0, squares_ = 0.0, largest_ = 0.0;  // microseconds
};

struct Private {
  Settings settings;  // under the object lock, like the rate
  int rate_numerator = default_rate;
  int rate_denominator = 1;

  Statistics statistics{"serialtrigger-stats"};
  Jitter jitter;                     // the pulse thread's
  std::unique_ptr<SerialLine> line;  // open between READY and PLAYING; changes of state only
  std::uint64_t next_number = 0;
  GstClockTime base_time = 0;
  std::mutex thread_mutex;              // protects the following pointer, not the thread's work
  std::unique_ptr<PulseThread> thread;  // while PLAYING
};

struct PolyhullSerialTrigger {
  GstElement parent;
  Private* priv;
};

struct PolyhullSerialTriggerClass {
  GstElementClass parent_class;
};

enum { first_setting = 1 };
guint rate_id;
guint stats_id;
guint fire_signal;

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::device>("device", "Device",
                           "Path of the serial device that the cameras' trigger inputs hang on.", 0,
                           0, Change::when_ready),
      property<&S::mode>("mode", "Mode", "Which line of the device carries the pulse, and how.", 0,
                         0, Change::when_ready),
      property<&S::baud>("baud", "Baud rate",
                         "Bits per second of the device (300 to 921600, the usual steps). With "
                         "mode=zeros a pulse takes whole bytes of ten bits each.",
                         300, 921600, Change::when_ready),
      property<&S::pulse>(
          "pulse", "Pulse length",
          "How long a pulse lasts, in nanoseconds (1 ms to 1 s). It must fit between "
          "two pulses with a millisecond to spare.",
          GST_MSECOND, GST_SECOND),
  };
  return table;
}

GType polyhull_serial_trigger_get_type();
G_DEFINE_TYPE(PolyhullSerialTrigger, polyhull_serial_trigger, GST_TYPE_ELEMENT)

PolyhullSerialTrigger* self_of(gpointer object) {
  return static_cast<PolyhullSerialTrigger*>(object);
}

PulseParameters parameters_of(PolyhullSerialTrigger* self) {
  Private& priv = *self->priv;
  GST_OBJECT_LOCK(self);
  PulseParameters parameters{priv.settings.device,  priv.settings.baud,
                             priv.settings.mode,    priv.rate_numerator,
                             priv.rate_denominator, static_cast<std::int64_t>(priv.settings.pulse)};
  GST_OBJECT_UNLOCK(self);
  return parameters;
}

/// A change while playing: taken over where it fits, otherwise a warning and the former pulses go
/// on.
void pass_on(PolyhullSerialTrigger* self) {
  Private& priv = *self->priv;
  std::string refused;
  {
    const std::scoped_lock lock(priv.thread_mutex);
    if (priv.thread == nullptr) return;
    const PulseParameters parameters = parameters_of(self);
    try {
      parameters.check();
      priv.thread->set(parameters);
    } catch (const Error& error) {
      refused = error.what();
    }
  }
  // Without the lock: a synchronous bus handler may set properties.
  if (!refused.empty()) {
    priv.statistics.warn(GST_ELEMENT_CAST(self), "changes-refused",
                         "The pulses go on as they were: " + refused);
  }
}

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  PolyhullSerialTrigger* self = self_of(object);
  if (id == rate_id) {
    GST_OBJECT_LOCK(self);
    self->priv->rate_numerator = gst_value_get_fraction_numerator(value);
    self->priv->rate_denominator = gst_value_get_fraction_denominator(value);
    GST_OBJECT_UNLOCK(self);
  } else if (!set_property(object, properties(), first_setting, self->priv->settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
    return;
  }
  pass_on(self);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (id == stats_id) {
    g_value_take_boxed(value, priv.statistics.structure());
  } else if (id == rate_id) {
    GST_OBJECT_LOCK(object);
    gst_value_set_fraction(value, priv.rate_numerator, priv.rate_denominator);
    GST_OBJECT_UNLOCK(object);
  } else if (!get_property(object, properties(), first_setting, priv.settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

void fire(PolyhullSerialTrigger* self) {
  const std::scoped_lock lock(self->priv->thread_mutex);
  if (self->priv->thread != nullptr) self->priv->thread->fire();
}

// ---- called on the pulse thread

void announce(PolyhullSerialTrigger* self, const Pulse& pulse) {
  Private& priv = *self->priv;
  priv.jitter.add(pulse.lateness);
  priv.statistics.count("pulses");
  priv.statistics.set("mean-lateness-us", priv.jitter.mean());
  priv.statistics.set("jitter-us", priv.jitter.deviation());
  priv.statistics.set("largest-lateness-us", priv.jitter.largest());
  const auto time = static_cast<guint64>(pulse.time);
  gst_element_post_message(
      GST_ELEMENT_CAST(self),
      gst_message_new_element(
          GST_OBJECT(self),
          gst_structure_new("polyhull-trigger", "number", G_TYPE_UINT64,
                            static_cast<guint64>(pulse.number), "clock-time", G_TYPE_UINT64, time,
                            "running-time", G_TYPE_UINT64,
                            time > priv.base_time ? time - priv.base_time : guint64{0}, "lateness",
                            G_TYPE_INT64, static_cast<gint64>(pulse.lateness), nullptr)));
}

PulseListener listener_of(PolyhullSerialTrigger* self) {
  Private& priv = *self->priv;
  const std::string device = snapshot(self, priv.settings).device;
  GstElement* element = GST_ELEMENT_CAST(self);
  return {[self](const Pulse& pulse) { announce(self, pulse); },
          [&priv](std::uint64_t count) { priv.statistics.count("pulses-skipped", count); },
          [&priv, element, device] {
            priv.statistics.warn(element, "pulses-blocked",
                                 "The serial device \"" + device +
                                     "\" takes no bytes: a pulse was not given. Is a handshake "
                                     "waiting, or nobody reading?");
          },
          [&priv, element, device](const std::string& why) {
            priv.statistics.warn(element, "device-losses",
                                 "The serial device \"" + device + "\" does not answer: " + why +
                                     ". It is tried again until it does.");
          },
          [&priv] { priv.statistics.count("device-returns"); }};
}

// ---- states

gboolean open_line(PolyhullSerialTrigger* self) {
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), gboolean{FALSE}, [&]() -> gboolean {
    const PulseParameters parameters = parameters_of(self);
    parameters.check();
    priv.line = std::make_unique<SerialLine>(parameters.device, parameters.baud, parameters.mode);
    priv.statistics.reset();
    priv.jitter = Jitter();
    priv.next_number = 0;
    return TRUE;
  });
}

gboolean start_pulses(PolyhullSerialTrigger* self) {
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), gboolean{FALSE}, [&]() -> gboolean {
    const PulseParameters parameters = parameters_of(self);
    parameters.check();
    GstClock* clock = gst_element_get_clock(GST_ELEMENT_CAST(self));
    if (clock == nullptr) clock = gst_system_clock_obtain();
    priv.base_time = gst_element_get_base_time(GST_ELEMENT_CAST(self));
    const std::scoped_lock lock(priv.thread_mutex);
    priv.thread = std::make_unique<PulseThread>(std::move(priv.line), parameters, clock,
                                                priv.next_number, listener_of(self));
    gst_object_unref(clock);
    priv.statistics.set_count("real-time", priv.thread->real_time());
    if (!priv.thread->real_time())
      GST_INFO_OBJECT(self,
                      "no real-time scheduling: pulses may come late under load. Allow it with "
                      "an rtprio limit or CAP_SYS_NICE");
    return TRUE;
  });
}

void stop_pulses(PolyhullSerialTrigger* self) {
  Private& priv = *self->priv;
  std::unique_ptr<PulseThread> thread;
  {
    const std::scoped_lock lock(priv.thread_mutex);
    thread = std::move(priv.thread);
  }
  if (thread != nullptr) priv.line = thread->stop(priv.next_number);
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  PolyhullSerialTrigger* self = self_of(element);
  if (transition == GST_STATE_CHANGE_NULL_TO_READY && !open_line(self))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_PAUSED_TO_PLAYING && !start_pulses(self))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_PLAYING_TO_PAUSED) stop_pulses(self);
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(polyhull_serial_trigger_parent_class)->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_READY_TO_NULL) self->priv->line.reset();
  return result;
}

void polyhull_serial_trigger_init(PolyhullSerialTrigger* self) {
  self->priv = new Private;
  self->priv->statistics.declare({"pulses", "pulses-skipped", "pulses-blocked", "device-losses",
                                  "device-returns", "changes-refused", "real-time"});
  for (const char* figure : {"mean-lateness-us", "jitter-us", "largest-lateness-us"})
    self->priv->statistics.set(figure, 0.0);
}

void finalize(GObject* object) {
  stop_pulses(self_of(object));
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_serial_trigger_parent_class)->finalize(object);
}

void install_all_properties(GObjectClass* klass) {
  rate_id = install_properties(klass, properties(), first_setting);
  g_object_class_install_property(
      klass, rate_id,
      gst_param_spec_fraction("rate", "Rate",
                              "Pulses per second as a fraction (0/1 to 1000/1); 0/1 gives pulses "
                              "only on demand, by the "
                              "action signal fire.",
                              0, 1, 1000, 1, default_rate, 1,
                              static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS |
                                                       GST_PARAM_MUTABLE_PLAYING)));
  stats_id = rate_id + 1;
  g_object_class_install_property(
      klass, stats_id,
      statistics_property("Counters since READY: pulses, pulses-skipped (their time had passed), "
                          "pulses-blocked (the "
                          "device took no bytes), device-losses, device-returns, changes-refused; "
                          "real-time is 1 if "
                          "the system granted real-time scheduling; mean-lateness-us, jitter-us "
                          "(standard deviation) "
                          "and largest-lateness-us of the pulses' starts."));
}

void polyhull_serial_trigger_class_init(PolyhullSerialTriggerClass* klass) {
  GST_DEBUG_CATEGORY_INIT(serialtrigger_debug, "serialtrigger", 0, "trigger pulses");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  install_all_properties(object_class);
  fire_signal =
      g_signal_new_class_handler("fire", G_TYPE_FROM_CLASS(klass),
                                 static_cast<GSignalFlags>(G_SIGNAL_RUN_LAST | G_SIGNAL_ACTION),
                                 G_CALLBACK(fire), nullptr, nullptr, nullptr, G_TYPE_NONE, 0);
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(
      element_class, "Serial trigger", "Generic/Hardware",
      "Gives numbered trigger pulses to cameras over a serial device", "polyhull");
  element_class->change_state = change_state;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(serialtrigger, "serialtrigger", GST_RANK_NONE,
                            polyhull_serial_trigger_get_type())
