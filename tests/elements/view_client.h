// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// viewclientsrc as a test's client.
#pragma once

#include <gst/app/gstappsink.h>

#include <string>

#include "element_checks.h"
#include "gdp_stream.h"

namespace polyhull::test {

/// A pipeline from viewclientsrc to an appsink.
struct Client {
  Client(int port, const std::string& properties = "max-age=0")
      : pipeline(parse("viewclientsrc name=client retry=20000000 timeout=20000000000 port=" +
                       std::to_string(port) + " " + properties +
                       " ! appsink name=sink sync=false")),
        source(gst_bin_get_by_name(GST_BIN(pipeline), "client")),
        sink(gst_bin_get_by_name(GST_BIN(pipeline), "sink")),
        bus(gst_element_get_bus(pipeline)) {
    fail_if(gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
  }
  ~Client() {
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_NULL),
                           GST_STATE_CHANGE_SUCCESS);
    gst_object_unref(bus);
    gst_object_unref(sink);
    gst_object_unref(source);
    gst_object_unref(pipeline);
  }
  /// The next frame; empty at the end of the stream.
  Packet next() {
    GstSample* sample = gst_app_sink_try_pull_sample(GST_APP_SINK(sink), 60 * GST_SECOND);
    if (sample == nullptr) {
      fail_unless(gst_app_sink_is_eos(GST_APP_SINK(sink)), "no frame came: %s",
                  statistics_text(source).c_str());
      return {};
    }
    time = GST_BUFFER_PTS(gst_sample_get_buffer(sample));
    const Packet bytes = bytes_of(gst_sample_get_buffer(sample));
    gst_sample_unref(sample);
    return bytes;
  }
  void wait_for(const char* counter, guint64 value) { wait_for_statistic(source, counter, value); }
  void expect_warning(const char* text) { test::expect_warning(bus, text); }
  GstElement *pipeline, *source, *sink;
  GstBus* bus;
  GstClockTime time = 0;
};

}  // namespace polyhull::test
