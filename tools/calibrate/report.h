// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A calibration as one HTML page that needs nothing beside it.
#pragma once

#include "calibrate/input.h"

namespace polyhull::calibrate_tool {

/// The page: what is not good, a table of the cameras, the cameras and boards in 3D, which view fits
/// how well, and per camera where corners were seen, how far they are off, and its worst pictures.
/// \p faults: of Calibration::faults().
std::string report_page(const calibration::Calibration& calibration, const Pictures& pictures,
                        const std::vector<std::string>& faults);

/// The table of the cameras as text.
std::string report_table(const calibration::Calibration& calibration);

/// What is to be said, a line, of a rig that knows no floor; \p options would have told it.
std::string no_floor_note(const Rig& rig, const std::string& options);

}  // namespace polyhull::calibrate_tool
