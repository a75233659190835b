// SPDX-License-Identifier: LGPL-2.1-or-later
// FreeD's and OpenTrackIO's packets as senders make them.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "track/freed.h"
#include "track/opentrackio_sample.h"
#include "track/opentrackio_segments.h"

namespace polyhull::track_examples {

using Packet = std::vector<std::uint8_t>;

/// The pose in \p sample, by a reader that remembers nothing.
inline TrackedPose pose_in(const OpenTrackIOBytes& sample) {
  return OpenTrackIOReader().read(sample, "").pose;
}

inline void append(Packet& packet, std::uint32_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i)
    packet.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

inline Packet freed(std::uint8_t camera, const Vec3& degrees, const Vec3& metres,
                    std::uint32_t zoom, std::uint32_t focus) {
  Packet packet{0xD1, camera};
  const auto steps = [&](double value) {
    append(packet, static_cast<std::uint32_t>(std::lround(value)), 3);
  };
  for (int i = 0; i < 3; ++i) steps(degrees[i] * 32768.0);
  for (int i = 0; i < 3; ++i) steps(metres[i] * 64000.0);
  append(packet, zoom, 3);
  append(packet, focus, 3);
  append(packet, 0, 2);
  unsigned sum = 0;
  for (const std::uint8_t byte : packet) sum += byte;
  packet.push_back(static_cast<std::uint8_t>(0x40 - sum));
  return packet;
}

inline nlohmann::json sample(const Vec3& angles, const Vec3& place) {
  return {{"protocol", {{"name", "OpenTrackIO"}, {"version", {1, 0, 1}}}},
          {"sourceId", "urn:uuid:00000000-0000-4000-8000-000000000007"},
          {"sourceNumber", 7},
          {"timing",
           {{"sequenceNumber", 41},
            {"sampleTimestamp", {{"seconds", 1718806554}, {"nanoseconds", 500000000}}}}},
          {"static",
           {{"camera", {{"activeSensorPhysicalDimensions", {{"width", 36.0}, {"height", 24.0}}}}}}},
          {"lens", {{"pinholeFocalLength", 24.5}}},
          {"transforms",
           {{{"translation", {{"x", place.x}, {"y", place.y}, {"z", place.z}}},
             {"rotation", {{"pan", angles.x}, {"tilt", angles.y}, {"roll", angles.z}}}}}}};
}

inline Packet json_bytes(const nlohmann::json& value) {
  const std::string text = value.dump();
  return {text.begin(), text.end()};
}

// One segment of a sample: the bytes from \p begins on, \p count of them.
inline Packet segment(const Packet& whole, int encoding, std::uint16_t sequence, std::size_t begins,
                      std::size_t count, unsigned modulus) {
  const Packet payload(whole.begin() + static_cast<std::ptrdiff_t>(begins),
                       whole.begin() + static_cast<std::ptrdiff_t>(begins + count));
  Packet packet{'O', 'T', 'r', 'k', 0, static_cast<std::uint8_t>(encoding)};
  append(packet, sequence, 2);
  append(packet, static_cast<std::uint32_t>(begins), 4);
  const bool last = begins + count == whole.size();
  append(packet, static_cast<std::uint32_t>(count | (last ? 0x8000u : 0u)), 2);
  append(packet, fletcher16(packet, payload, modulus), 2);
  packet.insert(packet.end(), payload.begin(), payload.end());
  return packet;
}

}  // namespace polyhull::track_examples
