// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Other programs' calibrations as rigs. Each function throws Error naming file and line. The rigs
/// have been validated, but for their bounds, up direction and unit, which these formats do not
/// hold.
#pragma once

#include <string>
#include <vector>

#include "rig/rig.h"

namespace polyhull::import {

/// What the files do not say.
struct Options {
  int width = 0;  ///< px of the pictures; 0: from the files or the pictures beside them
  int height = 0;
  std::string name = "cam%d";  ///< pattern for cameras without a name
  int first = 0;               ///< number of the first such camera
  int board = 1;               ///< Bouguet: the board picture (omc_N, Tc_N) that is the world
};

/// Middlebury multi-view *_par.txt: a count, then "picture.png K(9) R(9) t(3)" per line. Names are
/// the pictures'; sizes are read from the pictures where they lie beside the file.
Rig middlebury(const std::string& file, const Options& options);

/// Plain 3x4 projection matrices, row by row: 12 numbers per line, or three lines of four, any
/// number of matrices in a file; '#' starts a comment, words such as CONTOUR are skipped.
Rig projection_matrices(const std::vector<std::string>& files, const Options& options);

/// "name K(9) distortion(5) R(9) t(3)" per line; '#' starts a comment.
Rig text(const std::string& file, const Options& options);

/// OpenCV XML or YAML, one file per camera (matrix, distortion, rotation as matrix or Rodrigues
/// vector, translation under their usual names), or a stereo pair's intrinsics (M1 D1 M2 D2) and
/// extrinsics (R T). A file is named after itself, or after its folder if all have the same name.
Rig opencv(const std::vector<std::string>& files, const Options& options);

/// Bouguet's Calib_Results.m, one file per camera, named like opencv()'s.
Rig bouguet(const std::vector<std::string>& files, const Options& options);

/// COLMAP's text model: the folder with cameras.txt and images.txt.
Rig colmap(const std::string& folder, const Options& options);

/// The rotation about \p v by |v| radians.
Mat3 rotation_of(const Vec3& v);

/// Names for files: their stems, or their folders' names if the stems are all the same.
std::vector<std::string> names_of(const std::vector<std::string>& files);

}  // namespace polyhull::import
