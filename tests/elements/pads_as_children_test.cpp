// SPDX-License-Identifier: LGPL-2.1-or-later
// What a launch line sets on pads and cannot: composite and hullbuild say it.

#include <cmath>
#include <string>
#include <vector>

#include "element_checks.h"

using namespace polyhull::test;

namespace {

/// The sentences of all warnings of a pipeline that is run to its end and let go; an error fails
/// the test.
std::vector<std::string> warnings_of(GstElement* pipeline) {
  GstBus* bus = gst_element_get_bus(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  std::vector<std::string> texts;
  for (bool ended = false; !ended;) {
    GstMessage* message = gst_bus_timed_pop_filtered(
        bus, 60 * GST_SECOND,
        static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_WARNING));
    fail_unless(message != nullptr, "nothing ended within the time allowed");
    GError* error = nullptr;
    if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_WARNING) {
      gchar* debug = nullptr;
      gst_message_parse_warning(message, &error, &debug);
      texts.push_back(std::string(error->message) + " " + (debug != nullptr ? debug : ""));
      g_free(debug);
    } else if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
      gst_message_parse_error(message, &error, nullptr);
      ck_abort_msg("%s", error->message);
    } else {
      ended = true;
    }
    g_clear_error(&error);
    gst_message_unref(message);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
  return texts;
}

std::vector<std::string> warnings_of(const std::string& line) {
  return warnings_of(parse(line));
}

/// How many of \p texts hold all of \p words.
int saying(const std::vector<std::string>& texts, std::initializer_list<const char*> words) {
  int count = 0;
  for (const std::string& text : texts) {
    bool all = true;
    for (const char* word : words) all = all && text.find(word) != std::string::npos;
    count += all;
  }
  return count;
}

std::string cameras(const std::string& setting) {
  return "hullbuild name=hull " + setting +
         " ! fakesink"
         " rigtestsrc camera=cam0 num-buffers=1 ! silhouette ! hull.sink_0"
         " rigtestsrc camera=cam1 num-buffers=1 ! silhouette camera=cam1 ! hull.sink_1";
}

/// Without a mesh nothing is drawn, so no GL is needed.
std::vector<std::string> composite_warnings(const std::string& setting) {
  return warnings_of("composite name=mix " + setting +
                     " ! fakesink videotestsrc num-buffers=2 ! "
                     "video/x-raw,format=RGBA,width=64,height=36 ! mix.background "
                     "fakesrc num-buffers=0 ! application/x-polyhull-mesh ! mix.mesh_0");
}

}  // namespace

ELEMENT_TEST(settings_that_are_taken_are_not_spoken_of) {
  fail_unless(composite_warnings("mesh_0::scale=2 mesh_0::translate-x=-1.5").empty());
  fail_unless(warnings_of(cameras("sink_0::camera=cam0 sink_1::camera=cam1")).empty());
}

ELEMENT_TEST(an_unknown_property_is_named_with_what_there_is) {
  const auto texts = composite_warnings("mesh_0::scal=2 mesh_0::rotate-y=10");
  fail_unless_equals_int(saying(texts, {"mesh_0::scal"}), 1);  // GStreamer's own
  fail_unless_equals_int(saying(texts, {"mesh_0", "scale (0.001 to 1000)", "translate-x"}), 1);
  const auto hull = warnings_of(cameras("sink_0::camra=cam0 sink_0::camera=cam0"));
  fail_unless_equals_int(saying(hull, {"sink_0::camra"}), 1);
  fail_unless_equals_int(saying(hull, {"sink_0 takes camera (text)"}), 1);
}

ELEMENT_TEST(a_value_that_cannot_be_read_is_said) {
  for (const char* value : {"abc", "1,5"}) {
    const auto texts = composite_warnings(std::string("mesh_0::scale=") + value);
    fail_unless_equals_int(saying(texts, {"mesh_0", "cannot be read", "decimal point"}), 1);
  }
}

// A pad's warning is its element's.
ELEMENT_TEST(a_pad_keeps_its_value_where_none_is_a_number) {
  GstElement* element = gst_element_factory_make("composite", nullptr);
  GstPad* pad = gst_element_request_pad_simple(element, "mesh_%u");
  ASSERT_WARNING(g_object_set(pad, "scale", std::nan(""), nullptr));
  gdouble scale = 0.0;
  g_object_get(pad, "scale", &scale, nullptr);
  fail_unless_equals_float(scale, 1.0);
  gst_element_release_request_pad(element, pad);
  gst_object_unref(pad);
  gst_object_unref(element);
}

ELEMENT_TEST(a_pad_that_takes_nothing_says_so) {
  const auto texts = composite_warnings("background::scale=2");
  fail_unless_equals_int(saying(texts, {"background takes no settings"}), 1);
}

ELEMENT_TEST(a_pad_that_never_comes_is_named_once) {
  const auto texts = composite_warnings("mesh_7::scale=2 mesh_7::rotate-y=2 mesh_0::scale=2");
  fail_unless_equals_int(saying(texts, {"mesh_7", "mix", "background, mesh_0"}), 1);
  fail_unless_equals_int(static_cast<int>(texts.size()), 1);
  const auto hull = warnings_of(cameras("sink_0::camera=cam0 sink_9::camera=cam5"));
  fail_unless_equals_int(saying(hull, {"sink_9", "sink_0, sink_1"}), 1);
}

ELEMENT_TEST(an_application_that_looks_for_pads_is_not_warned) {
  GstElement* pipeline = parse(cameras("sink_0::camera=cam0"));
  GstElement* hull = named(pipeline, "hull");
  GstChildProxy* proxy = GST_CHILD_PROXY(hull);
  fail_unless(gst_child_proxy_get_child_by_name(proxy, "sink_5") == nullptr);
  GObject* pad = gst_child_proxy_get_child_by_name(proxy, "sink_0");
  fail_unless(pad != nullptr);
  g_object_unref(pad);
  fail_unless(warnings_of(pipeline).empty());
}
