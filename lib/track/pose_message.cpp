// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/pose_message.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/rotation.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;

constexpr const char* format = "polyhull-camera";
constexpr int version = 1;
constexpr double longest_duration = 10e9;  // ns

Error unusable(const std::string& what) {
  return Error(Error::Kind::bad_input, "A camera's message cannot be used: {}.", what);
}

double finite(const Json& value, const char* name) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    throw unusable(fmt::format("'{}' must hold finite numbers", name));
  return value.get<double>();
}

template <std::size_t count>
std::array<double, count> numbers(const Json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end() || !found->is_array() || found->size() != count)
    throw unusable(fmt::format("'{}' must be a list of {} numbers", name, count));
  std::array<double, count> result;
  for (std::size_t i = 0; i < count; ++i) result[i] = finite((*found)[i], name);
  return result;
}

std::optional<double> positive(const Json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end()) return {};
  const double value = finite(*found, name);
  if (!(value > 0.0)) throw unusable(fmt::format("'{}' must be above 0", name));
  return value;
}

std::vector<double> distortion(const Json& root) {
  std::vector<double> result;
  const auto found = root.find("distortion");
  if (found == root.end()) return result;
  const std::size_t count = found->is_array() ? found->size() : 0;
  if (count != 4 && count != 5 && count != 8 && count != 12)
    throw unusable("'distortion' must be a list of 4, 5, 8 or 12 numbers");
  for (const Json& k : *found) result.push_back(finite(k, "distortion"));
  return result;
}

/// ns; 0 where there is none.
std::int64_t duration(const Json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end()) return 0;
  const double value = finite(*found, name);
  if (!(value >= 0.0 && value <= longest_duration))
    throw unusable(fmt::format("'{}' must be between 0 and 10 s", name));
  return static_cast<std::int64_t>(value);
}

void write_timecode(const Timecode& t, Json& out) {
  out["timecode"] = fmt::format("{:02}:{:02}:{:02}:{:02}", t.hours, t.minutes, t.seconds, t.frames);
  out["timecode_rate"] = {t.numerator, t.denominator};
  if (t.drops) out["timecode_drops"] = *t.drops;
  if (t.parts > 1) out["timecode_part"] = {t.part, t.parts};
}

/// Two whole numbers; none where there is nothing.
std::optional<std::array<int, 2>> pair(const Json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end()) return {};
  std::array<int, 2> result{};
  const bool two = found->is_array() && found->size() == 2;
  for (std::size_t i = 0; i < 2; ++i) {
    if (!two || !(*found)[i].is_number_unsigned() ||
        (*found)[i].get<std::uint64_t>() > Timecode::most_rate)
      throw unusable(
          fmt::format("'{}' must be two whole numbers from 0 to {}", name, Timecode::most_rate));
    result[i] = (*found)[i].get<int>();
  }
  return result;
}

std::optional<Timecode> timecode(const Json& root) {
  const auto found = root.find("timecode");
  if (found == root.end()) return {};
  Timecode result;
  const std::string text = found->is_string() ? found->get<std::string>() : "";
  char tail = 0;
  const bool is_text = std::sscanf(text.c_str(), "%2d:%2d:%2d:%7d%c", &result.hours,
                                   &result.minutes, &result.seconds, &result.frames, &tail) == 4;
  const auto rate = pair(root, "timecode_rate");
  if (rate) result.numerator = (*rate)[0], result.denominator = (*rate)[1];
  if (const auto part = pair(root, "timecode_part"))
    result.part = (*part)[0], result.parts = (*part)[1];
  if (const auto drops = root.find("timecode_drops"); drops != root.end() && drops->is_boolean())
    result.drops = drops->get<bool>();
  if (!is_text || !rate || !time_of(result, false))
    throw unusable(
        "'timecode' must be as \"10:00:00:00\", and exist at so many frames a second as "
        "'timecode_rate' says");
  return result;
}

void check_rotation(const Mat3& R) {
  if (!(rotation_error(R) < 1e-6)) throw unusable("'R' is not a rotation");
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
  if (message.pose.timecode) write_timecode(*message.pose.timecode, out);
  if (message.timecode_lag_ns > 0) out["timecode_lag_ns"] = message.timecode_lag_ns;
  // Names may hold any bytes; JSON must be UTF-8.
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

PoseMessage parse_pose_message(std::string_view text) {
  const auto root = parse_json<Json>(text, "camera's message");
  if (!root.is_object() || root.value("format", Json()) != format)
    throw unusable("it is not JSON of the format 'polyhull-camera'");
  if (root.value("version", Json()) != version) throw unusable("this program reads version 1 only");
  PoseMessage message;
  if (const auto source = root.find("source"); source != root.end() && source->is_string())
    message.pose.source = source->get<std::string>();
  const Mat3 R = from_rows(numbers<9>(root, "R"));
  check_rotation(R);
  const auto t = numbers<3>(root, "t");
  set_extrinsics(message.pose, {R, {t[0], t[1], t[2]}});
  message.pose.focal_length_mm = positive(root, "focal_length_mm");
  message.pose.sensor_width_mm = positive(root, "sensor_width_mm");
  message.pose.sensor_height_mm = positive(root, "sensor_height_mm");
  if (root.contains("projection_offset_mm")) {
    const auto offset = numbers<2>(root, "projection_offset_mm");
    message.pose.projection_offset_mm = {offset[0], offset[1]};
  }
  message.pose.distortion = distortion(root);
  message.pose.focus_distance_m = positive(root, "focus_distance_m");
  message.pose.f_number = positive(root, "f_number");
  message.prediction_ns = duration(root, "prediction_ns");
  message.pose.timecode = timecode(root);
  message.timecode_lag_ns = duration(root, "timecode_lag_ns");
  return message;
}

}  // namespace polyhull
