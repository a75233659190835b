// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/opentrackio_sample.h"

#include <algorithm>

#include "base/parse_json.h"
#include "track/opentrackio_json.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;
using opentrackio::find;
using opentrackio::length;

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

void set_times(TrackedPose& pose, const Json& root) {
  pose.timecode = opentrackio::timecode(root);
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

void set_lens(TrackedPose& pose, const Json& root) {
  pose.focal_length_mm = length(root, "/lens/pinholeFocalLength");
  pose.sensor_width_mm = length(root, "/static/camera/activeSensorPhysicalDimensions/width");
  pose.sensor_height_mm = length(root, "/static/camera/activeSensorPhysicalDimensions/height");
  pose.projection_offset_mm = {opentrackio::number_or_zero(root, "/lens/projectionOffset/x"),
                               opentrackio::number_or_zero(root, "/lens/projectionOffset/y")};
  pose.focus_distance_m = length(root, "/lens/focusDistance");
  pose.f_number = length(root, "/lens/fStop");
  if (pose.focal_length_mm)
    pose.distortion =
        opentrackio::opencv_distortion(root, *pose.focal_length_mm).value_or(std::vector<double>());
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
    const Json* transforms = find(root, "/transforms");
    if (!transforms || transforms->empty()) throw broken("a sample without transforms");
    const opentrackio::Placed placed = opentrackio::placed(root);
    pose.axes = placed.axes;
    pose.place = placed.place;
    set_times(pose, root);
    set_lens(pose, root);
  } catch (const Json::exception& error) {
    throw broken(error.what());
  }
  return pose;
}

}  // namespace polyhull
