// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/tracksrc/track_input.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "track/packet_error.h"

namespace polyhull::element {

namespace {

/// What packets usually wait is told in such steps: with each change of the latency a pipeline is
/// arranged anew.
constexpr std::int64_t latency_step = 5 * GST_MSECOND;
/// Nobody waits for less.
constexpr std::int64_t no_wait = GST_MSECOND;

constexpr char wrong_clock[] =
    "A sender's time stands, or is more than a second from the pipeline's clock, so the packet's "
    "arrival was taken. Give the pipeline the sender's clock, such as PTP's, or set times=sender.";

std::int64_t in_steps(std::int64_t held_up) {
  if (held_up <= no_wait) return 0;
  return (held_up + latency_step - 1) / latency_step * latency_step;
}

/// The step for \p held_up after \p before; one at an edge does not go to and fro.
std::int64_t next_step(std::int64_t held_up, std::int64_t before) {
  const std::int64_t step = in_steps(held_up);
  return step < before ? std::min(before, in_steps(held_up + no_wait / 2)) : step;
}

}  // namespace

TrackInput::TrackInput(GstElement* element, Statistics& statistics)
    : element_(element), statistics_(statistics) {
  statistics.declare({"packets",
                      "poses",
                      "bad-checksum",
                      "truncated",
                      "refused",
                      "incomplete",
                      "late",
                      "lost",
                      "reordered",
                      "repeated",
                      "other-senders",
                      "times-unusable",
                      "values-unread",
                      "lenses-unread",
                      "lenses-doubtful",
                      "lenses-outside",
                      "places-doubtful",
                      "polls",
                      "silences",
                      "recorded",
                      "record-failures",
                      "packets-skipped",
                      "recordings-damaged",
                      "settings-refused",
                      "port"});
}

void TrackInput::open(const TrackInputSettings& settings, std::uint16_t port) {
  reader_settings(settings);
  lens_.reset();
  if (!settings.lens_file.empty())
    lens_ = std::make_shared<const LensTable>(load_lens_table(settings.lens_file));
  lens_doubts_ = {};
  place_doubted_ = false;
  reader_ = {};
  track_ = Track(track_settings(settings));
  source_ = settings.source;
  others_ = 0;
  heard_.reset();
  silent_ = false;
  held_up_ = 0;
  recorder_.reset();
  if (!settings.record.empty()) recorder_ = std::make_unique<PacketRecorder>(settings.record, port);
}

void TrackInput::forget() {
  reader_.forget();
  track_.forget();
  heard_.reset();
}

void TrackInput::record(const Datagram& datagram) {
  if (!recorder_) return;
  try {
    recorder_->write(datagram);
    statistics_.count("recorded");
  } catch (const Error& error) {
    recorder_.reset();
    statistics_.warn(element_, "record-failures", error.what());
  }
}

std::optional<TrackedPose> TrackInput::read(Packet packet, const Datagram& datagram,
                                            const TrackInputSettings& settings) {
  const auto refuse = [&](const char* counter, const Error& error) {
    statistics_.warn(
        element_, counter,
        fmt::format("A packet from {} was not used: {}", datagram.sender(), error.what()));
  };
  PoseReaderSettings how;
  try {
    how = reader_settings(settings);
    how.lens = lens_;
  } catch (const Error& error) {
    statistics_.warn(element_, "settings-refused",
                     fmt::format("{} Until then packets are not used.", error.what()));
    return {};
  }
  try {
    std::optional<TrackedPose> pose = reader_.read(packet, datagram.sender(), how);
    tell_left_out(datagram);
    return pose;
  } catch (const PacketError& error) {
    refuse(error.fault() == PacketError::Fault::truncated ? "truncated" : "bad-checksum", error);
  } catch (const Error& error) {
    refuse("refused", error);
  }
  return {};
}

void TrackInput::tell_left_out(const Datagram& datagram) {
  for (const std::string& why : reader_.unread())
    statistics_.warn(
        element_, "values-unread",
        fmt::format("A value from {} was left out, the pose is used: {}", datagram.sender(), why));
  if (reader_.lens_unread())
    statistics_.warn(
        element_, "lenses-unread",
        fmt::format("A lens's distortion from {} was left out, so the picture will not "
                    "fit it: {}",
                    datagram.sender(), *reader_.lens_unread()));
}

void TrackInput::doubt(const char* counter, bool& said, const std::string& what) {
  if (std::exchange(said, true))
    statistics_.count(counter);
  else
    statistics_.warn(element_, counter, what);
}

/// Counts, and says once, that \p pose is farther from the tracker's origin than any stage is large.
/// FreeD's packets tell no such place, but offsets make one.
void TrackInput::doubt_place(const TrackedPose& pose) {
  const double away = glm::length(pose.place);
  if (!(away > 1000.0)) return;
  doubt("places-doubtful", place_doubted_,
        pose.source.starts_with("freed ")
            ? fmt::format("The tracked camera is {:.4g} m from the tracker's origin. FreeD's "
                          "packets reach 131 m along each axis, the rest is of offset-x, offset-y "
                          "and offset-z: they are metres, so give 1.5 for 1500 mm.",
                          away)
            : fmt::format("The tracked camera is {:.4g} m from the tracker's origin. OpenTrackIO "
                          "tells metres: where it is {:.4g} m, the sender tells millimetres and "
                          "has to be set right.",
                          away, 0.001 * away));
}

/// Counts, and says of each kind once, why the field of view will not be that of the lens of \p pose,
/// which the last packet told.
void TrackInput::doubt_lens(const TrackedPose& pose, const TrackInputSettings& settings) {
  if (reader_.lens_outside())
    doubt("lenses-outside", lens_doubts_.outside,
          fmt::format(
              "The encoders are beyond the rows of lens-file={}, of which the last one holds. "
              "Measure the lens there, and see whether the tracker counts zoom and focus as "
              "the file does.",
              settings.lens_file));
  else
    lens_doubts_.outside = false;
  if (reader_.lens_blind())
    doubt("lenses-doubtful", lens_doubts_.blind,
          fmt::format("lens-file={} goes by an encoder that packets do not tell. Of OpenTrackIO a "
                      "file of values from 0 to 1 goes by lens.encoders, another by "
                      "lens.rawEncoders.",
                      settings.lens_file));
  if (const auto zoom = reader_.unused_zoom()) {
    const double first = lens_doubts_.first_zoom.value_or(*zoom);
    lens_doubts_.first_zoom = first;
    // Encoders that stand still shake by some counts; those of OpenTrackIO may be shares of 1.
    const bool counts = pose.source.starts_with("freed ") || std::max(first, *zoom) > 1.0;
    if (std::abs(*zoom - first) > (counts ? 16.0 : 0.01))
      doubt("lenses-doubtful", lens_doubts_.zoom_unused,
            "The zoom moves, and packets tell its encoder alone, so the field of view does not "
            "follow it: set lens-file to what the lens does there, or zoom-is-focal-length where "
            "FreeD's zoom is one.");
  }
  if (!pose.focal_length_mm) return;
  const bool by_zoom = settings.zoom_is_focal_length && pose.source.starts_with("freed ");
  if (const auto why =
          by_zoom ? doubt_in_focal_length(*pose.focal_length_mm, pose.sensor_width_mm.value_or(0.0))
                  : std::nullopt)
    doubt(
        "lenses-doubtful", lens_doubts_.implausible,
        fmt::format(
            "With zoom-is-focal-length=true a packet's zoom is {}. Where it is an encoder's "
            "value, set that to false and lens-file to what the lens does there; where it is such "
            "a lens, all is well.",
            *why));
  if (!pose.sensor_width_mm && !pose.sensor_height_mm)
    doubt("lenses-doubtful", lens_doubts_.no_sensor,
          "The focal length is known but the sensor is not, so the field of view does not follow "
          "it: set sensor-width.");
}

/// \p pose, of a packet in \p datagram, in the track, unless it is another's.
std::optional<TrackInput::Timed> TrackInput::place(TrackedPose pose, const Datagram& datagram,
                                                   const TrackInputSettings& settings,
                                                   bool by_clock) {
  if (!settings.source.empty() && pose.source != settings.source) {
    ++others_;
    return {};
  }
  // Two machines may send under the same number.
  pose.source += " from " + datagram.sender_host();
  const std::uint64_t unusable = track_.counters().times_unusable;
  const bool taken = track_.add(pose, datagram.time_ns);
  if (by_clock && track_.counters().times_unusable != unusable)
    statistics_.warn(element_, "times-unusable", wrong_clock);
  if (!taken) return {};
  doubt_place(pose);
  doubt_lens(pose, settings);
  const std::int64_t time = *track_.end();
  Timed timed{time - track_.lag_ns(), *track_.at(time), track_.lag_ns()};
  timed.pose.timecode = pose.timecode;  // not that of one of those that were averaged
  heard_ = datagram.time_ns;
  silent_ = false;
  return timed;
}

std::vector<TrackInput::Timed> TrackInput::take(const Datagram& datagram,
                                                const TrackInputSettings& settings,
                                                std::optional<std::int64_t> base_time) {
  record(datagram);
  if (settings.source != source_) {
    source_ = settings.source;
    track_.forget();
  }
  TrackSettings how = track_settings(settings);
  how.clock_begin_ns = base_time;
  track_.set(how);
  const bool by_clock = base_time && settings.times == TrackTimes::clock;
  std::vector<Timed> all;
  for (const Packet packet : packets_in(datagram.bytes, settings.protocol)) {
    statistics_.count("packets");
    auto pose = read(packet, datagram, settings);
    if (!pose) continue;
    if (auto timed = place(std::move(*pose), datagram, settings, by_clock))
      all.push_back(std::move(*timed));
  }
  tell();
  return all;
}

void TrackInput::tell() {
  const TrackCounters& counters = track_.counters();
  statistics_.set_count("poses", counters.poses);
  statistics_.set_count("lost", counters.lost);
  statistics_.set_count("reordered", counters.reordered);
  statistics_.set_count("repeated", counters.repeated);
  statistics_.set_count("other-senders", counters.other_senders + others_);
  statistics_.set_count("times-unusable", counters.times_unusable);
  statistics_.set_count("incomplete", reader_.incomplete());
  statistics_.set_count("late", reader_.late());
  statistics_.set_count("polls", reader_.polls());
  statistics_.set("smoothing-lag-ms", 1e-6 * static_cast<double>(track_.lag_ns()));
  statistics_.set("held-up-ms", 1e-6 * static_cast<double>(track_.held_up_ns()));
  held_up_ = next_step(track_.held_up_ns(), held_up_);
}

void TrackInput::watch(std::int64_t now) {
  if (!heard_ || now < *heard_) heard_ = now;
  if (silent_ || now - *heard_ <= Track::silence_ns) return;
  silent_ = true;
  const std::string who = source_.empty() ? "a tracked camera" : fmt::format("'{}'", source_);
  statistics_.warn(element_, "silences",
                   fmt::format("Nothing usable has come from {} for a second. Look at the tracker, "
                               "its target address and port, and at the other counters of stats.",
                               who));
}

std::int64_t TrackInput::latency(const TrackInputSettings& settings) const {
  return static_cast<std::int64_t>(settings.delay + settings.smoothing / 2) + held_up_;
}

}  // namespace polyhull::element
