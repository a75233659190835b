// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// OpenTrackIO's samples (SMPTE RIS OSVP, protocol 1.x), JSON or CBOR, as poses. Read are
/// `transforms` (metres, degrees; from the world to the camera, one within the other, with their
/// scales), `lens.pinholeFocalLength` and `.projectionOffset` (mm), `.entrancePupilOffset` (metres
/// along the view), `.distortion` (of the model "Brown-Conrady U-D" or "D-U" around the centre of
/// projection), `.focusDistance` (metres), `.fStop`, `.encoders` and `.rawEncoders`, `static.camera.
/// activeSensorPhysicalDimensions` (mm) and `.anamorphicSqueeze`, `timing.sequenceNumber`,
/// `.sampleTimestamp` and `.timecode`, `sourceId` and `sourceNumber`. Whatever else a sample holds is
/// passed over.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "track/inverse_distortion.h"
#include "track/lens/lens_table.h"
#include "track/opentrackio_segments.h"
#include "track/tracked_pose.h"

namespace polyhull {

struct OpenTrackIOSample {
  TrackedPose pose;
  LensEncoders encoders, raw_encoders;     ///< from 0 to 1, and as the tracker counts
  bool is_at_pupil = false;                ///< the entrance pupil's offset was told
  std::vector<std::string> unread;         ///< values that were left out, and why
  std::optional<std::string> lens_unread;  ///< why the lens's distortion was left out, if it was
};

/// Reads the samples of any number of sources, and remembers of each what it tells now and then only:
/// its sensor's size and its lens's squeeze hold until it tells others. Not for several threads at once.
class OpenTrackIOReader {
 public:
  static constexpr std::size_t most_sources = 16;  ///< remembered at once

  /// The pose that \p sample, which came from \p host, tells of. Its sequence number is the sample's
  /// own, else the header's. \p sensor_width_mm (0: unknown) holds where no sensor is told. A lens that
  /// squeezes shows its sensor so much wider: widths and horizontal offsets are told so.
  ///
  /// What is optional and cannot be used is left out. Throws Error (bad_input) for bytes that are not
  /// of the encoding, for anything nested more than 64 deep, for another version of the protocol than
  /// 1, and for a sample without a usable place: no `transforms`, a scale that is not above 0, a value
  /// that is no finite number.
  OpenTrackIOSample read(const OpenTrackIOBytes& sample, const std::string& host,
                         double sensor_width_mm = 0.0);

 private:
  struct Source {
    std::optional<double> sensor_width_mm, sensor_height_mm;  // as they are on the sensor
    double squeeze = 1.0;
    FittedDistortion lens;
    std::uint64_t read = 0;  // when: counts up
  };
  class Reading;
  Source& source(const std::string& name, const std::string& host);

  std::map<std::pair<std::string, std::string>, Source> sources_;  // by name and host
  std::uint64_t reads_ = 0;
};

}  // namespace polyhull
