// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/key_configuration.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "rig/rig.h"
#include "silhouette/key/garbage_matte.h"

namespace polyhull {
namespace {

Rgb rgb_of(std::uint32_t colour) {
  return {static_cast<std::uint8_t>(colour >> 16), static_cast<std::uint8_t>(colour >> 8),
          static_cast<std::uint8_t>(colour)};
}

std::optional<Rgb> sample_of(int colour) {
  if (colour < 0) return std::nullopt;
  return rgb_of(static_cast<std::uint32_t>(colour));
}

std::shared_ptr<const Picture> read(const std::string& path, const char* property, int channels,
                                    int width, int height) {
  if (path.empty()) return nullptr;
  std::shared_ptr<Picture> picture;
  try {
    picture =
        std::make_shared<Picture>(channels == 1 ? load_grey_mask(path) : load_picture(path, 3));
  } catch (const Error& error) {
    throw Error(error.kind(),
                "{} Set {} to a PNG or JPEG file of the frames' size, or leave it empty.",
                error.what(), property);
  }
  if (picture->width != width || picture->height != height) {
    throw Error(Error::Kind::bad_input,
                "The picture '{}' given as {} has {}x{} pixels, but the frames have {}x{}; give a "
                "picture of the frames' size.",
                path, property, picture->width, picture->height, width, height);
  }
  return picture;
}

/// What the rig's bounds leave of the camera's view.
Rings outline_of_bounds(const std::string& path, const std::string& name, int width, int height) {
  const Rig rig = [&] {
    try {
      return load_rig(path);
    } catch (const Error& error) {
      throw Error(error.kind(),
                  "{} The property rig wants a rig file with bounds, as polyhull-rig writes it, "
                  "or nothing.",
                  error.what());
    }
  }();
  if (!rig.bounds) {
    throw Error(Error::Kind::bad_input,
                "The rig file '{}' has no bounds, so it limits no view; add bounds to it or leave "
                "the property rig empty.",
                path);
  }
  const Camera* camera = rig.find(name);
  if (camera == nullptr) {
    std::string names;
    for (const Camera& known : rig.cameras) names += (names.empty() ? "" : ", ") + known.name;
    throw Error(
        Error::Kind::bad_input,
        "The rig file '{}' has no camera called '{}'; set the property camera to one of its ({}).",
        path, name, names);
  }
  if (camera->width != width || camera->height != height) {
    throw Error(Error::Kind::bad_input,
                "The camera '{}' of '{}' has frames of {}x{} pixels, but {}x{} arrive; use the rig "
                "file of this camera's picture size.",
                name, path, camera->width, camera->height, width, height);
  }
  return bounds_outline(*camera, *rig.bounds);
}

}  // namespace

std::shared_ptr<const Picture> KeyConfiguration::outside_mask(const Request& request,
                                                              Rings& outside) const {
  const auto [values, camera, width, height] = request;
  auto mask = read(values.outside_mask, "outside-mask", 1, width, height);
  if (values.rig.empty()) return mask;
  Rings outline = outline_of_bounds(values.rig, camera, width, height);
  if (outline.empty()) return mask;
  if (outside.empty()) {
    outside = std::move(outline);
    return mask;
  }
  // Two restrictions at once: the keyer knows one set of polygons, so the bounds go into the mask.
  auto both = std::make_shared<Picture>(polygon_mask(outline, width, height, true));
  if (mask != nullptr) {
    for (std::size_t i = 0; i < both->pixels.size(); ++i) both->pixels[i] |= mask->pixels[i];
  }
  return both;
}

KeySettings KeyConfiguration::settings_for(const Request& request) const {
  const KeyValues& values = request.values;
  const int width = request.width;
  const int height = request.height;
  KeySettings s;
  s.method = values.method;
  s.key = values.key;
  s.colour = rgb_of(values.key_colour);
  s.strength = values.strength;
  s.bright_threshold = values.bright_threshold;
  s.red_gain = values.red_gain;
  s.blue_gain = values.blue_gain;
  if (values.roi_x != 0 || values.roi_y != 0 || values.roi_width != 0 || values.roi_height != 0) {
    // Not clipped here: a region that misses the frame leaves nothing, it does not mean "all of
    // it".
    s.roi = {values.roi_x, values.roi_y,
             values.roi_width != 0 ? values.roi_width : std::max(width - values.roi_x, 1),
             values.roi_height != 0 ? values.roi_height : std::max(height - values.roi_y, 1)};
  }
  s.screen = sample_of(values.screen_colour);
  s.foreground = sample_of(values.foreground_colour);
  s.clip_black = values.clip_black;
  s.clip_white = values.clip_white;
  s.choke = values.choke;
  s.close = values.close;
  s.spill = values.spill;
  s.difference_low = values.difference_low;
  s.difference_high = values.difference_high;
  s.shadow_darkest = values.shadow_darkest;
  s.light_brightest = values.light_brightest;
  s.inside_polygon = parse_polygons(values.inside_polygon);

  const bool same_size = has_settings(width, height);
  const KeyValues before = same_size ? in_force_->values : KeyValues{};
  s.plate = same_size && values.clean_plate == before.clean_plate
                ? settings_.plate
                : read(values.clean_plate, "clean-plate", 3, width, height);
  s.inside_mask = same_size && values.inside_mask == before.inside_mask
                      ? settings_.inside_mask
                      : read(values.inside_mask, "inside-mask", 1, width, height);
  if (same_size && values.outside_mask == before.outside_mask && values.rig == before.rig &&
      values.outside_polygon == before.outside_polygon && request.camera == in_force_->camera) {
    s.outside_mask = settings_.outside_mask;
    s.outside_polygon = settings_.outside_polygon;
  } else {
    s.outside_polygon = parse_polygons(values.outside_polygon);
    s.outside_mask = outside_mask(request, s.outside_polygon);
  }
  return s;
}

void KeyConfiguration::apply(const KeyValues& values, const std::string& camera, int width,
                             int height, const std::function<void(const KeySettings&)>& accept) {
  Request request{values, camera, width, height};
  if (in_force_ == request || refused_ == request) return;
  try {
    KeySettings settings = settings_for(request);
    accept(settings);
    settings_ = std::move(settings);
    in_force_ = std::move(request);
    refused_.reset();
  } catch (const Error&) {
    if (has_settings(width, height)) refused_ = std::move(request);
    throw;
  }
}

bool KeyConfiguration::due_for_sampling(int resample) {
  if (resample == 0) {
    frames_since_sampling_ = 0;
    return false;
  }
  if (++frames_since_sampling_ <= resample) return false;
  frames_since_sampling_ = 1;
  return true;
}

bool KeyConfiguration::sample_and_learn(const KeyValues& values,
                                        const std::function<Keyer&()>& keyer) {
  const bool due = due_for_sampling(values.resample);
  if (due) keyer().recalibrate();
  if (values.learn_plate == learning_) return due;
  learning_ = values.learn_plate;
  if (learning_ > 0) keyer().learn_plate(learning_);
  return true;
}

}  // namespace polyhull
