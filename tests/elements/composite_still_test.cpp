// SPDX-License-Identifier: LGPL-2.1-or-later
// composite before a background that stands still: OpenGL has it already. What is shaded and what
// changes is counted.
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "composite_bench.h"
#include "element_test.h"
#include "played.h"
#include "small_scene.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

struct StillBench : Bench {
  explicit StillBench(const char* backend) { show_subject(backend); }
  /// The frame \p i made of \p picture: its bytes.
  std::vector<std::uint8_t> draw(int i, GstBuffer* picture) {
    GST_BUFFER_PTS(picture) = frame_time(i);
    return bytes_taken(step(picture, mesh_buffer(frame_time(i + 1))));
  }
  guint64 uploaded() const { return statistic(element, "background-bytes-uploaded"); }
};

constexpr guint64 most = 4 * width * height;

}  // namespace

ELEMENT_TEST(shared_memory_is_uploaded_once) {
  StillBench bench("gl");
  GstBuffer* still = frame(0);
  const std::vector<std::uint8_t> wanted = bench.draw(0, frame(0));
  const guint64 once = bench.uploaded();
  fail_unless(once > 0 && once <= most);
  for (int i = 1; i < 4; ++i) fail_unless(bench.draw(i, gst_buffer_copy(still)) == wanted);
  fail_unless_equals_uint64(bench.uploaded(), once);
  // Who owns the memory alone may write into it: composite holds what it may not.
  still = gst_buffer_make_writable(still);
  GstMapInfo map;
  fail_unless(gst_buffer_map(still, &map, GST_MAP_WRITE));
  std::memset(map.data, 200, map.size);
  gst_buffer_unmap(still, &map);
  const std::vector<std::uint8_t> other = bench.draw(4, gst_buffer_copy(still));
  fail_unless(bench.uploaded() > once);
  StillBench fresh("gl");
  fail_unless(fresh.draw(0, still) == other);
}

ELEMENT_TEST(equal_frames_are_uploaded_once) {
  StillBench bench("gl");
  const std::vector<std::uint8_t> wanted = bench.draw(0, frame(0));
  const guint64 once = bench.uploaded();
  fail_unless(once > 0);
  fail_unless(bench.draw(1, frame(0)) == wanted);  // composite's own to draw into, by now
  fail_unless(bench.draw(2, frame(0)) == wanted);
  fail_unless_equals_uint64(bench.uploaded(), once);
}

ELEMENT_TEST(the_processor_uploads_nothing) {
  StillBench bench("processor");
  bench.draw(0, frame(0));
  bench.draw(1, frame(0));
  fail_unless_equals_uint64(bench.uploaded(), 0);
  fail_unless_equals_uint64(statistic(bench.element, "bytes-uploaded"), 0);
}

ELEMENT_TEST(pixels_are_counted) {
  for (const char* backend : {"processor", "gl"}) {
    StillBench bench(backend);
    guint64 changed = 0;
    for (int i = 0; i < 2; ++i) {
      const std::vector<std::uint8_t> bytes = bench.draw(i, frame(0));
      for (std::size_t k = 0; k < bytes.size(); k += 4)
        changed += bytes[k] != grey || bytes[k + 1] != grey || bytes[k + 2] != grey ||
                   bytes[k + 3] != grey;
    }
    fail_unless(changed > 0);
    fail_unless_equals_uint64(statistic(bench.element, "pixels-changed"), changed);
    const guint64 shaded = statistic(bench.element, "pixels-shaded");
    const bool unknown = shaded == 0 && std::strcmp(backend, "gl") == 0;  // OpenGL ES
    fail_unless(unknown || (shaded >= changed && shaded < 2 * changed), "%s: %d of %d", backend,
                static_cast<int>(shaded), static_cast<int>(changed));
  }
}

// scenesrc sends the memory of a picture that stands still with each frame: who draws into it, or into what
// it was converted to, draws over what was drawn before, and the shadow becomes darker and darker.
ELEMENT_TEST(what_a_source_sends_again_is_not_drawn_into) {
  const int frames = at_length() ? 17 : 3;  // of each kind: 200 in all
  const Folder folder;
  const std::string scene = write_small_scene(folder.file("scene.glb"));
  const std::string shape = "video/x-raw,width=160,height=90,framerate=25/1,format=";
  GstHarness* source = gst_harness_new_parse(
      ("scenesrc refinement=never num-buffers=2 light-spacing=.2 scene=" + scene +
       " ! capsfilter caps=" + shape + "RGBA")
          .c_str());
  gst_harness_play(source);
  GstBuffer* before = gst_harness_pull(source);
  GstBuffer* still = gst_harness_pull(source);
  fail_unless(gst_buffer_peek_memory(before, 0) == gst_buffer_peek_memory(still, 0));
  gst_buffer_unref(before);
  fail_if(gst_buffer_is_all_memory_writable(still));  // scenesrc still has it
  gst_harness_teardown(source);
  const struct {
    const char *background, *output;
  } formats[] = {{"RGBA", "RGBA"}, {"RGBA", "NV12"}, {"RGBA", "I420"}, {"BGRx", "RGBA"}};
  for (const char* backend : {"processor", "gl"}) {
    StillBench bench(backend);
    g_object_set(bench.element, "scene", scene.c_str(), nullptr);
    int number = 0;
    for (const auto& [background, output] : formats) {
      gst_harness_set_src_caps_str(bench.background, (shape + background).c_str());
      gst_harness_set_sink_caps_str(bench.background,
                                    (std::string("video/x-raw,format=") + output).c_str());
      for (const auto& [skip, lens] : {std::pair{true, 0.0}, {false, 0.0}, {false, -0.1}}) {
        g_object_set(bench.element, "skip", skip, "distortion-k1", lens, nullptr);
        std::vector<std::uint8_t> first;
        for (int i = 0; i < frames; ++i, ++number) {
          const guint64 changed = statistic(bench.element, "pixels-changed");
          const std::vector<std::uint8_t> drawn = bench.draw(number, gst_buffer_copy(still));
          if (i == 0) first = drawn;
          fail_unless(drawn == first, "%s by %s to %s, skip=%d, lens %g: frame %d is another",
                      background, backend, output, skip, lens, i);
          fail_unless(statistic(bench.element, "pixels-changed") > changed + 100);
        }
      }
      g_autoptr(GstCaps) caps = gst_pad_get_current_caps(bench.background->sinkpad);
      fail_unless_equals_string(gst_structure_get_string(gst_caps_get_structure(caps, 0), "format"),
                                output);
    }
    fail_unless_equals_uint64(statistic(bench.element, "through-lens"),
                              static_cast<guint64>(4 * frames));
  }
  gst_buffer_unref(still);
}
