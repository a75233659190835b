// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/scenesrc/stream.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/error.h"
#include "base/srgb.h"
#include "plugins/common/live/live_pad.h"
#include "plugins/common/memory/scene_metas.h"

namespace polyhull::element {
namespace {

constexpr int refined_rows = 4;   // between two looks at the clock
constexpr int refined_share = 5;  // of the time until a live frame leaves, one part

}  // namespace

void SceneStream::open(const SceneSettings& settings) {
  close();
  scenes_.open(settings);
}

void SceneStream::close() {
  sent_.reset();
  scenes_.close();
  other_scene_ = false;
  camera_ = Camera{};
  lens_watch_ = {};
  announced_.clear();
  lights_missing_.clear();
  clipped_.reset();
}

bool SceneStream::follow_scene(const SceneSettings& settings, const SceneWish& wish) {
  const OpenedScene* before = &scenes_.shown();
  const bool followed = scenes_.follow(settings, wish);
  other_scene_ |= &scenes_.shown() != before;
  return followed;
}

Background::Work SceneStream::draw(GstElement* element, Statistics& statistics,
                                   const SceneSettings& settings, const ViewportControl& control,
                                   const std::optional<TrackedPose>& tracked,
                                   const GstVideoInfo& info, GstClockTime pts) {
  OpenedScene& shown = scenes_.shown();
  Background& background = *shown.background;
  try {
    camera_ = scene_viewport(settings, control, tracked, key_frames_.of(settings.key_frames),
                             background.scene(), static_cast<double>(pts) / GST_SECOND, info.width,
                             info.height);
    aperture_ = tracked ? aperture_of(*tracked) : 0.0;
    focus_distance_ = tracked ? tracked->focus_distance_m.value_or(0.0) : 0.0;
    if (const std::string why = lens_watch_.look(camera_); !why.empty())
      statistics.warn(element, "warnings", why);
  } catch (const Error& error) {
    // A viewport that is impossible for a moment does not end the stream.
    if (camera_.width != info.width || camera_.height != info.height) throw;
    // It may be one of the scene to come.
    if (!scenes_.is_awaited())
      statistics.warn(element, "warnings",
                      fmt::format("{} The last viewport stays.", error.what()));
  }
  background.set_method(settings.method);
  background.set_contrast(static_cast<float>(settings.smoothing));
  const SceneLights lights = shown.lights_by(settings);
  if (std::exchange(lights_missing_, lights.missing) != lights.missing && !lights.missing.empty())
    statistics.warn(element, "lights-missing", lights.missing);
  undimmed_ = lights.undimmed != lights.lights ? lights.undimmed : std::vector<Light>();
  const float sky = shown.sky_by(settings);
  undimmed_sky_.reset();
  if (sky != 1.0f) undimmed_sky_ = shown.rest->sky;
  const Background::Work work = background.update(
      camera_, lights.lights,
      shown.exposure * static_cast<float>(std::exp2(settings.exposure_compensation)), sky);
  const bool other = std::exchange(other_scene_, false);
  if (shown.light_ms) return Background::Work::lit;
  // The picture is not the last one that was sent.
  return other && work == Background::Work::none ? Background::Work::drawn : work;
}

std::string SceneStream::about_scene(const SceneSettings& settings) const {
  const OpenedScene& shown = scenes_.shown();
  const Scene& scene = shown.background->scene();
  std::string said;
  if (shown.assumed && !settings.assumed_light)
    said = fmt::format(
        "The scene '{}' holds no light, and none is assumed: it is dark. Give it a lamp, sun or "
        "glowing plane, or set assumed-light=true.",
        scene.name);
  else if (shown.assumed)
    said = fmt::format(
        "The scene '{}' holds no light: an even sky and a sun from the right above the front are "
        "assumed, which do not reach into closed rooms. Give it a lamp, sun or glowing plane, or "
        "set assumed-light=false to have it dark.",
        scene.name);
  said = joined(joined(said, shown.nodes_missing), shown.found.missing);
  return scene.left_out.empty()
             ? said
             : joined(said, fmt::format("Of the scene '{}' are not drawn as its file says: {}.",
                                        scene.name, scene.left_out));
}

std::string SceneStream::clipped(const SceneSettings& settings) {
  constexpr std::size_t step = 31;      // pixels: a sample is enough, and costs nothing
  constexpr float middle_grey = 0.18f;  // of white, for half of the pixels
  const OpenedScene& shown = scenes_.shown();
  if (clipped_ && clipped_->same_files(shown.file)) return {};
  const std::vector<Vec3f>& picture = shown.background->picture();
  std::vector<float> light;
  for (std::size_t i = 0; i < picture.size(); i += step)
    light.push_back(glm::dot(picture[i], luminance_weights<float>));
  const auto white = std::count_if(light.begin(), light.end(), [](float l) { return l >= 1.0f; });
  if (2 * static_cast<std::size_t>(white) <= light.size()) return {};
  clipped_ = shown.file;
  const auto middle = light.begin() + static_cast<std::ptrdiff_t>(light.size() / 2);
  std::nth_element(light.begin(), middle, light.end());
  const float factor = middle_grey / *middle;
  const double stops = std::log2(factor), compensation = settings.exposure_compensation + stops;
  return fmt::format(
      "Most of the picture is clipped to white ({:.0f} %): for the lights of '{}' it is exposed "
      "{:.1f} stops too long. Set {}the scene's exposure to {:.3g}; of a file from Blender, look "
      "at "
      "the units of its lamps (\"Light units\" in docs/scenes.md).",
      100.0 * static_cast<double>(white) / static_cast<double>(light.size()), shown.file.name,
      -stops,
      compensation >= -10.0 ? fmt::format("exposure-compensation={:.1f}, or ", compensation) : "",
      shown.exposure * factor);
}

bool SceneStream::refine(GstBaseSrc* source, const SceneSettings& settings,
                         const GstVideoInfo& info, GstClockTime due) {
  Background& background = *scenes_.shown().background;
  // After a second: a viewport that moves now and then shall not pay for it.
  if (settings.refinement == Refinement::never)
    background.rest(std::max(info.fps_n / info.fps_d, 1));
  if (background.samples() >= settings.samples || settings.refinement == Refinement::never) {
    return false;
  }
  if (settings.refinement == Refinement::always) return background.refine(background.height());
  if (!GST_CLOCK_TIME_IS_VALID(due)) return false;
  // A part of the time that is left: cameras and compositor want the processor, too.
  const std::int64_t begin = running_time_now(GST_ELEMENT_CAST(source));
  if (begin == no_time) return false;
  const std::int64_t end = begin + (static_cast<std::int64_t>(due) - begin) / refined_share;
  bool better = false;
  for (std::int64_t now = begin; !better && now != no_time && now < end;
       now = running_time_now(GST_ELEMENT_CAST(source)))
    better = background.refine(refined_rows);
  return better;
}

GstBuffer* SceneStream::make_buffer(const GstVideoInfo& info, bool changed) {
  const GstVideoFormat format = GST_VIDEO_INFO_FORMAT(&info);
  Background& background = *scenes_.shown().background;
  if (changed || sent_ == nullptr || sent_format_ != format ||
      gst_buffer_get_size(sent_.get()) != info.size) {
    MappedMemory memory(gst_allocator_alloc(nullptr, info.size, nullptr), GST_MAP_WRITE);
    const bool bgr = format == GST_VIDEO_FORMAT_BGRx || format == GST_VIDEO_FORMAT_BGRA;
    background.write(memory.data(), static_cast<std::size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&info, 0)),
                     bgr ? 2 : 0);
    sent_.reset(gst_buffer_new());
    gst_buffer_append_memory(sent_.get(), gst_memory_ref(memory.memory()));
    sent_format_ = format;
  }
  GstBuffer* buffer = gst_buffer_copy(sent_.get());
  PlanesMeta::set(buffer, background.planes());
  return buffer;
}

GstEvent* SceneStream::take_announcement() {
  Announcement announcement = scenes_.shown().background->announcement();
  announcement.scene_version = scenes_.shown().file.version;
  announcement.pose = scenes_.shown().found.pose;
  announcement.environment = scenes_.shown().file.environment;
  announcement.undimmed = undimmed_;
  announcement.undimmed_sky = undimmed_sky_;
  announcement.aperture = aperture_;
  announcement.focus_distance = focus_distance_;
  std::string json = announcement_to_json(announcement);
  if (json == announced_) return nullptr;
  announced_ = std::move(json);
  return gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                              gst_structure_new("polyhull-announcement", "json", G_TYPE_STRING,
                                                announced_.c_str(), nullptr));
}

}  // namespace polyhull::element
