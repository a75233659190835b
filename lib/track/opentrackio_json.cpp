// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/opentrackio_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "rig/lens.h"
#include "track/packet_error.h"
#include "track/tracked_pose.h"

namespace polyhull::opentrackio {
namespace {

using Json = nlohmann::json;

Vec3 three(const Json& transform, const char* name, std::array<const char*, 3> members,
           double missing) {
  Vec3 result(missing);
  const auto found = transform.find(name);
  if (found == transform.end()) return result;
  for (int i = 0; i < 3; ++i) {
    const char* member = members[static_cast<std::size_t>(i)];
    const bool there = found->is_object() && found->contains(member);
    result[i] = number(there ? &found->at(member) : nullptr, fmt::format("{}.{}", name, member));
  }
  return result;
}

std::vector<double> list(const Json& model, const char* name, std::size_t most) {
  std::vector<double> values;
  const auto found = model.find(name);
  if (found != model.end()) {
    if (!found->is_array() || found->size() > most)
      throw opentrackio_error(
          fmt::format("lens.distortion: {} must be a list of at most {} numbers", name, most));
    for (const Json& item : *found)
      values.push_back(number(&item, fmt::format("lens.distortion: {}", name)));
  }
  values.resize(most);
  return values;
}

/// What `lens.distortion` lists; a model alone is a list of one.
std::vector<const Json*> models_in(const Json& distortion) {
  if (distortion.is_object()) return {&distortion};
  if (!distortion.is_array()) throw opentrackio_error("lens.distortion must be a list");
  std::vector<const Json*> models;
  for (const Json& model : distortion) models.push_back(&model);
  return models;
}

/// The first of \p models whose name is one of \p names; null is the one that has none.
const Json* model_of(const std::vector<const Json*>& models, std::initializer_list<Json> names) {
  for (const Json* model : models)
    if (model->is_object() && std::count(names.begin(), names.end(), model->value("model", Json())))
      return model;
  return nullptr;
}

/// Whether the member \p name of a model tells coefficients that are not all 0, or none that can be read.
bool is_coefficient_of_a_distortion(const std::string& name, const Json& value) {
  if (name == "model" || value.is_number()) return false;  // such as the overscan
  return !value.is_array() ||
         std::any_of(value.begin(), value.end(), [](const Json& item) { return item != 0.0; });
}

/// A model's coefficients for points divided by \p f, in OpenCV's order.
std::vector<double> as_told(const Json& model, double f) {
  const std::vector<double> l = list(model, "radial", 6), q = list(model, "tangential", 2);
  const double f2 = f * f, f4 = f2 * f2, f6 = f4 * f2;
  std::vector<double> k{l[0] * f2, l[2] * f4, q[0] * f,  q[1] * f,
                        l[4] * f6, l[1] * f2, l[3] * f4, l[5] * f6};
  if (l[1] == 0.0 && l[3] == 0.0 && l[5] == 0.0) k.resize(5);
  for (const double coefficient : k)
    if (!std::isfinite(coefficient)) throw opentrackio_error("the lens's distortion is not finite");
  return k;
}

/// OpenCV's coefficients of a model that takes distorted points to undistorted ones.
std::vector<double> as_fitted(const Json& model, double f, const Vec2& reach,
                              FittedDistortion& last) {
  constexpr int columns = 16, rows = 12;
  Camera camera;  // whose pixels are points divided by f
  camera.distortion = as_told(model, f);
  const Vec2 corner = reach / f;
  std::vector<double> told = camera.distortion;
  told.insert(told.end(), {corner.x, corner.y});
  if (told != last.told) {
    const Distortion undistort(camera);
    std::vector<DistortedPoint> points;
    for (int i = 0; i <= columns; ++i)
      for (int j = 0; j <= rows; ++j) {
        const Vec2 real = corner * (2.0 * Vec2(i, j) / Vec2(columns, rows) - 1.0);
        points.push_back({undistort.distort(real), real});
      }
    last = {told, fit_distortion(points, corner.x / 1920.0)};
  }
  if (!last.coefficients)
    throw opentrackio_error(
        "lens.distortion, which is told from distorted to undistorted (D-U), is no lens's: "
        "nothing in OpenCV's terms is within half a pixel of it");
  return *last.coefficients;
}

/// The whole number from 0 to \p most at \p path; none where there is none.
std::optional<int> whole(const Json& root, const char* path, int most) {
  const Json* value = find(root, path);
  if (!value || !value->is_number_unsigned()) return {};
  const std::uint64_t number = value->get<std::uint64_t>();
  if (number > static_cast<std::uint64_t>(most)) return {};
  return static_cast<int>(number);
}

}  // namespace

const Json* find(const Json& root, const char* path) {
  const Json::json_pointer pointer(path);
  return root.contains(pointer) ? &root.at(pointer) : nullptr;
}

double number(const Json* value, const std::string& what) {
  if (!value || !value->is_number()) throw opentrackio_error(what + " must be a number");
  const double result = value->get<double>();
  if (!std::isfinite(result)) throw opentrackio_error(what + " is not finite");
  return result;
}

double number_or_zero(const Json& root, const char* path) {
  const Json* value = find(root, path);
  return value ? number(value, path) : 0.0;
}

std::optional<double> length(const Json& root, const char* path) {
  const Json* value = find(root, path);
  if (!value) return {};
  const double result = number(value, path);
  if (!(result > 0.0)) throw opentrackio_error(fmt::format("{} must be above 0", path));
  return result;
}

Placed placed(const Json& root) {
  Placed result;
  Mat3 stretched{1.0};  // the axes, and all scales so far
  if (const Json* transforms = find(root, "/transforms")) {
    if (!transforms->is_array()) throw opentrackio_error("transforms must be a list");
    for (const Json& transform : *transforms) {
      if (!transform.is_object()) throw opentrackio_error("transforms must hold objects");
      const Vec3 scale = three(transform, "scale", {"x", "y", "z"}, 1.0);
      if (!(scale.x > 0.0 && scale.y > 0.0 && scale.z > 0.0))
        throw opentrackio_error("a transform's scale must be above 0");
      result.place += stretched * three(transform, "translation", {"x", "y", "z"}, 0.0);
      const Vec3 angles = three(transform, "rotation", {"pan", "tilt", "roll"}, 0.0);
      const Mat3 turn = axes_of_angles(angles[0], angles[1], angles[2]);
      result.axes = result.axes * turn;
      stretched = stretched * turn;
      for (int i = 0; i < 3; ++i) stretched[i] *= scale[i];
    }
  }
  // Transforms place the sensor; rays meet at the entrance pupil, so many metres before it.
  result.place += result.axes[1] * number_or_zero(root, "/lens/entrancePupilOffset");
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(result.place[i]))
      throw opentrackio_error("the transforms together are not finite");
  return result;
}

std::optional<double> squeeze(const Json& root) {
  if (!find(root, "/static/camera/anamorphicSqueeze")) return {};
  const auto above = length(root, "/static/camera/anamorphicSqueeze/num");
  const auto below = length(root, "/static/camera/anamorphicSqueeze/denom");
  const double result = above && below ? *above / *below : 0.0;
  if (!(result > 0.0) || !std::isfinite(result))
    throw opentrackio_error("static.camera.anamorphicSqueeze must have num and denom above 0");
  return result;
}

std::optional<Timecode> timecode(const Json& root) {
  const auto part = [&](const char* path) {
    return whole(root, path, Timecode::most_rate).value_or(-1);
  };
  Timecode result;
  result.hours = part("/timing/timecode/hours");
  result.minutes = part("/timing/timecode/minutes");
  result.seconds = part("/timing/timecode/seconds");
  result.frames = part("/timing/timecode/frames");
  result.numerator = part("/timing/timecode/frameRate/num");
  result.denominator = part("/timing/timecode/frameRate/denom");
  if (const Json* drops = find(root, "/timing/timecode/dropFrame"); drops && drops->is_boolean())
    result.drops = drops->get<bool>();
  if (!time_of(result, false)) return {};
  if (const auto sub = whole(root, "/timing/timecode/subFrame", 9999); sub && *sub > 0) {
    const double samples = part("/timing/sampleRate/num"), of = part("/timing/sampleRate/denom");
    const double in_frame = samples / of * result.denominator / result.numerator;
    const bool told = samples > 0 && of > 0 && in_frame < 10000.0;
    result.part = *sub;
    result.parts = std::max(told ? static_cast<int>(std::lround(in_frame)) : 2, *sub + 1);
  }
  return result;
}

bool distorts(const Json& root) {
  const Json* told = find(root, "/lens/distortion");
  if (!told) return false;
  for (const Json* model : models_in(*told)) {
    if (!model->is_object()) return true;
    for (const auto& [name, value] : model->items())
      if (is_coefficient_of_a_distortion(name, value)) return true;
  }
  return false;
}

std::vector<double> opencv_distortion(const Json& root, double f, const Vec2& reach,
                                      FittedDistortion& last) {
  const Json* told = find(root, "/lens/distortion");
  if (!told || told->empty()) return {};
  const std::vector<const Json*> models = models_in(*told);
  if (!distorts(root)) return std::vector<double>(5);
  for (const char* axis : {"/lens/distortionOffset/x", "/lens/distortionOffset/y"})
    if (number_or_zero(root, axis) != 0.0)
      throw opentrackio_error(
          "lens.distortionOffset is not 0; OpenCV's lenses are centred on the principal point");
  if (const Json* model = model_of(models, {"Brown-Conrady U-D"})) return as_told(*model, f);
  if (const Json* model = model_of(models, {"Brown-Conrady D-U", nullptr}))
    return as_fitted(*model, f, reach, last);
  throw opentrackio_error(
      "lens.distortion has no model \"Brown-Conrady U-D\" or \"D-U\"; another cannot be had in "
      "OpenCV's terms");
}

}  // namespace polyhull::opentrackio
