// SPDX-License-Identifier: LGPL-2.1-or-later
// composite over backgrounds that are not opaque: a fill and its key, for switchers and GStreamer's
// compositor.
#include "composite_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "element_test.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using Pixels = std::vector<std::uint8_t>;
using Rgba = std::array<std::uint8_t, 4>;
using Setter = std::function<void(GstElement*)>;

constexpr Rgba transparent{0, 0, 0, 0}, middle{128, 128, 128, 255};

Pixels plain(const Rgba& rgba) {
  Pixels out;
  for (int i = 0; i < width * height; ++i) out.insert(out.end(), rgba.begin(), rgba.end());
  return out;
}

GstBuffer* buffer_of(const Pixels& pixels, GstClockTime time = 0) {
  GstBuffer* buffer = gst_buffer_new_memdup(pixels.data(), pixels.size());
  GST_BUFFER_PTS(buffer) = time;
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

/// The subject over that.
Pixels composite_over(const Pixels& background, const Setter& set, const char* format = "RGBA") {
  Bench bench;
  bench.wait_for_all();
  set(bench.element);
  gst_harness_set_sink_caps_str(bench.background,
                                (std::string("video/x-raw,format=") + format).c_str());
  gst_harness_push(bench.mesh, mesh_buffer(0));
  return bytes_taken(bench.step(buffer_of(background), mesh_buffer(frame_time(1))));
}

/// What GStreamer's compositor makes of \p fill over \p below.
Pixels keyed(const Pixels& fill, const Pixels& below) {
  GstElement* mixer = gst_element_factory_make("compositor", nullptr);
  fail_unless(mixer != nullptr);
  gst_object_ref_sink(mixer);
  GstHarness* lower = gst_harness_new_with_element(mixer, "sink_%u", "src");
  GstHarness* upper = gst_harness_new_with_element(mixer, "sink_%u", nullptr);
  gst_harness_set_sink_caps_str(lower, background_caps);
  for (GstHarness* h : {lower, upper}) gst_harness_set_src_caps_str(h, background_caps);
  gst_harness_push(lower, buffer_of(below));
  gst_harness_push(upper, buffer_of(fill));
  for (GstHarness* h : {lower, upper}) gst_harness_push_event(h, gst_event_new_eos());
  const Pixels out = bytes_taken(gst_harness_pull(lower));
  gst_harness_teardown(upper);
  gst_harness_teardown(lower);
  gst_object_unref(mixer);
  return out;
}

int difference(const Pixels& a, const Pixels& b) {
  fail_unless_equals_uint64(a.size(), b.size());
  int most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

int soft_pixels(const Pixels& fill) {
  int count = 0;
  for (std::size_t i = 3; i < fill.size(); i += 4) count += fill[i] > 0 && fill[i] < 255;
  return count;
}

Setter with(const char* backend, const char* alpha = "straight", const char* view = "composite") {
  return [=](GstElement* element) {
    gst_util_set_object_arg(G_OBJECT(element), "backend", backend);
    gst_util_set_object_arg(G_OBJECT(element), "alpha", alpha);
    gst_util_set_object_arg(G_OBJECT(element), "view", view);
  };
}

constexpr const char* backends[] = {"processor", "gl"};

}  // namespace

ELEMENT_TEST(the_fill_over_grey_is_the_composite) {
  for (const char* backend : backends) {
    for (const bool soft : {false, true}) {
      const Setter set = [&](GstElement* element) {
        with(backend)(element);
        g_object_set(element, "soft-edges", soft, nullptr);
      };
      const Pixels fill = composite_over(plain(transparent), set);
      const Pixels direct = composite_over(plain(middle), set);
      fail_unless(soft_pixels(fill) > 100, "%s: %d", backend, soft_pixels(fill));
      const int most = difference(keyed(fill, plain(middle)), direct);
      fail_unless(most <= 1, "%s, soft edges %d: %d levels", backend, soft, most);
    }
  }
}

ELEMENT_TEST(a_translucent_background_stays_so) {
  const Rgba glass{210, 70, 30, 100};
  for (const char* backend : backends) {
    const Pixels fill = composite_over(plain(glass), with(backend));
    fail_unless(std::equal(glass.begin(), glass.end(), fill.begin()));
    const Pixels below = keyed(plain(glass), plain(middle));
    const int most = difference(keyed(fill, plain(middle)), composite_over(below, with(backend)));
    fail_unless(most <= 2, "%s: %d levels", backend, most);  // below is rounded, too
  }
}

ELEMENT_TEST(premultiplied_is_straight_times_alpha) {
  for (const char* backend : backends) {
    const Pixels straight = composite_over(plain(transparent), with(backend));
    const Pixels times = composite_over(plain(transparent), with(backend, "premultiplied"));
    for (std::size_t i = 0; i < straight.size(); ++i) {
      const int key = straight[i | 3];
      const int wanted = i % 4 == 3 ? key : (straight[i] * key + 127) / 255;
      fail_unless(std::abs(times[i] - wanted) <= 1, "%s: %d, not %d", backend, times[i], wanted);
      fail_unless(times[i] <= times[i | 3], "%s: above its key", backend);
    }
  }
}

// An alpha of 255 means the same in either coding, and video has none.
ELEMENT_TEST(opaque_pictures_have_no_key) {
  for (const char* backend : backends) {
    for (const char* format : {"RGBA", "NV12"}) {
      const Pixels a = composite_over(plain({90, 120, 60, 255}), with(backend), format);
      fail_unless(
          a == composite_over(plain({90, 120, 60, 255}), with(backend, "premultiplied"), format));
      if (format == std::string("RGBA")) {
        fail_unless_equals_int(soft_pixels(a), 0);
      } else {
        fail_unless(a == composite_over(plain({90, 120, 60, 0}), with(backend), format));
      }
    }
  }
}

ELEMENT_TEST(the_key_is_the_fills_alpha) {
  for (const char* backend : backends) {
    const Pixels fill = composite_over(plain(transparent), with(backend));
    const Pixels key = composite_over(plain(transparent), with(backend, "straight", "key"));
    const Pixels video =
        composite_over(plain(transparent), with(backend, "straight", "key"), "NV12");
    for (std::size_t i = 0; i < key.size(); ++i)
      fail_unless_equals_int(key[i], i % 4 == 3 ? 255 : fill[i | 3]);
    for (std::size_t i = 0; i < static_cast<std::size_t>(width) * height; ++i) {
      const double wanted = 16.0 + 219.0 * fill[4 * i + 3] / 255.0;
      fail_unless(std::abs(video[i] - wanted) <= 1.0, "%d, not %g", video[i], wanted);
    }
    for (std::size_t i = static_cast<std::size_t>(width) * height; i < video.size(); ++i)
      fail_unless_equals_int(video[i], 128);
  }
}

// One composite's picture has its key shown by another that has no subject; set while it plays.
ELEMENT_TEST(a_branch_without_subject_shows_the_key) {
  const Pixels fill = composite_over(plain(transparent), with("processor"));
  Bench bench(false);
  const auto step = [&](int i) {
    gst_harness_push(bench.background, buffer_of(fill, frame_time(i)));
    return bytes_taken(bench.pull());
  };
  fail_unless(step(0) == fill);
  with("processor", "straight", "key")(bench.element);
  const Pixels key = step(1);
  for (std::size_t i = 0; i < key.size(); ++i)
    fail_unless_equals_int(key[i], i % 4 == 3 ? 255 : fill[i | 3]);
  with("processor")(bench.element);
  fail_unless(step(2) == fill);
}

// What a lens blurs, bends and darkens has a fill and key, too.
ELEMENT_TEST(a_lens_has_a_fill) {
  const struct {
    const char *name, *value;
  } lenses[] = {{"distortion-k1", "-0.2"}, {"aperture", "60"}, {"falloff-a1", "-0.5"}};
  for (const auto& lens : lenses) {
    const Setter set = [&](GstElement* element) {
      with("processor")(element);
      gst_util_set_object_arg(G_OBJECT(element), "depth-of-field", "subject");
      g_object_set(element, "focus-distance", 1.5, nullptr);
      gst_util_set_object_arg(G_OBJECT(element), lens.name, lens.value);
    };
    const Pixels fill = composite_over(plain(transparent), set);
    fail_unless(soft_pixels(fill) > 100, "%s: %d", lens.name, soft_pixels(fill));
    const int most = difference(keyed(fill, plain(middle)), composite_over(plain(middle), set));
    fail_unless(most <= 1, "%s: %d levels", lens.name, most);
  }
}
