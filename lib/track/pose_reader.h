// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Packets of a tracking protocol, from any number of senders, as poses.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "track/freed.h"
#include "track/opentrackio_segments.h"
#include "track/tracked_pose.h"

namespace polyhull {

enum class TrackProtocol {
  automatic,  ///< by a packet's first byte: 0xD1 is FreeD's, "O" and "{" are OpenTrackIO's
  freed,
  opentrackio,
};

struct PoseReaderSettings {
  TrackProtocol protocol = TrackProtocol::automatic;
  FreeDSettings freed;
  /// Of the part of the sensor that the picture shows, mm, where a packet does not tell; 0: unknown.
  double sensor_width_mm = 0.0;
};

/// Not for several threads at once.
class PoseReader {
 public:
  static constexpr std::size_t most_senders = 16;  ///< whose segments are kept at once

  /// The pose that \p packet tells or completes; none where segments are missing yet. \p sender
  /// (such as "192.168.1.7:40000") keeps the segments of different senders apart. Throws PacketError
  /// for a packet that is cut short or whose checksum is wrong, Error (bad_input) for one that cannot
  /// be used for another reason. A sensor's size, which OpenTrackIO's senders may tell now and then
  /// only, holds for its source until another is told.
  std::optional<TrackedPose> read(std::span<const std::uint8_t> packet, const std::string& sender,
                                  const PoseReaderSettings& settings);

  /// Forgets segments whose sample is not whole; counters stay.
  void forget();

  std::uint64_t incomplete() const;  ///< samples of which segments never came
  std::uint64_t late() const;        ///< segments that came after their sample was given up

 private:
  OpenTrackIOSegments& segments_of(const std::string& sender);

  struct Sensor {
    std::optional<double> width_mm, height_mm;
  };
  void know_sensor(TrackedPose& pose, const std::string& sender);

  std::map<std::string, OpenTrackIOSegments> segments_;
  std::map<std::string, Sensor> sensors_;    // by source, else sender
  std::uint64_t incomplete_ = 0, late_ = 0;  // of senders that are no longer kept
};

}  // namespace polyhull
