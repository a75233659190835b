// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Packets of a tracking protocol, from any number of senders, as poses.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "track/freed.h"
#include "track/lens/lens_table.h"
#include "track/opentrackio_sample.h"
#include "track/opentrackio_segments.h"
#include "track/tracked_pose.h"

namespace polyhull {

enum class TrackProtocol {
  automatic,  ///< by a packet's first bytes (is_freed(), is_opentrackio())
  freed,
  opentrackio,
};

struct PoseReaderSettings {
  TrackProtocol protocol = TrackProtocol::automatic;
  FreeDSettings freed;
  /// Of the part of the sensor that the picture shows, mm, where a packet does not tell; 0: unknown.
  double sensor_width_mm = 0.0;
  /// Tells what packets leave to their encoders (add_lens()); null: nothing. Of OpenTrackIO's it is
  /// asked by `encoders` where its values are from 0 to 1, else by `rawEncoders`.
  std::shared_ptr<const LensTable> lens;
};

/// What came in one datagram as packets: of FreeD's and of bare JSON's there may be several
/// (freed_packets(), opentrackio_packets()).
std::vector<std::span<const std::uint8_t>> packets_in(std::span<const std::uint8_t> datagram,
                                                      TrackProtocol protocol);

/// Not for several threads at once.
class PoseReader {
 public:
  static constexpr std::size_t most_senders = 16;  ///< whose segments are kept at once

  /// The pose that \p packet tells or completes; none where segments are missing yet, and of a message
  /// of FreeD's that tells none. \p sender
  /// (such as "192.168.1.7:40000") keeps the segments of different senders apart. Throws PacketError
  /// for a packet that is cut short or whose checksum is wrong, Error (bad_input) for one that cannot
  /// be used for another reason.
  std::optional<TrackedPose> read(std::span<const std::uint8_t> packet, const std::string& sender,
                                  const PoseReaderSettings& settings);

  /// Forgets segments whose sample is not whole; counters stay.
  void forget();

  std::uint64_t incomplete() const;  ///< samples of which segments never came
  std::uint64_t late() const;        ///< segments that came after their sample was given up

  std::uint64_t polls() const { return polls_; }  ///< messages of FreeD's that tell no pose

  /// Whether the lens file was asked for the last packet's pose beyond its rows, and whether for lack
  /// of an encoder it could not be.
  bool lens_outside() const { return lens_outside_; }
  bool lens_blind() const { return lens_blind_; }

  /// The zoom encoder of the last packet, whose pose has no focal length, where there is no lens file.
  std::optional<double> unused_zoom() const { return unused_zoom_; }

  /// What of the last packet's pose was left out, and why (as in OpenTrackIOSample).
  const std::vector<std::string>& unread() const { return unread_; }
  const std::optional<std::string>& lens_unread() const { return lens_unread_; }

 private:
  struct Sender {
    OpenTrackIOSegments segments;
    std::uint64_t completed = 0, heard = 0;  // when, by packets; completed 0: never
  };
  std::optional<OpenTrackIOBytes> completed(const OpenTrackIOPacket& packet,
                                            const std::string& sender);
  void make_room();
  void add_lens_at(const LensEncoders& encoders, const PoseReaderSettings& settings,
                   bool is_at_pupil, TrackedPose& pose);
  TrackedPose sample_pose(const OpenTrackIOBytes& sample, const std::string& sender,
                          const PoseReaderSettings& settings);

  std::map<std::string, Sender> senders_;  // of segments
  OpenTrackIOReader samples_;
  std::vector<std::string> unread_;
  std::optional<std::string> lens_unread_;
  bool lens_outside_ = false, lens_blind_ = false;
  std::optional<double> unused_zoom_;
  std::uint64_t packets_ = 0, polls_ = 0;
  std::uint64_t incomplete_ = 0, late_ = 0;  // of senders that are no longer kept
};

}  // namespace polyhull
