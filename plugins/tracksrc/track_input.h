// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Datagrams as timed poses, with all that is counted and said about them.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "plugins/common/statistics.h"
#include "plugins/tracksrc/properties.h"
#include "track/packet_file.h"
#include "track/pose_reader.h"
#include "track/track.h"

namespace polyhull::element {

/// For one thread.
class TrackInput {
 public:
  TrackInput(GstElement* element, Statistics& statistics);

  /// At the start of a stream, in the state that nothing has come. Throws Error where the settings
  /// are unusable or packets cannot be recorded; \p port is where they come to.
  void open(const TrackInputSettings& settings, std::uint16_t port);
  void close() { recorder_.reset(); }
  /// After a seek: poses so far are of another time.
  void forget();

  /// A pose and its time.
  struct Timed {
    std::int64_t time = 0;  ///< ns, may be below 0
    TrackedPose pose;
    std::int64_t lag = 0;  ///< by how much earlier than its timecode says it was true, ns
  };
  /// The poses that \p datagram brings, in order: of FreeD's packets several may be in one. What is
  /// wrong with it is counted and said.
  /// \p base_time is what the pipeline's clock showed when running time was 0, where that is known.
  std::vector<Timed> take(const Datagram& datagram, const TrackInputSettings& settings,
                          std::optional<std::int64_t> base_time);

  /// It is \p now: where no pose has come for a second, that is counted and said, once.
  void watch(std::int64_t now);

  /// How much later than it was true a pose comes, ns. For any thread.
  std::int64_t latency(const TrackInputSettings& settings) const;

 private:
  void record(const Datagram& datagram);
  using Packet = std::span<const std::uint8_t>;
  std::optional<TrackedPose> read(Packet packet, const Datagram& datagram,
                                  const TrackInputSettings& settings);
  std::optional<Timed> place(TrackedPose pose, const Datagram& datagram,
                             const TrackInputSettings& settings, bool by_clock);
  void tell_left_out(const Datagram& datagram);
  void doubt(const char* counter, bool& said, const std::string& what);
  void doubt_place(const TrackedPose& pose);
  void doubt_lens(const TrackedPose& pose, const TrackInputSettings& settings);
  void tell();

  GstElement* element_;
  Statistics& statistics_;
  PoseReader reader_;
  std::shared_ptr<const LensTable> lens_;
  struct LensDoubts {
    bool outside = false, blind = false, implausible = false, no_sensor = false;
    bool zoom_unused = false;
    std::optional<double> first_zoom;  // of encoders that nothing reads
  };
  LensDoubts lens_doubts_;  // that were said
  bool place_doubted_ = false;
  Track track_{{}};
  std::unique_ptr<PacketRecorder> recorder_;
  std::string source_;  // the property, as it was
  std::uint64_t others_ = 0;
  std::optional<std::int64_t> heard_;  // when a pose came, or listening began
  bool silent_ = false;
  std::atomic<std::int64_t> held_up_{0};  // in steps that latency is told in
};

}  // namespace polyhull::element
