// SPDX-License-Identifier: LGPL-2.1-or-later
// composite where OpenGL fails while it draws.
#include <cstring>
#include <string>
#include <vector>

#include "composite_bench.h"
#include "gl_errors.h"

// After epoxy's header.
#include <gst/gl/gl.h>

#include "element_test.h"

using namespace polyhull;
using namespace polyhull::test;
using polyhull::testing::SayGlError;

namespace {

/// A Bench that draws with \p backend, and hears what composite says.
struct LossBench : Bench {
  explicit LossBench(const char* backend) : bus(gst_bus_new()) {
    wait_for_all();
    gst_util_set_object_arg(G_OBJECT(element), "backend", backend);
    gst_element_set_bus(element, bus);
    gst_harness_push(mesh, mesh_buffer(0));
  }
  ~LossBench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
  }
  std::vector<std::uint8_t> picture(int i) {
    return bytes_taken(step(frame(frame_time(i)), mesh_buffer(frame_time(i + 1))));
  }
  /// The next warning's sentence; "" where there is none.
  std::string warning() {
    GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING);
    if (message == nullptr) return "";
    GError* error = nullptr;
    gst_message_parse_warning(message, &error, nullptr);
    const std::string text = error->message;
    g_error_free(error);
    gst_message_unref(message);
    return text;
  }
  GstBus* bus;
};

/// The context that composite draws with.
GstGLContext* context_of(GstElement* element) {
  GstQuery* query = gst_query_new_context("gst.gl.local_context");
  GstPad* pad = gst_element_get_static_pad(element, "src");
  fail_unless(gst_pad_query(pad, query), "composite has no context");
  GstContext* answer = nullptr;
  gst_query_parse_context(query, &answer);
  GstGLContext* context = nullptr;
  gst_structure_get(gst_context_get_structure(answer), "context", GST_TYPE_GL_CONTEXT, &context,
                    nullptr);
  gst_object_unref(pad);
  gst_query_unref(query);
  fail_unless(context != nullptr);
  return context;
}

/// Destroys the context under those who draw with it.
void lose_context(GstElement* element) {
  GstGLContext* context = context_of(element);
  gst_gl_context_thread_add(
      context, [](GstGLContext* lost, gpointer) { gst_gl_context_destroy(lost); }, nullptr);
  gst_object_unref(context);
}

std::vector<std::uint8_t> drawn_by_processor() {
  LossBench bench("processor");
  return bench.picture(0);
}

void check_the_processor_goes_on(LossBench& bench, const char* reason) {
  const std::string warning = bench.warning();
  fail_unless(warning.find("OpenGL failed") != std::string::npos &&
                  warning.find("processor draws") != std::string::npos &&
                  warning.find(reason) != std::string::npos,
              "%s", warning.c_str());
  fail_unless_equals_uint64(statistic(bench.element, "gl-failures"), 1);
}

}  // namespace

ELEMENT_TEST(the_processor_goes_on_without_the_context) {
  LossBench bench("gl");
  const std::vector<std::uint8_t> wanted = drawn_by_processor(), before = bench.picture(0);
  fail_unless(before != wanted);  // by OpenGL
  fail_unless_equals_uint64(statistic(bench.element, "drawn-by-processor"), 0);
  lose_context(bench.element);
  for (int i = 1; i < 4; ++i) fail_unless(bench.picture(i) == wanted, "frame %d", i);
  check_the_processor_goes_on(bench, "context is gone");
  fail_unless_equals_uint64(statistic(bench.element, "drawn"), 4);
  fail_unless_equals_uint64(statistic(bench.element, "drawn-by-processor"), 3);
  fail_unless(bench.warning().empty());  // said once
}

ELEMENT_TEST(the_processor_goes_on_without_memory) {
  LossBench bench("gl");
  const std::vector<std::uint8_t> wanted = drawn_by_processor(), before = bench.picture(0);
  {
    const SayGlError said(GL_OUT_OF_MEMORY, 1);
    fail_unless(bench.picture(1) == wanted);
  }
  fail_unless(bench.picture(2) == wanted);
  check_the_processor_goes_on(bench, "memory");
}

// What the warning promises: after a stop OpenGL is tried again.
ELEMENT_TEST(a_new_start_tries_opengl_again) {
  LossBench bench("gl");
  const std::vector<std::uint8_t> before = bench.picture(0);
  lose_context(bench.element);
  fail_unless(bench.picture(1) != before);
  gst_element_set_state(bench.element, GST_STATE_READY);
  gst_element_set_state(bench.element, GST_STATE_PLAYING);
  gst_harness_set_src_caps_str(bench.background, background_caps);
  gst_harness_set_src_caps_str(bench.mesh, mesh_caps);
  gst_harness_push(bench.mesh, mesh_buffer(0));
  fail_unless(bench.picture(0) == before);
}

ELEMENT_TEST(pictures_in_opengls_memory_end_with_an_error) {
  const char subject[] =
      "hullbuild name=hull ! mix.mesh_0 "
      "rigtestsrc camera=cam0 num-buffers=3 ! silhouette camera=cam0 ! hull. "
      "rigtestsrc camera=cam1 num-buffers=3 ! silhouette camera=cam1 ! hull. ";
  const char background[] =
      "videotestsrc num-buffers=3 ! video/x-raw,format=RGBA,width=320,height=180,framerate=25/1 ! ";
  const SayGlError said(GL_CONTEXT_LOST, 0, G_MAXINT);
  const std::string ended =
      run_to_end("composite name=mix ! video/x-raw(memory:GLMemory) ! fakesink " +
                 std::string(subject) + background + "glupload ! mix.background");
  fail_unless(ended.find("OpenGL failed") != std::string::npos &&
                  ended.find("context is lost") != std::string::npos,
              "%s", ended.c_str());
}
