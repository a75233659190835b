// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// OpenTrackIO's samples (SMPTE RIS OSVP, protocol 1.0), JSON or CBOR, as poses. Read are
/// `transforms` (metres, degrees; from the world to the camera, one within the other), `lens.
/// pinholeFocalLength` and `.projectionOffset` (mm), `.entrancePupilOffset` (metres along the view),
/// `.distortion` (of the model "Brown-Conrady U-D" around the centre of projection; others are passed
/// over), `.focusDistance` (metres) and `.fStop`, `static.camera.
/// activeSensorPhysicalDimensions` (mm), `timing.sequenceNumber`, `.sampleTimestamp` and `.timecode`,
/// `sourceId` and `sourceNumber`. Whatever else a sample holds is passed over.
#pragma once

#include "track/opentrackio_segments.h"
#include "track/tracked_pose.h"

namespace polyhull {

/// The pose that \p sample tells of. Its sequence number is the header's, else the sample's own.
/// Throws Error (bad_input) for bytes that are not of the encoding, for anything nested more than 64
/// deep, and for a sample without a usable pose: no `transforms`, a transform that scales, a value
/// that is no finite number, a length that is not above 0.
TrackedPose parse_opentrackio_sample(const OpenTrackIOBytes& sample);

}  // namespace polyhull
