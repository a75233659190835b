// SPDX-License-Identifier: LGPL-2.1-or-later
// Mattes and frames that are hard on the elements: sizes, strides, patterns, and properties that
// change while frames run.
#include <gst/check/gstharness.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <thread>

#include "elements/element_checks.h"
#include "elements/frames.h"
#include "elements/views.h"
#include "support/run_kind.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using Pattern = std::function<int(int, int)>;

/// A grey frame with rows \p padding bytes longer than they need be, said by a GstVideoMeta.
GstBuffer* grey_frame(int width, int height, int padding, const Pattern& value) {
  const int stride = width + padding;
  GstBuffer* buffer =
      gst_buffer_new_allocate(nullptr, static_cast<gsize>(stride) * height, nullptr);
  GstMapInfo map;
  gst_buffer_map(buffer, &map, GST_MAP_WRITE);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < stride; ++x) {
      map.data[static_cast<gsize>(stride) * y + x] =
          static_cast<std::uint8_t>(x < width ? value(x, y) : 0xaa);
    }
  }
  gst_buffer_unmap(buffer, &map);
  gsize offsets[GST_VIDEO_MAX_PLANES] = {};
  gint strides[GST_VIDEO_MAX_PLANES] = {stride};
  gst_buffer_add_video_meta_full(buffer, GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_GRAY8, width,
                                 height, 1, offsets, strides);
  GST_BUFFER_PTS(buffer) = 0;
  return buffer;
}

struct Named {
  const char* name;
  Pattern value;
};

std::vector<Named> patterns() {
  auto random = std::make_shared<std::mt19937>(5);
  return {
      {"empty", [](int, int) { return 0; }},
      {"full", [](int, int) { return 255; }},
      {"checkerboard", [](int x, int y) { return (x + y) % 2 * 255; }},
      {"noise", [random](int, int) { return static_cast<int>((*random)() % 2) * 255; }},
      {"soft noise", [random](int, int) { return static_cast<int>((*random)() % 256); }},
      {"comb", [](int x, int) { return x % 2 * 255; }},
      {"rake", [](int, int y) { return y % 2 * 255; }},
      {"dots", [](int x, int y) { return x % 3 == 1 && y % 3 == 1 ? 255 : 0; }},
      {"corners that touch", [](int x, int y) { return (x / 5 + y / 5) % 2 * 255; }},
      {"frame", [](int x, int y) { return std::min(x, y) < 2 ? 255 : 0; }},
      {"spiral",
       [](int x, int y) {
         const double r = std::hypot(x - 40, y - 30), phi = std::atan2(y - 30, x - 40);
         return std::fmod(r + 20.0 - phi * 8.0 / (2 * 3.14159265358979), 8.0) < 4.0 ? 255 : 0;
       }},
  };
}

/// Whether two edges of the view's rings cross properly, by trying all pairs.
bool edges_cross(const Rings& rings) {
  struct Edge {
    Vec2 a, b;
  };
  std::vector<Edge> edges;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const auto ring = rings.ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      edges.push_back({ring[i], ring[(i + 1) % ring.size()]});
    }
  }
  const auto side = [](const Vec2& o, const Vec2& a, const Vec2& b) {
    return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    for (std::size_t k = i + 1; k < edges.size(); ++k) {
      const Edge &e = edges[i], &f = edges[k];
      if (side(e.a, e.b, f.a) * side(e.a, e.b, f.b) < 0 &&
          side(f.a, f.b, e.a) * side(f.a, f.b, e.b) < 0) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

ELEMENT_TEST(hard_patterns_become_clean_rings) {
  for (const Named& pattern : patterns()) {
    for (const char* settings :
         {"gaussblur sigma=0 ! contourfind tolerance=0 min-edges=3 min-area=0",
          "gaussblur sigma=0 ! contourfind tolerance=2 min-edges=3 min-area=0",
          "gaussblur sigma=0.7 ! contourfind tolerance=0.5 min-area=0",
          "gaussblur sigma=2 ! contourfind tolerance=1",
          "gaussblur sigma=90 ! contourfind tolerance=1",
          "gaussblur threshold=100 ! contourfind method=binary tolerance=3"}) {
      GstHarness* h = gst_harness_new_parse(settings);
      gst_harness_set_src_caps(h, video_caps("GRAY8", 81, 61));
      const ReadView read =
          take_view(gst_harness_push_and_pull(h, grey_frame(81, 61, 7, pattern.value)));
      const Rings& rings = read.view.contours;
      // Vertices of a refitted polygon may lie off the traced line, up to the tolerance.
      gdouble off = 0.01;
      GstElement* find = gst_harness_find_element(h, "contourfind");
      g_object_get(find, "tolerance", &off, nullptr);
      gst_object_unref(find);
      for (const Vec2f& p : rings.points) {
        fail_unless(
            p.x >= -0.5 - off && p.x <= 80.5 + off && p.y >= -0.5 - off && p.y <= 60.5 + off,
            "%s, %s: %g,%g", pattern.name, settings, p.x, p.y);
      }
      const double area = area_of(rings);
      fail_unless(area >= -1e-3 && area <= (81 + 2 * off) * (61 + 2 * off) + 1e-3,
                  "%s, %s: area %g", pattern.name, settings, area);
      if (rings.points.size() < 4000) {
        fail_if(edges_cross(rings), "%s, %s: rings cross", pattern.name, settings);
      }
      gst_harness_teardown(h);
    }
  }
}

/// Binary outlines enclose the pixels, holes subtracted. Where two pixels touch at a corner only,
/// rings keep 1/16 px off it so that they stay disjoint, which moves the edges that meet there.
ELEMENT_TEST(binary_outlines_enclose_the_pixels) {
  for (const Named& pattern : patterns()) {
    GstHarness* h = gst_harness_new_parse(
        "contourfind method=binary tolerance=0 min-edges=3 min-area=0 min-hole-area=0");
    gst_harness_set_src_caps(h, video_caps("GRAY8", 81, 61));
    GstBuffer* in = grey_frame(81, 61, 0, pattern.value);
    const std::vector<std::uint8_t> levels = bytes_of(in);
    const auto inside = [&](int x, int y) { return levels[y * 81 + x] >= 128; };
    int pixels = 0, touches = 0;
    for (int y = 0; y < 61; ++y) {
      for (int x = 0; x < 81; ++x) {
        pixels += inside(x, y);
        if (x == 0 || y == 0) continue;
        touches += inside(x, y) == inside(x - 1, y - 1) && inside(x - 1, y) == inside(x, y - 1) &&
                   inside(x, y) != inside(x - 1, y);
      }
    }
    const ReadView read = take_view(gst_harness_push_and_pull(h, in));
    double length = 0.0;
    for (std::size_t r = 0; r < read.view.contours.size(); ++r) {
      const auto ring = read.view.contours.ring(r);
      for (std::size_t i = 0; i < ring.size(); ++i) {
        length += glm::length(ring[(i + 1) % ring.size()] - ring[i]);
      }
    }
    const double allowed = 0.01 + (touches > 0 ? length / 8 : 0.0);
    fail_unless(std::abs(area_of(read.view.contours) - pixels) < allowed, "%s: %g of %d",
                pattern.name, area_of(read.view.contours), pixels);
    gst_harness_teardown(h);
  }
}

ELEMENT_TEST(any_size_goes_through) {
  const struct {
    int w, h;
  } sizes[] = {{1, 1},  {1, 2},   {2, 1},    {3, 3},    {15, 1},    {16, 16},   {17, 5},
               {31, 2}, {33, 33}, {1, 3000}, {3000, 1}, {16384, 2}, {2, 16384}, {4099, 61}};
  for (const auto& size : sizes) {
    for (const char* format : {"RGBx", "BGR", "NV12", "I420", "YUY2", "UYVY"}) {
      GstHarness* chain = gst_harness_new_parse(
          "chromamatte ! gaussblur ! contourfind camera=c min-area=0 min-edges=3");
      GstHarness* one = gst_harness_new_parse("silhouette camera=c min-area=0 min-edges=3");
      GstCaps* caps = video_caps(format, size.w, size.h);
      gst_harness_set_src_caps(chain, gst_caps_ref(caps));
      gst_harness_set_src_caps(one, gst_caps_ref(caps));
      GstVideoInfo info;
      gst_video_info_from_caps(&info, caps);
      GstBuffer* in = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
      GstMapInfo map;
      gst_buffer_map(in, &map, GST_MAP_WRITE);
      // Bands of random colour: something is keyed, something is not.
      std::mt19937 random(static_cast<unsigned>(size.w * 131 + size.h));
      for (gsize i = 0; i < map.size; ++i) {
        map.data[i] =
            static_cast<std::uint8_t>(i / 777 % 2 != 0 ? random() % 256 : 40 + i % 3 * 70);
      }
      gst_buffer_unmap(in, &map);
      GST_BUFFER_PTS(in) = 0;
      const ReadView a = take_view(gst_harness_push_and_pull(chain, gst_buffer_ref(in)));
      const ReadView b = take_view(gst_harness_push_and_pull(one, in));
      fail_unless(a.bytes == b.bytes, "%s %dx%d", format, size.w, size.h);
      gst_caps_unref(caps);
      gst_harness_teardown(chain);
      gst_harness_teardown(one);
    }
  }
}

ELEMENT_TEST(a_frame_beyond_the_limit_is_refused) {
  fail_if(run_to_end("videotestsrc num-buffers=1 ! video/x-raw,format=GRAY8,width=40000,height=2 ! "
                     "silhouette ! fakesink")
              .empty());
}

/// Sets one of the element's properties, or reads its stats.
static void set_one(GstElement* element, std::mt19937& random) {
  guint count = 0;
  GParamSpec** specs = g_object_class_list_properties(G_OBJECT_GET_CLASS(element), &count);
  GParamSpec* spec = specs[random() % count];
  if (G_IS_PARAM_SPEC_DOUBLE(spec) && (spec->flags & G_PARAM_WRITABLE) != 0) {
    const auto* range = G_PARAM_SPEC_DOUBLE(spec);
    const double top = std::min(range->maximum, 40.0);
    g_object_set(element, spec->name,
                 range->minimum + (top - range->minimum) * (random() % 1000) / 1000.0, nullptr);
  } else if (G_IS_PARAM_SPEC_INT(spec) && (spec->flags & G_PARAM_WRITABLE) != 0) {
    const auto* range = G_PARAM_SPEC_INT(spec);
    const int top = std::min(range->maximum, 500);
    g_object_set(element, spec->name,
                 range->minimum + static_cast<int>(random() % (top - range->minimum + 1)), nullptr);
  } else if (G_IS_PARAM_SPEC_ENUM(spec)) {
    const auto* choices = G_PARAM_SPEC_ENUM(spec)->enum_class;
    g_object_set(element, spec->name, choices->values[random() % choices->n_values].value, nullptr);
  } else if (std::string(spec->name) == "camera" || spec->value_type == G_TYPE_BOOLEAN) {
    if (spec->owner_type == G_OBJECT_TYPE(element)) {
      if (spec->value_type == G_TYPE_BOOLEAN) {
        g_object_set(element, spec->name, static_cast<gboolean>(random() % 2), nullptr);
      } else {
        g_object_set(element, spec->name, random() % 2 != 0 ? "left" : "right", nullptr);
      }
    }
  } else if (std::string(spec->name) == "stats") {
    GstStructure* stats = nullptr;
    g_object_get(element, "stats", &stats, nullptr);
    gst_structure_free(stats);
  }
  g_free(specs);
}

/// Properties are set from another thread while frames run; nothing tears, crashes or stops.
ELEMENT_TEST(properties_change_while_frames_run) {
  const std::string source =
      "videotestsrc num-buffers=" + std::string(sanitized() ? "100 " : "300 ");
  for (const char* rest :
       {"pattern=smpte100 ! video/x-raw,format=NV12,width=320,height=240 ! silhouette name=a ! "
        "fakesink",
        "pattern=ball ! video/x-raw,format=BGRx,width=320,height=240 ! chromamatte name=a ! "
        "gaussblur name=b ! contourfind name=c ! fakesink"}) {
    GstElement* pipeline = parse(source + rest);
    // From the first frame on, settings that contradict each other are refused and the stream goes
    // on; a stream cannot begin with them.
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                           GST_STATE_CHANGE_SUCCESS);
    std::atomic<bool> done{false};
    std::thread fiddler([&] {
      std::mt19937 random(9);
      while (!done) {
        for (const char* name : {"a", "b", "c"}) {
          g_autoptr(GstElement) element = gst_bin_get_by_name(GST_BIN(pipeline), name);
          if (element != nullptr) set_one(element, random);
        }
        std::this_thread::sleep_for(std::chrono::microseconds(300));
      }
    });
    const std::string end = wait_for_end(pipeline, 120 * GST_SECOND);
    done = true;
    fiddler.join();
    check_ended(end);
    stop(pipeline);
  }
}
