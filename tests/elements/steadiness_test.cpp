// SPDX-License-Identifier: LGPL-2.1-or-later
// The contours of what stands still before a noisy camera.
#include <gst/check/gstharness.h>

#include <cmath>
#include <random>

#include "elements/element_checks.h"
#include "elements/frames.h"
#include "elements/views.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int width = 120;
constexpr int height = 90;

/// A disk's matte with noise of four levels where it is soft.
GstBuffer* noisy(double x_of_disk, unsigned number) {
  std::mt19937 random(number);
  std::normal_distribution<double> noise(0.0, 4.0);
  GstBuffer* out = gst_buffer_new_allocate(nullptr, width * height, nullptr);
  GST_BUFFER_PTS(out) = number * GST_SECOND / 30;
  GstMapInfo map;
  gst_buffer_map(out, &map, GST_MAP_WRITE);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double cover = disk_cover(x, y, x_of_disk, 40.7, 25.0);
      const double grain = cover > 0.0 && cover < 1.0 ? noise(random) : 0.0;
      map.data[y * width + x] =
          static_cast<guint8>(std::lround(std::clamp(255.0 * cover + grain, 0.0, 255.0)));
    }
  }
  gst_buffer_unmap(out, &map);
  return out;
}

}  // namespace

ELEMENT_TEST(contours_of_what_stands_still_stay) {
  for (const double steadiness : {0.25, 0.0}) {
    GstHarness* h = gst_harness_new_parse("gaussblur sigma=1.5 ! contourfind camera=c");
    GstElement* find = gst_harness_find_element(h, "contourfind");
    g_object_set(find, "steadiness", steadiness, nullptr);
    gst_harness_set_src_caps(h, video_caps("GRAY8", width, height));
    Rings first;
    int same = 0;
    for (unsigned n = 0; n < 10; ++n) {
      const ReadView read = take_view(gst_harness_push_and_pull(h, noisy(50.3, n)));
      if (n == 0) first = read.view.contours;
      same += read.view.contours == first;
    }
    const int wanted = steadiness > 0.0 ? 10 : 1;
    fail_unless_equals_int(same, wanted);
    fail_unless_equals_int(static_cast<int>(statistic(find, "steady")), wanted - 1);
    fail_unless_equals_int(static_cast<int>(statistic(find, "reused")), 0);
    // What moves is there at once.
    const ReadView moved = take_view(gst_harness_push_and_pull(h, noisy(54.3, 10)));
    double right = 0.0;
    for (const Vec2f& p : moved.view.contours.points) right = std::max<double>(right, p.x);
    fail_unless(std::abs(right - 79.3) < 1.0, "%g", right);
    fail_unless_equals_int(static_cast<int>(statistic(find, "steady")), wanted - 1);
    gst_object_unref(find);
    gst_harness_teardown(h);
  }
}
