// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/opentrackio_json.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "track/tracked_pose.h"

namespace polyhull::opentrackio {
namespace {

using Json = nlohmann::json;

Error broken(const std::string& what) {
  return Error(Error::Kind::bad_input, "OpenTrackIO: {}.", what);
}

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
      throw broken(
          fmt::format("lens.distortion: {} must be a list of at most {} numbers", name, most));
    for (const Json& item : *found)
      values.push_back(number(&item, fmt::format("lens.distortion: {}", name)));
  }
  values.resize(most);
  return values;
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
  if (!value || !value->is_number()) throw broken(what + " must be a number");
  const double result = value->get<double>();
  if (!std::isfinite(result)) throw broken(what + " is not finite");
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
  if (!(result > 0.0)) throw broken(fmt::format("{} must be above 0", path));
  return result;
}

Placed placed(const Json& root) {
  Placed result;
  if (const Json* transforms = find(root, "/transforms")) {
    if (!transforms->is_array()) throw broken("transforms must be a list");
    for (const Json& transform : *transforms) {
      if (!transform.is_object()) throw broken("transforms must hold objects");
      if (three(transform, "scale", {"x", "y", "z"}, 1.0) != Vec3(1.0))
        throw broken("a transform scales; a camera cannot");
      result.place += result.axes * three(transform, "translation", {"x", "y", "z"}, 0.0);
      const Vec3 angles = three(transform, "rotation", {"pan", "tilt", "roll"}, 0.0);
      result.axes = result.axes * axes_of_angles(angles[0], angles[1], angles[2]);
    }
  }
  // Transforms place the sensor; rays meet at the entrance pupil, so many metres before it.
  result.place += result.axes[1] * number_or_zero(root, "/lens/entrancePupilOffset");
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(result.place[i])) throw broken("the transforms together are not finite");
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

std::optional<std::vector<double>> opencv_distortion(const Json& root, double f) {
  const Json* models = find(root, "/lens/distortion");
  if (!models) return std::vector<double>();
  if (!models->is_array()) throw broken("lens.distortion must be a list");
  if (models->empty()) return std::vector<double>();
  const Json* found = nullptr;
  for (const Json& model : *models)
    if (model.is_object() && model.value("model", Json()) == "Brown-Conrady U-D") found = &model;
  for (const char* axis : {"/lens/distortionOffset/x", "/lens/distortionOffset/y"})
    if (number_or_zero(root, axis) != 0.0) return {};
  if (!found) return {};
  const std::vector<double> l = list(*found, "radial", 6), q = list(*found, "tangential", 2);
  const double f2 = f * f, f4 = f2 * f2, f6 = f4 * f2;
  std::vector<double> k{l[0] * f2, l[2] * f4, q[0] * f,  q[1] * f,
                        l[4] * f6, l[1] * f2, l[3] * f4, l[5] * f6};
  if (l[1] == 0.0 && l[3] == 0.0 && l[5] == 0.0) k.resize(5);
  for (const double coefficient : k)
    if (!std::isfinite(coefficient)) throw broken("the lens's distortion is not finite");
  return k;
}

}  // namespace polyhull::opentrackio
