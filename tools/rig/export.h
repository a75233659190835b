// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rigs as other programs' calibrations. What comes back through import.h is the same camera: the
/// same bits, but for COLMAP's quaternions and half-pixels, which round (2e-15). Each function
/// throws Error, naming the camera, where the format has no words for its lens, and where a file
/// cannot be written. None of the formats holds bounds, up direction and unit; lengths stay in the
/// rig's unit.
#pragma once

#include <string>

#include "rig/rig.h"

namespace polyhull::exported {

/// cv::FileStorage YAML, one file per camera in \p folder, which is made where it is missing:
/// camera_matrix, distortion_coefficients, R, T, image_width, image_height.
void opencv(const Rig& rig, const std::string& folder);

/// COLMAP's text model in \p folder, which is made where it is missing: cameras.txt, images.txt (one
/// picture per camera, CAMERA.png), points3D.txt without points. No skew, no thin-prism lens.
void colmap(const Rig& rig, const std::string& folder);

/// Kalibr's camchain, a YAML text: poses as T_cam_imu, whose "imu" is the rig's world, and as the
/// chain T_cn_cnm1; names in the topics, /NAME/image_raw. No skew, no lens beyond k1 k2 p1 p2.
std::string kalibr(const Rig& rig);

}  // namespace polyhull::exported
