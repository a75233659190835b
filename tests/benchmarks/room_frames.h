// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A person in an ordinary room, four cameras (utrecht_voxel), keyed against the empty room.
#pragma once

#include <string>
#include <vector>

#include "support/real_sets.h"

namespace polyhull::benchmark {

/// The room at these frames of its videos (rising, 50 a second), keyed as docs/keying.md says;
/// nothing where \p data does not hold it. Starts GStreamer, which needs avidemux and avdec_mpeg4.
/// Throws std::runtime_error where a video cannot be read that far, Error where other files are
/// broken.
std::vector<test::RealSet> room_sets(const std::string& data, const std::vector<int>& frames);

}  // namespace polyhull::benchmark
