// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/opentrackio_sample.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/parse_json.h"
#include "track/opentrackio_json.h"
#include "track/packet_error.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;
using opentrackio::find;
using opentrackio::length;

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
    throw opentrackio_error("a sample that is too large or too deep to be read");
  Json root;
  ShallowReader reader(root);
  try {
    const auto content = without_cbor_mark(bytes);
    if (Json::sax_parse(content.begin(), content.end(), &reader, Json::input_format_t::cbor))
      return root;
  } catch (const Json::exception& error) {
    throw opentrackio_error(fmt::format("a sample that is not CBOR ({})", error.what()));
  }
  throw opentrackio_error("a sample that is not CBOR, or nested too deep");
}

Json parse(const OpenTrackIOBytes& sample) {
  if (sample.encoding == OpenTrackIOEncoding::cbor) return parse_cbor(sample.bytes);
  return parse_json<Json>({reinterpret_cast<const char*>(sample.bytes.data()), sample.bytes.size()},
                          "OpenTrackIO sample");
}

void check_version(const Json& root) {
  const Json* version = find(root, "/protocol/version");
  if (!version) return;
  const bool is_list = version->is_array() && !version->empty();
  const bool is_1 =
      is_list ? version->front() == 1
              : version->is_string() && version->get_ref<const std::string&>().starts_with("1.");
  if (is_1) return;
  const auto text = [](const Json& value) {
    return value.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
  };
  std::string told = text(*version);
  if (is_list && version->size() >= 3)
    told = fmt::format("{}.{}.{}", text((*version)[0]), text((*version)[1]), text((*version)[2]));
  throw Error(Error::Kind::bad_input, "OpenTrackIO version {}, expected 1.x.", told.substr(0, 40));
}

constexpr std::size_t longest_source = 256;

std::string source_of(const Json& root) {
  if (const Json* id = find(root, "/sourceId"); id && id->is_string()) {
    const auto& name = id->get_ref<const std::string&>();
    if (name.size() > longest_source)  // it is kept with each pose
      throw opentrackio_error(
          fmt::format("sourceId has {} bytes, expected {} at most", name.size(), longest_source));
    return name;
  }
  if (const Json* index = find(root, "/sourceNumber"); index && index->is_number_unsigned())
    return fmt::format("opentrackio {}", index->get<std::uint64_t>());
  return {};
}

void set_sequence(TrackedPose& pose, const Json& root) {
  const Json* sequence = find(root, "/timing/sequenceNumber");
  if (!sequence) return;
  if (!sequence->is_number_unsigned())
    throw opentrackio_error("timing.sequenceNumber must be whole");
  pose.sequence = static_cast<std::uint16_t>(sequence->get<std::uint64_t>());
}

void set_times(TrackedPose& pose, const Json& root) {
  pose.timecode = opentrackio::timecode(root);
  const Json* seconds = find(root, "/timing/sampleTimestamp/seconds");
  if (!seconds) return;
  const Json* nanoseconds = find(root, "/timing/sampleTimestamp/nanoseconds");
  // PTP's seconds have 48 bits; beyond 33 they would not fit into nanoseconds.
  constexpr std::uint64_t most_seconds = std::uint64_t{1} << 33, second = 1'000'000'000;
  if (!seconds->is_number_unsigned() || seconds->get<std::uint64_t>() > most_seconds ||
      (nanoseconds &&
       (!nanoseconds->is_number_unsigned() || nanoseconds->get<std::uint64_t>() >= second)))
    throw opentrackio_error("timing.sampleTimestamp must be whole seconds and nanoseconds");
  pose.capture_time_ns =
      static_cast<std::int64_t>(seconds->get<std::uint64_t>() * second +
                                (nanoseconds ? nanoseconds->get<std::uint64_t>() : 0));
}

void set_place(TrackedPose& pose, const Json& root) {
  const Json* transforms = find(root, "/transforms");
  if (!transforms || transforms->empty()) throw opentrackio_error("a sample without transforms");
  const opentrackio::Placed placed = opentrackio::placed(root);
  pose.axes = placed.axes;
  pose.place = placed.place;
}

}  // namespace

/// What of a sample may be missing.
class OpenTrackIOReader::Reading {
 public:
  Reading(const Json& root, Source& source, OpenTrackIOSample& out)
      : root_(root), source_(source), out_(out) {}

  void times() {
    optional([&] { set_sequence(out_.pose, root_); });
    optional([&] { set_times(out_.pose, root_); });
  }

  void sensor(double fallback_width) {
    std::optional<double> width, height;
    optional([&] { width = length(root_, "/static/camera/activeSensorPhysicalDimensions/width"); });
    optional(
        [&] { height = length(root_, "/static/camera/activeSensorPhysicalDimensions/height"); });
    if (width || height) source_.sensor_width_mm = width, source_.sensor_height_mm = height;
    optional([&] { source_.squeeze = opentrackio::squeeze(root_).value_or(source_.squeeze); });
    width_ = source_.sensor_width_mm;
    height_ = source_.sensor_height_mm;
    if (!width_ && !height_ && fallback_width > 0.0) width_ = fallback_width;
    if (width_) out_.pose.sensor_width_mm = *width_ * source_.squeeze;
    out_.pose.sensor_height_mm = height_;
  }

  void lens() {
    TrackedPose& pose = out_.pose;
    optional([&] { pose.focal_length_mm = length(root_, "/lens/pinholeFocalLength"); });
    optional([&] { pose.focus_distance_m = length(root_, "/lens/focusDistance"); });
    optional([&] { pose.f_number = length(root_, "/lens/fStop"); });
    Vec2 offset(0.0);
    optional([&] {
      offset = {opentrackio::number_or_zero(root_, "/lens/projectionOffset/x"),
                opentrackio::number_or_zero(root_, "/lens/projectionOffset/y")};
    });
    pose.projection_offset_mm = offset * Vec2(source_.squeeze, 1.0);
    out_.is_at_pupil = find(root_, "/lens/entrancePupilOffset") != nullptr;
    encoders("/lens/encoders", out_.encoders);
    encoders("/lens/rawEncoders", out_.raw_encoders);
    try {
      distortion(offset);
    } catch (const std::exception& error) {
      out_.lens_unread = error.what();
    }
  }

 private:
  template <class Read>
  void optional(const Read& read) {
    try {
      read();
    } catch (const std::exception& error) {
      out_.unread.emplace_back(error.what());
    }
  }

  void encoders(const std::string& path, LensEncoders& to) {
    const auto read = [&](const char* name, std::optional<double>& value) {
      const std::string place = path + name;
      if (const Json* told = find(root_, place.c_str())) value = opentrackio::number(told, place);
    };
    optional([&] { read("/zoom", to.zoom); });
    optional([&] { read("/focus", to.focus); });
  }

  void distortion(const Vec2& offset) {
    if (!opentrackio::distorts(root_)) {
      out_.pose.distortion = opentrackio::opencv_distortion(root_, 1.0, Vec2(1.0), source_.lens);
      return;
    }
    if (!out_.pose.focal_length_mm)
      throw opentrackio_error("lens.distortion is told without a usable lens.pinholeFocalLength");
    if (source_.squeeze != 1.0)
      throw opentrackio_error(
          "lens.distortion is of a lens that squeezes, for which it is not defined");
    // Where the sensor is not known, the largest that is usual.
    const double width = width_.value_or(height_ ? 1.5 * *height_ : 36.0);
    const double height = height_.value_or(width / 1.5);
    const Vec2 reach = 0.5 * Vec2(width, height) + glm::abs(offset);
    out_.pose.distortion =
        opentrackio::opencv_distortion(root_, *out_.pose.focal_length_mm, reach, source_.lens);
  }

  const Json& root_;
  Source& source_;
  OpenTrackIOSample& out_;
  std::optional<double> width_, height_;  // the sensor's
};

OpenTrackIOReader::Source& OpenTrackIOReader::source(const std::string& name,
                                                     const std::string& host) {
  const std::pair key(name, host);
  // More sources than any studio has: who has not been heard for longest tells its sensor again.
  if (sources_.size() >= most_sources && !sources_.contains(key))
    sources_.erase(std::min_element(
        sources_.begin(), sources_.end(),
        [](const auto& a, const auto& b) { return a.second.read < b.second.read; }));
  Source& source = sources_[key];
  source.read = ++reads_;
  return source;
}

OpenTrackIOSample OpenTrackIOReader::read(const OpenTrackIOBytes& sample, const std::string& host,
                                          double sensor_width_mm) {
  const Json root = parse(sample);
  if (!root.is_object()) throw opentrackio_error("a sample must be an object");
  OpenTrackIOSample result;
  result.pose.sequence = sample.sequence;
  try {
    check_version(root);
    result.pose.source = source_of(root);
    set_place(result.pose, root);
    Reading reading(root, source(result.pose.source, host), result);
    reading.times();
    reading.sensor(sensor_width_mm);
    reading.lens();
  } catch (const Json::exception& error) {
    throw opentrackio_error(error.what());
  }
  return result;
}

}  // namespace polyhull
