// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The report's drawings, as pieces of HTML.
#pragma once

#include "calibrate/report.h"

namespace polyhull::calibrate_tool {

/// Text as HTML shows it.
std::string escaped(const std::string& text);

/// The colour of a distance of \p pixels, where \p usual is the median: green to red.
std::string colour_of(double pixels, double usual);

/// Where camera \p c saw corners, its picture's frame around them.
std::string coverage_plot(const calibration::Calibration& calibration, std::size_t c);

/// The residuals of camera \p c: a cloud around zero, with the circle of one deviation of the noise.
std::string residual_cloud(const calibration::Calibration& calibration, std::size_t c);

/// The mean residual in each of 16x9 cells of the picture as arrows: what the lens's model leaves.
std::string residual_field(const calibration::Calibration& calibration, std::size_t c);

/// View \p v: its picture, small, with its corners and their residuals, lengthened; nothing where
/// there is no picture.
std::string view_picture(const calibration::Calibration& calibration, const Pictures& pictures,
                         std::size_t v);

/// Cameras and boards in 3D, turned with the mouse.
std::string scene_drawing(const calibration::Calibration& calibration);

}  // namespace polyhull::calibrate_tool
