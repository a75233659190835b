// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a camera's message, and in pieces as packets of two senders, which a
// track follows by each kind of time.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>

#include "base/error.h"
#include "track/pose_message.h"
#include "track/pose_reader.h"
#include "track/track.h"

using namespace polyhull;

static void check(const TrackedPose& pose) {
  try {
    const Camera camera = camera_of(pose, 640, 480, 40.0);
    if (!std::isfinite(camera.t.x + camera.t.y + camera.t.z)) std::abort();
    const PoseMessage message = parse_pose_message(pose_message_to_json({pose}));
    if (message.pose.distortion != pose.distortion) std::abort();
  } catch (const Error&) {
  }
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    check(parse_pose_message({reinterpret_cast<const char*>(data), size}).pose);
  } catch (const Error&) {
  }
  PoseReader reader;
  PoseReaderSettings how;
  how.lens = std::make_shared<const LensTable>(
      "zoom focal_length_mm k1 entrance_pupil_m\n0 5 -0.1 0\n1000 50 0.1 0.1\n"
      "focus focus_distance_m\n0 1\n1000 inf\n",
      "lens");
  TrackSettings settings;
  settings.times = static_cast<TrackTimes>(size % 3);
  if (size % 2) settings.clock_begin_ns = 1'718'806'554'000'000'000;
  Track track(settings);
  std::int64_t time = 0;
  // A byte for the sender and the time, two for the length, then a packet.
  for (std::size_t at = 0; at + 3 <= size;) {
    const int sender = data[at] & 1;
    time += (data[at] >> 1) * std::int64_t{5'000'000};
    const std::size_t length =
        std::min<std::size_t>(data[at + 1] << 8 | data[at + 2], size - at - 3);
    for (const auto packet : packets_in({data + at + 3, length}, how.protocol)) try {
        const auto pose = reader.read(packet, std::to_string(sender), how);
        if (pose && track.add(*pose, time)) {
          check(*track.at(*track.end()));
          const std::int64_t far = *track.end() - time;  // of its own clock, a second at most
          if (far > Track::silence_ns || far < -Track::silence_ns || track.held_up_ns() < 0)
            std::abort();
        }
      } catch (const Error&) {
      }
    at += 3 + length;
  }
  return 0;
}
