// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/tolerance_control.h"

namespace polyhull::element {

void ToleranceControl::set_stream_rate(int numerator, int denominator) {
  const std::scoped_lock lock(mutex_);
  stream_rate_ =
      numerator > 0 && denominator > 0 ? static_cast<double>(numerator) / denominator : 0.0;
}

void ToleranceControl::observe(GstEvent* qos, double target_rate) {
  GstQOSType type;
  gdouble proportion = 0.0;
  GstClockTimeDiff difference = 0;
  GstClockTime timestamp = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos(qos, &type, &proportion, &difference, &timestamp);
  // A sink that throttles on purpose says nothing about the time there is.
  if (type == GST_QOS_TYPE_THROTTLE || !GST_CLOCK_TIME_IS_VALID(timestamp)) return;
  const std::scoped_lock lock(mutex_);
  double load = proportion;
  if (target_rate > 0.0 && stream_rate_ > 0.0) load *= target_rate / stream_rate_;
  adaptive_.observe(load, static_cast<std::int64_t>(timestamp));
}

double ToleranceControl::tolerance(double base) const {
  const std::scoped_lock lock(mutex_);
  return adaptive_.tolerance(base);
}

void ToleranceControl::reset() {
  const std::scoped_lock lock(mutex_);
  adaptive_.reset();
}

}  // namespace polyhull::element
