// SPDX-License-Identifier: LGPL-2.1-or-later
// Cameras whose frames are timed as v4l2src times them (gst-plugins-good 1.22, gstv4l2src.c,
// create()): no V4L2 device, but live pictures with such times.
//  - Where the driver gives times, a frame has the driver's on the pipeline's clock: here with half a
//    millisecond of noise, and off by the exposure, as drivers stamp its end or its begin.
//  - Where it gives none, the time of the frame's arrival less a frame's duration.
//  - Offsets are the driver's sequence numbers, which start anywhere and leap where frames were lost;
//    they are no trigger's.
// Which instants the sets show is read from the pictures.
#include "support/live_line.h"

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "element_test.h"

using namespace polyhull::test;

namespace {

struct Driver {
  bool gives_times = true;
  double late = 0.0;    ///< ms, of its times; of the arrival where it gives none
  double spread = 0.5;  ///< ms, to both sides
  int lost = 0;         ///< frames of a thousand
  guint64 sequence = 0;
  std::mt19937 random{1};
};

/// A camera's frame as its driver and v4l2src give it.
GstPadProbeReturn time_frame(GstPad*, GstPadProbeInfo* info, gpointer data) {
  Driver& driver = *static_cast<Driver*>(data);
  ++driver.sequence;
  if (static_cast<int>(driver.random() % 1000) < driver.lost) return GST_PAD_PROBE_DROP;
  GstBuffer* buffer = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));
  GST_PAD_PROBE_INFO_DATA(info) = buffer;
  // Nothing but the buffer's own time, as from v4l2src.
  gst_buffer_foreach_meta(
      buffer,
      [](GstBuffer*, GstMeta** meta, gpointer) -> gboolean {
        if ((*meta)->info->api == GST_REFERENCE_TIMESTAMP_META_API_TYPE) *meta = nullptr;
        return TRUE;
      },
      nullptr);
  const double noise = std::uniform_real_distribution(-1.0, 1.0)(driver.random) * driver.spread;
  GstClockTimeDiff time = static_cast<GstClockTimeDiff>(GST_BUFFER_PTS(buffer)) +
                          static_cast<GstClockTimeDiff>((driver.late + noise) * GST_MSECOND);
  if (!driver.gives_times) time -= static_cast<GstClockTimeDiff>(GST_BUFFER_DURATION(buffer));
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(std::max<GstClockTimeDiff>(time, 0));
  GST_BUFFER_OFFSET(buffer) = driver.sequence;
  GST_BUFFER_OFFSET_END(buffer) = driver.sequence + 1;
  return GST_PAD_PROBE_OK;
}

/// Cameras of one trigger line on a live line, their frames timed by \p drivers in turn.
struct V4l2Line {
  V4l2Line(const LiveOptions& options, std::vector<Driver> of)
      : drivers(std::move(of)), line(options) {
    for (std::size_t i = 0; i < drivers.size(); ++i) {
      drivers[i].random.seed(static_cast<unsigned>(i) + 1);
      GstElement* camera = line.element(("cam" + std::to_string(i)).c_str());
      GstPad* pad = gst_element_get_static_pad(camera, "src");
      gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, time_frame, &drivers[i], nullptr);
      gst_object_unref(pad);
      gst_object_unref(camera);
    }
  }

  void expect_whole(double share) {
    const LiveFigures f = line.figures(1.0, line.now() - 0.5);
    fail_unless(line.error().empty(), "%s", line.error().c_str());
    fail_unless(f.sets > 0 && f.mixed == 0 && f.split == 0 && f.unreadable == 0,
                "%d sets: %d mixed, %d split, %d unreadable", f.sets, f.mixed, f.split,
                f.unreadable);
    // A slow machine leaves whole instants out; those that are there have all views that came.
    fail_unless(f.sets - f.incomplete >= share * f.sets, "%d of %d sets are incomplete",
                f.incomplete, f.sets);
    fail_unless(line.statistic("hull", "sets-by-trigger") == 0);
    fail_unless(line.statistic("hull", "sets-by-capture-time") > 0);
  }

  std::vector<Driver> drivers;  // before the line, whose probes hold them
  LiveLine line;
};

/// Cameras whose frames take different times to arrive.
LiveOptions different_delays() {
  LiveOptions options;
  options.delays = {5, 15, 25, 38};
  return options;
}

}  // namespace

ELEMENT_TEST(drivers_that_give_times) {
  V4l2Line cameras(different_delays(), {{.late = 0.0, .sequence = 7},
                                        {.late = 2.0, .sequence = 1000},
                                        {.late = 4.0},
                                        {.late = -1.0, .sequence = 4000000000}});
  cameras.line.play(3.5);
  cameras.expect_whole(0.95);
}

ELEMENT_TEST(a_driver_without_times_and_lost_frames) {
  V4l2Line cameras(different_delays(), {{.lost = 40},
                                        {.late = 2.0, .lost = 40},
                                        {.late = 1.0, .sequence = 99},
                                        {.gives_times = false, .late = 38.0, .spread = 3.0}});
  cameras.line.play(4.0);
  // Four and four frames of a hundred are lost, each in another set.
  cameras.expect_whole(0.75);
}
