// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullbuild between harnesses, fed with views of boxes.
#pragma once

#include <gst/check/gstharness.h>
#include <gst/check/gsttestclock.h>

#include <memory>
#include <string>
#include <vector>

#include "box_views.h"
#include "builtin/default_rig.h"
#include "element_checks.h"
#include "plugins/common/references.h"
#include "support/folder.h"
#include "wire/mesh_payload.h"

namespace polyhull::test {

constexpr GstClockTime frame_time = 40 * GST_MSECOND;

/// hullbuild with a harness on each pad.
class Bench {
 public:
  explicit Bench(const std::string& properties = "", int cameras = 4, bool live = false) {
    // Two cameras are enough for most of what is tested here.
    element = parse("hullbuild missing-camera=drop-camera min-cameras=2 " + properties);
    gst_object_ref_sink(element);
    bus = gst_bus_new();
    gst_element_set_bus(element, bus);
    for (int i = 0; i < cameras; ++i) {
      GstHarness* input = gst_harness_new_with_element(element, "sink_%u", nullptr);
      gst_harness_set_live(input, live);
      inputs.push_back(input);
    }
    output = gst_harness_new_with_element(element, nullptr, "src");
    for (GstHarness* input : inputs)
      gst_harness_set_src_caps_str(input, "application/x-polyhull-view");
    gst_harness_use_testclock(output);
    gst_harness_play(output);
  }
  ~Bench() {
    gst_bus_set_flushing(bus, TRUE);
    gst_element_set_state(element, GST_STATE_NULL);
    for (GstHarness* input : inputs) gst_harness_teardown(input);
    gst_harness_teardown(output);
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
    gst_object_unref(element);
  }

  void push(int input, const View& view, GstClockTime time) {
    GstBuffer* buffer = buffer_of(write_view(view));
    GST_BUFFER_PTS(buffer) = time;
    GST_BUFFER_DURATION(buffer) = frame_time;
    gst_harness_push(inputs[input], buffer);
  }
  void push_box(int input, int frame, const Box& box = {}, int camera = -1) {
    std::vector<std::uint8_t> pixels;
    push(input, box_view(rig.cameras[camera < 0 ? input : camera], box, frame, pixels),
         frame * frame_time);
  }
  std::unique_ptr<Mesh> pull() {
    last.reset(gst_harness_pull(output));
    fail_unless(last != nullptr, "no mesh came");
    gst_buffer_map(last.get(), &map, GST_MAP_READ);
    bytes.assign(map.data, map.data + map.size);
    gst_buffer_unmap(last.get(), &map);
    return std::make_unique<Mesh>(read_mesh(Bytes(bytes)));
  }
  bool nothing_more() {
    for (int i = 0; i < 20; ++i) {
      if (gst_harness_buffers_in_queue(output) > 0) return false;
      g_usleep(5000);
    }
    return true;
  }
  std::string error() {
    GstMessage* message = gst_bus_timed_pop_filtered(bus, 5 * GST_SECOND, GST_MESSAGE_ERROR);
    if (message == nullptr) return "no error";
    GError* found = nullptr;
    gst_message_parse_error(message, &found, nullptr);
    const std::string text = found->message;
    g_clear_error(&found);
    gst_message_unref(message);
    return text;
  }
  guint messages(GstMessageType type) {
    guint count = 0;
    while (GstMessage* message = gst_bus_pop_filtered(bus, type)) {
      gst_message_unref(message);
      ++count;
    }
    return count;
  }
  /// The sentences of the warnings since the last call.
  std::vector<std::string> warnings() { return warnings_on(bus); }
  guint64 count(const char* field) { return statistic(element, field); }

  Rig rig = default_rig();
  GstElement* element;
  GstBus* bus;
  std::vector<GstHarness*> inputs;
  GstHarness* output;
  element::Ref<GstBuffer> last;
  GstMapInfo map;
  std::vector<std::uint8_t> bytes;
};

/// Of this program.
inline const Folder folder;

}  // namespace polyhull::test
