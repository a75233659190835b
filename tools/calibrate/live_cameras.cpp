// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/live_cameras.h"

#include <fmt/format.h>
#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>
#include <gst/video/video.h>

#include <algorithm>

#include "base/error.h"

namespace polyhull::calibrate_tool {
namespace {

GstElement* parse(const std::string& line, const std::string& whose) {
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(line.c_str(), &error);
  if (error == nullptr) return pipeline;
  const std::string what = error->message;
  g_clear_error(&error);
  if (pipeline != nullptr) gst_object_unref(pipeline);
  throw Error(Error::Kind::bad_input, "The elements of {} are not understood: {}.", whose, what);
}

Picture picture_of(GstSample* sample) {
  GstVideoInfo info;
  GstVideoFrame frame;
  if (!gst_video_info_from_caps(&info, gst_sample_get_caps(sample)) ||
      !gst_video_frame_map(&frame, &info, gst_sample_get_buffer(sample), GST_MAP_READ))
    return {};
  Picture picture{GST_VIDEO_FRAME_WIDTH(&frame), GST_VIDEO_FRAME_HEIGHT(&frame), 1, {}};
  picture.pixels.resize(static_cast<std::size_t>(picture.width) * picture.height);
  const auto* rows = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0));
  for (int y = 0; y < picture.height; ++y)
    std::copy_n(rows + static_cast<std::ptrdiff_t>(y) * GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0),
                picture.width, picture.row(y));
  gst_video_frame_unmap(&frame);
  return picture;
}

}  // namespace

LiveSource parse_source(const std::string& text) {
  const auto sign = text.find('=');
  const auto space = text.find_first_of(" !");
  if (sign == std::string::npos || sign == 0 || space < sign || sign + 1 == text.size())
    throw Error(Error::Kind::bad_input,
                "--live is '{}'; expected NAME=ELEMENTS, such as 'cam0=v4l2src "
                "device=/dev/video0'.",
                text);
  LiveSource source{text.substr(0, sign), text.substr(sign + 1)};
  if (source.name.find('/') != std::string::npos || source.name.starts_with('.'))
    throw Error(Error::Kind::bad_input,
                "'{}' cannot name a camera: it is the name of a folder, too.", source.name);
  return source;
}

LiveCameras::LiveCameras(const std::vector<LiveSource>& sources) {
  pipeline_ = gst_pipeline_new("cameras");
  bus_ = gst_element_get_bus(pipeline_);
  try {
    for (const LiveSource& source : sources) {
      if (std::ranges::any_of(cameras_, [&](const Camera& c) { return c.name == source.name; }))
        throw Error(Error::Kind::bad_input, "Two of --live name the camera '{}'.", source.name);
      GError* error = nullptr;
      const std::string line = source.elements +
                               " ! videoconvert ! video/x-raw,format=GRAY8 ! appsink name=sink "
                               "sync=false max-buffers=1 drop=true";
      GstElement* bin = gst_parse_bin_from_description(line.c_str(), FALSE, &error);
      if (error != nullptr) {
        const std::string what = error->message;
        g_clear_error(&error);
        if (bin != nullptr) gst_object_unref(bin);
        throw Error(Error::Kind::bad_input, "The elements of camera '{}' are not understood: {}.",
                    source.name, what);
      }
      gst_object_set_name(GST_OBJECT(bin), source.name.c_str());
      gst_bin_add(GST_BIN(pipeline_), bin);
      cameras_.push_back({source.name, gst_bin_get_by_name(GST_BIN(bin), "sink")});
    }
    if (gst_element_set_state(pipeline_, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE) {
      throw_errors();
      throw Error(Error::Kind::bad_input, "The cameras do not start.");
    }
  } catch (...) {
    gst_element_set_state(pipeline_, GST_STATE_NULL);
    for (const Camera& camera : cameras_) gst_object_unref(camera.sink);
    gst_object_unref(bus_);
    gst_object_unref(pipeline_);
    throw;
  }
}

LiveCameras::~LiveCameras() {
  gst_element_set_state(pipeline_, GST_STATE_NULL);
  for (const Camera& camera : cameras_) gst_object_unref(camera.sink);
  gst_object_unref(bus_);
  gst_object_unref(pipeline_);
}

void LiveCameras::throw_errors() {
  GstMessage* message = gst_bus_pop_filtered(bus_, GST_MESSAGE_ERROR);
  if (message == nullptr) return;
  GError* error = nullptr;
  gst_message_parse_error(message, &error, nullptr);
  std::string who = "?";
  for (const Camera& camera : cameras_) {
    GstObject* bin = gst_object_get_parent(GST_OBJECT(camera.sink));
    if (gst_object_has_as_ancestor(GST_MESSAGE_SRC(message), bin)) who = camera.name;
    gst_object_unref(bin);
  }
  const std::string what = error->message;
  g_clear_error(&error);
  gst_message_unref(message);
  throw Error(Error::Kind::bad_input, "Camera '{}' fails: {}", who, what);
}

bool LiveCameras::take(GstClockTime tolerance, std::vector<std::optional<Picture>>& pictures) {
  pictures.assign(cameras_.size(), std::nullopt);
  std::vector<GstClockTime> times(cameras_.size(), GST_CLOCK_TIME_NONE);
  GstClockTime latest = 0;
  bool open = false;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    GstAppSink* sink = GST_APP_SINK(cameras_[c].sink);
    GstSample* sample = gst_app_sink_try_pull_sample(sink, GST_SECOND);
    open = open || sample != nullptr || !gst_app_sink_is_eos(sink);
    if (sample == nullptr) continue;
    times[c] = gst_segment_to_running_time(gst_sample_get_segment(sample), GST_FORMAT_TIME,
                                           GST_BUFFER_PTS(gst_sample_get_buffer(sample)));
    pictures[c] = picture_of(sample);
    if (pictures[c]->empty()) pictures[c].reset();
    gst_sample_unref(sample);
    if (GST_CLOCK_TIME_IS_VALID(times[c])) latest = std::max(latest, times[c]);
  }
  throw_errors();
  // A picture of another moment shows the board elsewhere.
  for (std::size_t c = 0; c < cameras_.size(); ++c)
    if (GST_CLOCK_TIME_IS_VALID(times[c]) && latest - times[c] > tolerance) pictures[c].reset();
  return open;
}

Window::Window(const std::string& elements) {
  pipeline_ = parse(
      "appsrc name=source is-live=true do-timestamp=true format=time ! queue "
      "leaky=downstream max-size-buffers=2 ! videoconvert ! " +
          elements,
      "--show");
  source_ = gst_bin_get_by_name(GST_BIN(pipeline_), "source");
  if (gst_element_set_state(pipeline_, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE) {
    gst_element_set_state(pipeline_, GST_STATE_NULL);
    gst_object_unref(source_);
    gst_object_unref(pipeline_);
    throw Error(Error::Kind::bad_input, "'{}' cannot show pictures here. --show '' does without.",
                elements);
  }
}

Window::~Window() {
  gst_app_src_end_of_stream(GST_APP_SRC(source_));
  GstBus* bus = gst_element_get_bus(pipeline_);
  GstMessage* end = gst_bus_timed_pop_filtered(
      bus, GST_SECOND, static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  if (end != nullptr) gst_message_unref(end);
  gst_object_unref(bus);
  gst_element_set_state(pipeline_, GST_STATE_NULL);
  gst_object_unref(source_);
  gst_object_unref(pipeline_);
}

void Window::show(const Picture& picture) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, GST_VIDEO_FORMAT_RGB, static_cast<guint>(picture.width),
                            static_cast<guint>(picture.height));
  GstCaps* caps = gst_video_info_to_caps(&info);
  gst_app_src_set_caps(GST_APP_SRC(source_), caps);
  gst_caps_unref(caps);
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
  const std::size_t bytes = static_cast<std::size_t>(picture.width) * 3;
  for (int y = 0; y < picture.height; ++y)
    gst_buffer_fill(buffer, static_cast<gsize>(y) * GST_VIDEO_INFO_PLANE_STRIDE(&info, 0),
                    picture.row(y), bytes);
  gst_app_src_push_buffer(GST_APP_SRC(source_), buffer);
}

}  // namespace polyhull::calibrate_tool
