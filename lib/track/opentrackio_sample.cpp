// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/opentrackio_sample.h"

#include <algorithm>
#include <cmath>

#include "base/parse_json.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;

Error broken(const std::string& what) {
  return Error(Error::Kind::bad_input, "OpenTrackIO: {}.", what);
}

// nlohmann's CBOR reader calls itself for each array and object within another; what this one
// refuses ends the reading.
class ShallowReader : public nlohmann::detail::json_sax_dom_parser<Json> {
 public:
  using Base = nlohmann::detail::json_sax_dom_parser<Json>;
  explicit ShallowReader(Json& root) : Base(root, /*allow_exceptions=*/false) {}

  bool start_object(std::size_t size) {
    return ++depth_ <= deepest_json && Base::start_object(size);
  }
  bool start_array(std::size_t size) { return ++depth_ <= deepest_json && Base::start_array(size); }
  bool end_object() {
    --depth_;
    return Base::end_object();
  }
  bool end_array() {
    --depth_;
    return Base::end_array();
  }

 private:
  std::size_t depth_ = 0;
};

// It also calls itself for strings of indefinite length within each other, which begin with these
// bytes and which no sender needs.
bool may_nest_strings(const std::vector<std::uint8_t>& bytes) {
  constexpr std::ptrdiff_t most = 1024;
  return std::count(bytes.begin(), bytes.end(), 0x5F) > most ||
         std::count(bytes.begin(), bytes.end(), 0x7F) > most;
}

Json parse_cbor(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() > OpenTrackIOSegments::largest_sample || may_nest_strings(bytes))
    throw broken("a sample that is too large or too deep to be read");
  Json root;
  ShallowReader reader(root);
  try {
    if (Json::sax_parse(bytes, &reader, Json::input_format_t::cbor)) return root;
  } catch (const Json::exception& error) {
    throw broken(fmt::format("a sample that is not CBOR ({})", error.what()));
  }
  throw broken("a sample that is not CBOR, or nested too deep");
}

Json parse(const OpenTrackIOBytes& sample) {
  if (sample.encoding == OpenTrackIOEncoding::cbor) return parse_cbor(sample.bytes);
  return parse_json<Json>({reinterpret_cast<const char*>(sample.bytes.data()), sample.bytes.size()},
                          "OpenTrackIO sample");
}

// The value at a path such as /lens/distortion, or null.
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

std::optional<double> length(const Json& root, const char* path) {
  const Json* value = find(root, path);
  if (!value) return {};
  const double result = number(value, path);
  if (!(result > 0.0)) throw broken(fmt::format("{} must be above 0", path));
  return result;
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

void set_pose(TrackedPose& pose, const Json& root) {
  const Json* transforms = find(root, "/transforms");
  if (!transforms || !transforms->is_array() || transforms->empty())
    throw broken("a sample without transforms");
  for (const Json& transform : *transforms) {
    if (!transform.is_object()) throw broken("transforms must hold objects");
    if (three(transform, "scale", {"x", "y", "z"}, 1.0) != Vec3(1.0))
      throw broken("a transform scales; a camera cannot");
    pose.place += pose.axes * three(transform, "translation", {"x", "y", "z"}, 0.0);
    const Vec3 angles = three(transform, "rotation", {"pan", "tilt", "roll"}, 0.0);
    pose.axes = pose.axes * axes_of_angles(angles[0], angles[1], angles[2]);
  }
  if (const Json* offset = find(root, "/lens/entrancePupilOffset"))
    pose.place += pose.axes[1] * number(offset, "lens.entrancePupilOffset");
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(pose.place[i])) throw broken("the transforms together are not finite");
}

void set_times(TrackedPose& pose, const Json& root) {
  if (!pose.sequence) {
    if (const Json* sequence = find(root, "/timing/sequenceNumber")) {
      if (!sequence->is_number_unsigned()) throw broken("timing.sequenceNumber must be whole");
      pose.sequence = static_cast<std::uint16_t>(sequence->get<std::uint64_t>());
    }
  }
  const Json* seconds = find(root, "/timing/sampleTimestamp/seconds");
  if (!seconds) return;
  const Json* nanoseconds = find(root, "/timing/sampleTimestamp/nanoseconds");
  // PTP's seconds have 48 bits; beyond 33 they would not fit into nanoseconds.
  constexpr std::uint64_t most_seconds = std::uint64_t{1} << 33, second = 1'000'000'000;
  if (!seconds->is_number_unsigned() || seconds->get<std::uint64_t>() > most_seconds ||
      (nanoseconds &&
       (!nanoseconds->is_number_unsigned() || nanoseconds->get<std::uint64_t>() >= second)))
    throw broken("timing.sampleTimestamp must be whole seconds and nanoseconds");
  pose.capture_time_ns =
      static_cast<std::int64_t>(seconds->get<std::uint64_t>() * second +
                                (nanoseconds ? nanoseconds->get<std::uint64_t>() : 0));
}

}  // namespace

TrackedPose parse_opentrackio_sample(const OpenTrackIOBytes& sample) {
  const Json root = parse(sample);
  if (!root.is_object()) throw broken("a sample must be an object");
  TrackedPose pose;
  pose.sequence = sample.sequence;
  try {
    if (const Json* id = find(root, "/sourceId"); id && id->is_string())
      pose.source = id->get<std::string>();
    else if (const Json* index = find(root, "/sourceNumber"); index && index->is_number_unsigned())
      pose.source = fmt::format("opentrackio {}", index->get<std::uint64_t>());
    set_pose(pose, root);
    set_times(pose, root);
    pose.focal_length_mm = length(root, "/lens/pinholeFocalLength");
    pose.sensor_width_mm = length(root, "/static/camera/activeSensorPhysicalDimensions/width");
    pose.sensor_height_mm = length(root, "/static/camera/activeSensorPhysicalDimensions/height");
  } catch (const Json::exception& error) {
    throw broken(error.what());
  }
  return pose;
}

}  // namespace polyhull
