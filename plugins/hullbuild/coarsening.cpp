// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/coarsening.h"

#include <algorithm>
#include <utility>

namespace polyhull::element {
namespace {

/// Of the first step, px: contours are commonly within half a pixel of what was traced.
constexpr double base_tolerance = 0.5;
constexpr std::int64_t word_holds = 2 * GST_SECOND;

}  // namespace

void LoadWatch::hear(GstEvent* event) {
  if (GST_EVENT_TYPE(event) != GST_EVENT_QOS) return;
  GstQOSType type;
  gdouble proportion = 0.0;
  GstClockTimeDiff difference = 0;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos(event, &type, &proportion, &difference, &time);
  if (type == GST_QOS_TYPE_THROTTLE || !GST_CLOCK_TIME_IS_VALID(time)) return;
  const std::scoped_lock lock(mutex_);
  last_word_ = static_cast<std::int64_t>(time);
  adaptive_.observe(proportion, last_word_);
}

void LoadWatch::note(std::int64_t time, std::int64_t busy, std::int64_t interval) {
  if (interval <= 0 || time < 0) return;
  const std::scoped_lock lock(mutex_);
  if (last_word_ != INT64_MIN && time >= last_word_ && time - last_word_ < word_holds) return;
  adaptive_.observe(static_cast<double>(busy) / static_cast<double>(interval), time);
}

double LoadWatch::tolerance() const {
  const std::scoped_lock lock(mutex_);
  return adaptive_.level() == 0 ? 0.0 : adaptive_.tolerance(base_tolerance);
}

void LoadWatch::reset() {
  const std::scoped_lock lock(mutex_);
  adaptive_.reset();
  last_word_ = INT64_MIN;
}

void Coarsener::coarsen(Mesh& mesh, double tolerance) {
  if (!(tolerance > 0.0)) return;
  ApproximateSettings settings;
  settings.tolerance = tolerance;
  settings.min_edges = 3;
  settings.min_area = 0.0;
  for (MeshView& view : mesh.views) {
    Rings& contours = view.view.contours;
    if (contours.empty()) continue;
    const bool sound = approximator_.approximate(contours, {}, settings, rings_);
    if (sound && !rings_.empty() && rings_.points.size() < contours.points.size())
      std::swap(contours, rings_);
  }
}

}  // namespace polyhull::element
