// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/pose_reader.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "base/error.h"

namespace polyhull {
namespace {

TrackProtocol protocol_of(std::span<const std::uint8_t> packet) {
  if (is_freed(packet)) return TrackProtocol::freed;
  if (is_opentrackio(packet)) return TrackProtocol::opentrackio;
  throw Error(Error::Kind::bad_input,
              "A packet of {} bytes is neither FreeD's (which begins with 0xD1) nor OpenTrackIO's "
              "(\"OTrk\", \"{{\", or a map in CBOR).",
              packet.size());
}

}  // namespace

std::vector<std::span<const std::uint8_t>> packets_in(std::span<const std::uint8_t> datagram,
                                                      TrackProtocol protocol) {
  const bool other = protocol == TrackProtocol::automatic && !is_freed(datagram);
  if (protocol == TrackProtocol::opentrackio || (other && is_opentrackio(datagram)))
    return opentrackio_packets(datagram);
  return freed_packets(datagram);
}

/// The sample that \p packet is or completes.
std::optional<OpenTrackIOBytes> PoseReader::completed(const OpenTrackIOPacket& packet,
                                                      const std::string& sender) {
  auto found = senders_.find(sender);
  if (found == senders_.end()) {
    if (!packet.sequence || packet.is_whole()) return whole_sample(packet);
    if (senders_.size() >= most_senders) make_room();
    found = senders_.try_emplace(sender).first;
  }
  found->second.heard = packets_;
  std::optional<OpenTrackIOBytes> sample = found->second.segments.add(packet);
  if (sample) found->second.completed = packets_;
  return sample;
}

/// More senders than any studio has: one goes that has completed nothing for longest, so that others'
/// single packets take nobody's place.
void PoseReader::make_room() {
  const auto gone =
      std::min_element(senders_.begin(), senders_.end(), [](const auto& a, const auto& b) {
        return std::tie(a.second.completed, a.second.heard) <
               std::tie(b.second.completed, b.second.heard);
      });
  incomplete_ += gone->second.segments.incomplete();
  late_ += gone->second.segments.late();
  senders_.erase(gone);
}

void PoseReader::forget() {
  while (!senders_.empty()) make_room();
}

std::uint64_t PoseReader::incomplete() const {
  std::uint64_t sum = incomplete_;
  for (const auto& [name, sender] : senders_) sum += sender.segments.incomplete();
  return sum;
}

std::uint64_t PoseReader::late() const {
  std::uint64_t sum = late_;
  for (const auto& [name, sender] : senders_) sum += sender.segments.late();
  return sum;
}

/// Adds what the lens file tells for \p encoders; without one they tell nothing of the lens.
void PoseReader::add_lens_at(const LensEncoders& encoders, const PoseReaderSettings& settings,
                             bool is_at_pupil, TrackedPose& pose) {
  if (!settings.lens) {
    if (!pose.focal_length_mm) unused_zoom_ = encoders.zoom;
    return;
  }
  const LensState lens = settings.lens->at(encoders);
  lens_outside_ = lens.outside;
  lens_blind_ = lens.blind;
  add_lens(pose, lens, is_at_pupil);
}

TrackedPose PoseReader::sample_pose(const OpenTrackIOBytes& sample, const std::string& sender,
                                    const PoseReaderSettings& settings) {
  // A sender that begins anew has another port.
  const std::string host = sender.substr(0, sender.rfind(':'));
  OpenTrackIOSample read = samples_.read(sample, host, settings.sensor_width_mm);
  unread_ = std::move(read.unread);
  lens_unread_ = std::move(read.lens_unread);
  const bool told = !read.pose.distortion.empty();
  const bool normalised = settings.lens ? settings.lens->is_normalised() : !read.raw_encoders.zoom;
  add_lens_at(normalised ? read.encoders : read.raw_encoders, settings, read.is_at_pupil,
              read.pose);
  if (!told && !read.pose.distortion.empty()) lens_unread_.reset();  // the file's stands for it
  return std::move(read.pose);
}

std::optional<TrackedPose> PoseReader::read(std::span<const std::uint8_t> packet,
                                            const std::string& sender,
                                            const PoseReaderSettings& settings) {
  ++packets_;
  unread_.clear();
  lens_unread_.reset();
  lens_outside_ = lens_blind_ = false;
  unused_zoom_.reset();
  const TrackProtocol protocol =
      settings.protocol == TrackProtocol::automatic ? protocol_of(packet) : settings.protocol;
  if (protocol == TrackProtocol::freed) {
    if (is_other_freed(packet)) {
      ++polls_;
      return {};
    }
    const FreeDPacket read = parse_freed(packet, settings.freed.checksum);
    TrackedPose pose = pose_of(read, settings.freed);
    if (settings.sensor_width_mm > 0.0) pose.sensor_width_mm = settings.sensor_width_mm;
    add_lens_at({read.zoom, read.focus}, settings, /*is_at_pupil=*/false, pose);
    return pose;
  }
  const auto sample = completed(parse_opentrackio_packet(packet), sender);
  if (!sample) return {};
  return sample_pose(*sample, sender, settings);
}

}  // namespace polyhull
