// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/pose_reader.h"

#include "base/error.h"
#include "track/opentrackio_sample.h"

namespace polyhull {
namespace {

TrackProtocol protocol_of(std::span<const std::uint8_t> packet) {
  if (!packet.empty() && packet[0] == 0xD1) return TrackProtocol::freed;
  if (!packet.empty() && (packet[0] == 'O' || packet[0] == '{')) return TrackProtocol::opentrackio;
  throw Error(Error::Kind::bad_input,
              "A packet of {} bytes is neither FreeD's (which begins with 0xD1) nor OpenTrackIO's "
              "(\"OTrk\" or \"{{\").",
              packet.size());
}

}  // namespace

OpenTrackIOSegments& PoseReader::segments_of(const std::string& sender) {
  // More senders than any studio has: whoever is real begins again with its next sample.
  if (segments_.size() >= most_senders && !segments_.contains(sender)) forget();
  return segments_[sender];
}

void PoseReader::forget() {
  incomplete_ = incomplete();
  late_ = late();
  segments_.clear();
}

std::uint64_t PoseReader::incomplete() const {
  std::uint64_t sum = incomplete_;
  for (const auto& [sender, segments] : segments_) sum += segments.incomplete();
  return sum;
}

std::uint64_t PoseReader::late() const {
  std::uint64_t sum = late_;
  for (const auto& [sender, segments] : segments_) sum += segments.late();
  return sum;
}

void PoseReader::know_sensor(TrackedPose& pose, const std::string& sender) {
  const std::string& source = pose.source.empty() ? sender : pose.source;
  if (pose.sensor_width_mm || pose.sensor_height_mm) {
    if (sensors_.size() >= most_senders && !sensors_.contains(source)) sensors_.clear();
    sensors_[source] = {pose.sensor_width_mm, pose.sensor_height_mm};
  } else if (const auto known = sensors_.find(source); known != sensors_.end()) {
    pose.sensor_width_mm = known->second.width_mm;
    pose.sensor_height_mm = known->second.height_mm;
  }
}

std::optional<TrackedPose> PoseReader::read(std::span<const std::uint8_t> packet,
                                            const std::string& sender,
                                            const PoseReaderSettings& settings) {
  const TrackProtocol protocol =
      settings.protocol == TrackProtocol::automatic ? protocol_of(packet) : settings.protocol;
  std::optional<TrackedPose> pose;
  if (protocol == TrackProtocol::freed) {
    pose = pose_of(parse_freed(packet), settings.freed);
  } else if (const auto sample = segments_of(sender).add(parse_opentrackio_packet(packet))) {
    pose = parse_opentrackio_sample(*sample);
    know_sensor(*pose, sender);
  }
  if (pose && !pose->sensor_width_mm && !pose->sensor_height_mm && settings.sensor_width_mm > 0.0)
    pose->sensor_width_mm = settings.sensor_width_mm;
  return pose;
}

}  // namespace polyhull
