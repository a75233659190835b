// SPDX-License-Identifier: LGPL-2.1-or-later
// composite with subjects that fade: a mix of the pictures with and without them, whatever draws.
#include "composite_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "element_test.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using Pixels = std::vector<std::uint8_t>;

GstBuffer* faded(float opacity, GstClockTime time) {
  Mesh mesh = subject().mesh;
  mesh.opacity = opacity;
  return mesh_buffer(time, mesh);
}

struct Shot {
  const char* backend = "processor";
  const char* format = "RGBA";
  bool opaque = true;
  bool in_room = true;
};

/// The subject, and beside it and behind it a second one, with these opacities; negative: none.
Pixels shown(const Shot& shot, float first, float second = -1.0f) {
  Bench bench;
  bench.wait_for_all();
  gst_util_set_object_arg(G_OBJECT(bench.element), "backend", shot.backend);
  g_object_set(bench.element, "eye-z", 2.4, nullptr);
  if (shot.in_room) g_object_set(bench.element, "scene", "builtin:room", nullptr);
  gst_harness_set_sink_caps_str(bench.background,
                                (std::string("video/x-raw,format=") + shot.format).c_str());
  GstHarness* other = nullptr;
  if (second >= 0.0f) {
    other = gst_harness_new_with_element(bench.element, "mesh_%u", nullptr);
    gst_harness_set_live(other, FALSE);
    gst_harness_set_src_caps_str(other, mesh_caps);
    gst_child_proxy_set(GST_CHILD_PROXY(bench.element), "mesh_1::translate-x", 0.3,
                        "mesh_1::translate-z", -0.5, nullptr);
    gst_harness_push(other, faded(second, 0));
    gst_harness_push_event(other, gst_event_new_eos());
  }
  if (first >= 0.0f) gst_harness_push(bench.mesh, faded(first, 0));
  gst_harness_push_event(bench.mesh, gst_event_new_eos());
  gst_harness_push(bench.background, shot.opaque ? opaque_frame(0) : frame(0));
  Pixels out = bytes_taken(bench.pull());
  if (other) gst_harness_teardown(other);
  return out;
}

/// By how much \p mixed is off the sum of \p parts, each with its share, in levels.
int off(const Pixels& mixed, const std::vector<std::pair<double, const Pixels*>>& parts) {
  double most = 0.0;
  for (std::size_t i = 0; i < mixed.size(); ++i) {
    double sum = 0.0;
    for (const auto& [share, pixels] : parts) sum += share * (*pixels)[i];
    most = std::max(most, std::abs(mixed[i] - sum));
  }
  return static_cast<int>(std::ceil(most - 1e-3));
}

int different(const Pixels& a, const Pixels& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
  return count;
}

}  // namespace

ELEMENT_TEST(a_fading_picture_is_a_mix) {
  for (const char* backend : {"processor", "gl"}) {
    const Shot shot{backend, "RGBA", true, backend == std::string("processor")};
    const Pixels none = shown(shot, 0.0f), all = shown(shot, 1.0f);
    fail_unless(none == bytes_taken(opaque_frame(0)), "%s: a subject of opacity 0 is seen",
                backend);
    fail_unless(different(all, none) > 3000, "%s: %d", backend, different(all, none));
    for (const float opacity : {0.004f, 0.3f}) {
      const int levels = off(shown(shot, opacity), {{opacity, &all}, {1.0 - opacity, &none}});
      fail_unless(levels <= 1, "%s, %.3f: %d levels", backend, static_cast<double>(opacity),
                  levels);
    }
  }
}

/// Where one fades the other stays, and is seen through it.
ELEMENT_TEST(one_of_two_fades) {
  for (const char* backend : {"processor", "gl"}) {
    const Shot shot{backend, "RGBA", true, false};
    const Pixels both = shown(shot, 1.0f, 1.0f), second = shown(shot, -1.0f, 1.0f);
    const Pixels none = bytes_taken(opaque_frame(0));
    int levels = off(shown(shot, 0.25f, 1.0f), {{0.25, &both}, {0.75, &second}});
    fail_unless(levels <= 1, "%s: %d levels", backend, levels);
    levels = off(shown(shot, 0.25f, 0.5f), {{0.25, &both}, {0.25, &second}, {0.5, &none}});
    fail_unless(levels <= 2, "%s: %d levels", backend, levels);  // rounded twice
    levels = off(shown(shot, 0.5f, 0.5f), {{0.5, &both}, {0.5, &none}});
    fail_unless(levels <= 1, "%s: %d levels", backend, levels);
  }
}

/// A fill keeps its colours while its key fades.
ELEMENT_TEST(the_key_fades) {
  const Shot shot{"processor", "RGBA", false, false};
  const Pixels none = shown(shot, 0.0f), all = shown(shot, 1.0f), half = shown(shot, 0.5f);
  for (std::size_t i = 0; i < all.size(); i += 4) {
    const double a = all[i + 3], b = none[i + 3], key = 0.5 * (a + b);
    fail_unless(std::abs(half[i + 3] - key) <= 1.0);
    for (std::size_t c = 0; c < 3; ++c) {
      const double wanted = (a * all[i + c] + b * none[i + c]) / (a + b);
      fail_unless(std::abs(half[i + c] - wanted) <= 1.0, "%d, not %g", half[i + c], wanted);
    }
  }
}

ELEMENT_TEST(video_fades) {
  for (const char* format : {"NV12", "I420"}) {
    const Shot shot{"processor", format, true, false};
    const Pixels none = shown(shot, 0.0f), all = shown(shot, 1.0f);
    // Mixed before it becomes video: both round.
    const int levels = off(shown(shot, 0.4f), {{0.4, &all}, {0.6, &none}});
    fail_unless(levels <= 2, "%s: %d levels", format, levels);
  }
}
