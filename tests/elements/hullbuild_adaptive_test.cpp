// SPDX-License-Identifier: LGPL-2.1-or-later
// hullbuild's adaptive: contours become coarser while what follows holds the sets up, whatever the
// sink, and finer again.
#include "support/live_line.h"

#include <functional>

#include "element_checks.h"
#include "support/run_kind.h"

using namespace polyhull::test;

namespace {

const bool in_time = !sanitized();

/// A line whose every set is held up for 170 ms of the 100 that there are, before a sink that never
/// tells of its time.
LiveOptions held_up(const char* hull) {
  LiveOptions options;
  options.rate = 10;
  options.width = 320;
  options.height = 240;
  options.figure = true;
  options.branch = "queue ! silhouette sigma=1 tolerance=.25";
  options.hull = hull;
  options.tail = "identity name=slow sleep-time=170000 ! fakesink sync=false qos=false";
  return options;
}

double hull_figure(const LiveLine& line, const char* name) {
  GstElement* hull = line.element("hull");
  const double value = figure(hull, name);
  gst_object_unref(hull);
  return value;
}

/// Plays on until \p reached, for 20 s at most.
bool play_until(LiveLine& line, const std::function<bool()>& reached) {
  for (int i = 0; i < 100 && !reached(); ++i) line.play(0.2);
  return reached();
}

}  // namespace

ELEMENT_TEST(what_is_held_up_becomes_coarser_and_fine_again) {
  LiveLine line(held_up("adaptive=true"));
  fail_unless(play_until(line, [&] { return line.statistic("hull", "sets") > 0; }));
  fail_unless(!in_time || hull_figure(line, "coarser-px") == 0.0);
  const auto vertices = line.statistic("hull", "contour-vertices");
  fail_unless(vertices > 0);
  fail_unless(play_until(line, [&] { return hull_figure(line, "coarser-px") > 1.9; }));
  fail_unless(!in_time || line.statistic("hull", "contour-vertices") < 3 * vertices / 4, "%d of %d",
              static_cast<int>(line.statistic("hull", "contour-vertices")),
              static_cast<int>(vertices));
  const double coarsest = hull_figure(line, "coarser-px");
  GstElement* slow = line.element("slow");
  g_object_set(slow, "sleep-time", 0, nullptr);
  gst_object_unref(slow);
  fail_unless(!in_time ||
              play_until(line, [&] { return hull_figure(line, "coarser-px") < 0.9 * coarsest; }));
  // Switched off it holds no longer, from the next set on.
  GstElement* hull = line.element("hull");
  g_object_set(hull, "adaptive", FALSE, nullptr);
  gst_object_unref(hull);
  fail_unless(play_until(line, [&] { return hull_figure(line, "coarser-px") == 0.0; }));
}

ELEMENT_TEST(without_adaptive_contours_stay) {
  LiveLine line(held_up(""));
  line.play(3.0);
  fail_unless(hull_figure(line, "coarser-px") == 0.0);
}

/// A sink that keeps the time and says that there is enough of it is believed: that it holds sets
/// until they are due is no load.
ELEMENT_TEST(waiting_for_the_time_is_no_load) {
  LiveOptions options = held_up("adaptive=true");
  options.tail = "fakesink sync=true qos=true ts-offset=300000000";
  LiveLine line(options);
  line.play(4.0);
  fail_unless(line.statistic("hull", "sets") > (in_time ? 5 : 0));
  fail_unless(!in_time || hull_figure(line, "coarser-px") == 0.0, "%g px",
              hull_figure(line, "coarser-px"));
}
