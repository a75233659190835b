// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A tracked camera's pose as one message, JSON, the content of a buffer of
/// `application/x-polyhull-camera` (docs/formats.md).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "track/tracked_pose.h"

namespace polyhull {

struct PoseMessage {
  TrackedPose pose;                  ///< its sequence and capture time are not sent
  std::int64_t prediction_ns = 0;    ///< how far motion goes on after this pose where none follows
  std::int64_t timecode_lag_ns = 0;  ///< how much earlier than its timecode says the pose was true
};

std::string pose_message_to_json(const PoseMessage& message);

/// Throws Error (bad_input) on text that is no such message, numbers that are not finite, lengths not
/// above 0, and an R that is no rotation within 1e-6. Members that it does not know are passed over.
PoseMessage parse_pose_message(std::string_view json);

}  // namespace polyhull
