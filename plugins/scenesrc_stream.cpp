// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scenesrc_stream.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace polyhull::element {
namespace {

constexpr int refined_rows = 8;         // between two looks at the clock
constexpr float bounce_spacing = 5.6f;  // of the spacing of the straight light

}  // namespace

GstClockTime running_time(GstBaseSrc* source) {
  GstClock* clock = gst_element_get_clock(GST_ELEMENT(source));
  if (clock == nullptr) return GST_CLOCK_TIME_NONE;
  const GstClockTime now = gst_clock_get_time(clock);
  const GstClockTime base = gst_element_get_base_time(GST_ELEMENT(source));
  gst_object_unref(clock);
  return GST_STATE(source) == GST_STATE_PLAYING && now >= base ? now - base : GST_CLOCK_TIME_NONE;
}

void SceneStream::open(const SceneSettings& settings) {
  close();
  Scene scene = open_scene(settings.scene);
  lights_ = scene.lights;
  exposure_ = scene.exposure;
  BackgroundOptions options;
  options.light.spacing = static_cast<float>(settings.light_spacing);
  options.light.bounce_spacing = bounce_spacing * options.light.spacing;
  options.view.contrast = static_cast<float>(settings.smoothing);
  options.paths.light_samples = 2;
  background_ = std::make_unique<Background>(std::move(scene), options);
}

void SceneStream::close() {
  forget_pixels();
  background_.reset();
  camera_ = Camera{};
  announced_.clear();
  delay_ = GST_CLOCK_TIME_NONE;
}

void SceneStream::forget_pixels() {
  if (pixels_ != nullptr) gst_memory_unref(pixels_);
  pixels_ = nullptr;
}

Background::Work SceneStream::draw(GstElement* element, Statistics& statistics,
                                   const SceneSettings& settings, const ViewportControl& control,
                                   const GstVideoInfo& info, GstClockTime pts) {
  try {
    camera_ = scene_viewport(settings, control, background_->scene(),
                             static_cast<double>(pts) / GST_SECOND, info.width, info.height);
  } catch (const Error& error) {
    // A viewport that is impossible for a moment does not end the stream.
    if (camera_.width != info.width || camera_.height != info.height) throw;
    statistics.warn(element, "warnings", std::string(error.what()) + " The last viewport stays.");
  }
  background_->set_contrast(static_cast<float>(settings.smoothing));
  return background_->update(camera_, scene_lights(settings, lights_),
                             exposure_ * static_cast<float>(std::exp2(settings.exposure)));
}

bool SceneStream::refine(GstBaseSrc* source, const SceneSettings& settings, GstClockTime pts) {
  if (background_->samples() >= settings.samples || settings.refinement == Refinement::never) {
    return false;
  }
  if (settings.refinement == Refinement::always) return background_->refine(background_->height());
  if (!gst_base_src_is_live(source)) return false;
  guint64 due = gst_segment_to_running_time(&source->segment, GST_FORMAT_TIME, pts);
  if (due == GST_CLOCK_TIME_NONE || delay_ == GST_CLOCK_TIME_NONE) return false;
  due += delay_;
  bool better = false;
  while (!better) {
    const GstClockTime now = running_time(source);
    if (now == GST_CLOCK_TIME_NONE || now + GST_MSECOND >= due) break;
    better = background_->refine(refined_rows);
  }
  return better;
}

GstBuffer* SceneStream::make_buffer(const GstVideoInfo& info, bool changed) {
  const GstVideoFormat format = GST_VIDEO_INFO_FORMAT(&info);
  GstBuffer* buffer = nullptr;
  if (!changed && pixels_ != nullptr && pixels_format_ == format &&
      gst_memory_get_sizes(pixels_, nullptr, nullptr) == info.size) {
    buffer = gst_buffer_new();
    gst_buffer_append_memory(buffer, gst_memory_ref(pixels_));
    return buffer;
  }
  buffer = gst_buffer_new_allocate(nullptr, info.size, nullptr);
  GstMapInfo map;
  if (buffer == nullptr || !gst_buffer_map(buffer, &map, GST_MAP_WRITE)) {
    gst_clear_buffer(&buffer);
    throw Error(Error::Kind::io, "There is no memory for a picture of " +
                                     std::to_string(info.width) + "x" +
                                     std::to_string(info.height) + ".");
  }
  const bool bgr = format == GST_VIDEO_FORMAT_BGRx || format == GST_VIDEO_FORMAT_BGRA;
  background_->write(map.data, static_cast<std::size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&info, 0)),
                     bgr ? 2 : 0);
  gst_buffer_unmap(buffer, &map);
  forget_pixels();
  pixels_ = gst_buffer_get_memory(buffer, 0);
  pixels_format_ = format;
  return buffer;
}

bool SceneStream::first_live(GstBaseSrc* source) const {
  return gst_base_src_is_live(source) && delay_ == GST_CLOCK_TIME_NONE;
}

void SceneStream::start_live(GstBaseSrc* source, GstClockTime pts) {
  const GstClockTime now = running_time(source);
  const guint64 due = gst_segment_to_running_time(&source->segment, GST_FORMAT_TIME, pts);
  delay_ = now != GST_CLOCK_TIME_NONE && due < now ? now - due : 0;
}

std::uint64_t SceneStream::late_frames(GstBaseSrc* source, const GstVideoInfo& info,
                                       GstClockTime pts) const {
  GstClockTime now = running_time(source);
  if (!gst_base_src_is_live(source) || now == GST_CLOCK_TIME_NONE) return 0;
  if (delay_ != GST_CLOCK_TIME_NONE) now -= std::min(now, delay_);
  const guint64 position =
      gst_segment_position_from_running_time(&source->segment, GST_FORMAT_TIME, now);
  if (position == GST_CLOCK_TIME_NONE || position <= pts) return 0;
  return gst_util_uint64_scale(position - pts, info.fps_n, GST_SECOND * info.fps_d);
}

GstEvent* SceneStream::take_announcement() {
  std::string json = announcement_to_json(background_->announcement());
  if (json == announced_) return nullptr;
  announced_ = std::move(json);
  return gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                              gst_structure_new("polyhull-announcement", "json", G_TYPE_STRING,
                                                announced_.c_str(), nullptr));
}

}  // namespace polyhull::element
