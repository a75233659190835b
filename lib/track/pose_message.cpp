// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/pose_message.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/rotation.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;

constexpr const char* format = "polyhull-camera";
constexpr int version = 1;
constexpr double most_prediction = 10e9;

Error broken(const std::string& what) {
  return Error(Error::Kind::bad_input, "A camera's message cannot be used: {}.", what);
}

double finite(const Json& value, const char* name) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    throw broken(fmt::format("'{}' must hold finite numbers", name));
  return value.get<double>();
}

template <std::size_t count>
std::array<double, count> numbers(const Json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end() || !found->is_array() || found->size() != count)
    throw broken(fmt::format("'{}' must be a list of {} numbers", name, count));
  std::array<double, count> result;
  for (std::size_t i = 0; i < count; ++i) result[i] = finite((*found)[i], name);
  return result;
}

std::optional<double> length(const Json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end()) return {};
  const double value = finite(*found, name);
  if (!(value > 0.0)) throw broken(fmt::format("'{}' must be above 0", name));
  return value;
}

std::vector<double> distortion(const Json& root) {
  std::vector<double> result;
  const auto found = root.find("distortion");
  if (found == root.end()) return result;
  const std::size_t count = found->is_array() ? found->size() : 0;
  if (count != 4 && count != 5 && count != 8 && count != 12)
    throw broken("'distortion' must be a list of 4, 5, 8 or 12 numbers");
  for (const Json& k : *found) result.push_back(finite(k, "distortion"));
  return result;
}

void check_rotation(const Mat3& R) {
  if (!(rotation_error(R) < 1e-6)) throw broken("'R' is not a rotation");
}

}  // namespace

std::string pose_message_to_json(const PoseMessage& message) {
  const Extrinsics extrinsics = extrinsics_of(message.pose);
  const Vec3& t = extrinsics.t;
  Json out = {{"format", format},
              {"version", version},
              {"source", message.pose.source},
              {"R", to_rows(extrinsics.R)},
              {"t", {t.x, t.y, t.z}}};
  if (message.pose.focal_length_mm) out["focal_length_mm"] = *message.pose.focal_length_mm;
  if (message.pose.sensor_width_mm) out["sensor_width_mm"] = *message.pose.sensor_width_mm;
  if (message.pose.sensor_height_mm) out["sensor_height_mm"] = *message.pose.sensor_height_mm;
  if (message.pose.projection_offset_mm != Vec2(0.0))
    out["projection_offset_mm"] = {message.pose.projection_offset_mm.x,
                                   message.pose.projection_offset_mm.y};
  if (!message.pose.distortion.empty()) out["distortion"] = message.pose.distortion;
  if (message.pose.focus_distance_m) out["focus_distance_m"] = *message.pose.focus_distance_m;
  if (message.pose.f_number) out["f_number"] = *message.pose.f_number;
  if (message.prediction_ns > 0) out["prediction_ns"] = message.prediction_ns;
  // Names may hold any bytes; JSON must be UTF-8.
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

PoseMessage parse_pose_message(std::string_view text) {
  const auto root = parse_json<Json>(text, "camera's message");
  if (!root.is_object() || root.value("format", Json()) != format)
    throw broken("it is not JSON of the format 'polyhull-camera'");
  if (root.value("version", Json()) != version) throw broken("this program reads version 1 only");
  PoseMessage message;
  if (const auto source = root.find("source"); source != root.end() && source->is_string())
    message.pose.source = source->get<std::string>();
  const Mat3 R = from_rows(numbers<9>(root, "R"));
  check_rotation(R);
  const auto t = numbers<3>(root, "t");
  set_extrinsics(message.pose, {R, {t[0], t[1], t[2]}});
  message.pose.focal_length_mm = length(root, "focal_length_mm");
  message.pose.sensor_width_mm = length(root, "sensor_width_mm");
  message.pose.sensor_height_mm = length(root, "sensor_height_mm");
  if (root.contains("projection_offset_mm")) {
    const auto offset = numbers<2>(root, "projection_offset_mm");
    message.pose.projection_offset_mm = {offset[0], offset[1]};
  }
  message.pose.distortion = distortion(root);
  message.pose.focus_distance_m = length(root, "focus_distance_m");
  message.pose.f_number = length(root, "f_number");
  if (const auto found = root.find("prediction_ns"); found != root.end()) {
    const double prediction = finite(*found, "prediction_ns");
    if (!(prediction >= 0.0 && prediction <= most_prediction))
      throw broken("'prediction_ns' must be between 0 and 10 s");
    message.prediction_ns = static_cast<std::int64_t>(prediction);
  }
  return message;
}

}  // namespace polyhull
