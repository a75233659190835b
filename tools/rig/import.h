// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Other programs' calibrations as rigs. Each function throws Error naming file and line. The rigs
/// have been validated, but for their bounds, up direction and unit, which these formats do not
/// hold.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "base/error.h"
#include "rig/rig.h"

namespace polyhull::import {

/// Throws Error (bad_input): \p what is wrong with \p line (from 1) of \p file.
[[noreturn]] inline void fail_at(const std::string& file, std::size_t line,
                                 const std::string& what) {
  throw Error(Error::Kind::bad_input, "{}, line {}: {}.", file, line, what);
}

/// What the files do not say.
struct Options {
  int width = 0;  ///< px of the pictures; 0: from the files or the pictures beside them
  int height = 0;
  std::string name = "cam%d";   ///< pattern for cameras without a name
  int first = 0;                ///< number of the first such camera
  int board = 1;                ///< Bouguet: the board picture (omc_N, Tc_N) that is the world
  bool prototype_axes = false;  ///< Bouguet: the world turned as the 2005 prototype turned it
  /// Told what a calibration holds that its rig does not.
  std::function<void(const std::string&)> note = [](const std::string&) {};
};

/// Middlebury multi-view *_par.txt: a count, then "picture.png K(9) R(9) t(3)" per line. Names are
/// the pictures' (distinct_names() of import/lines.h); sizes are read from the pictures where they
/// lie beside the file.
Rig middlebury(const std::string& file, const Options& options);

/// Plain 3x4 projection matrices, row by row: 12 numbers per line, perhaps behind a name, or three
/// lines of four, any number of matrices in a file; blanks, commas or semicolons between numbers,
/// decimal commas and brackets of Matlab, numpy, JSON and Blender as in rows_of() (import/lines.h).
/// Headings, which begin with a word and hold fewer than three numbers, are skipped, and so is a
/// fourth row 0 0 0 W, on a line of its own or as the last of 16 numbers, and with a note what has KITTI's
/// name Tr, the lidar's pose, beside cameras.
Rig projection_matrices(const std::vector<std::string>& files, const Options& options);

/// "name K(9) distortion(5) R(9) t(3)" per line, read by rows_of(); the name may have blanks.
Rig text(const std::string& file, const Options& options);

/// OpenCV XML, YAML or JSON, one file per camera (matrix, distortion, rotation as matrix or Rodrigues
/// vector, translation under their usual names, as cv::FileStorage's matrices or plain lists), or a
/// stereo pair's intrinsics (M1 D1 M2 D2, or other names with 1 and 2, left and right) and extrinsics
/// (R T), or EasyMocap's, in one file or two of any order. Files are named by distinct_names().
Rig opencv(const std::vector<std::string>& files, const Options& options);

/// Bouguet's Calib_Results.m, one file per camera, named like opencv()'s. The world is the board's
/// frame; with Options::prototype_axes its (x, y, z) are (y, -x, z) of the board, the conversion of
/// the 2005 prototype (Letteron 2004, appendix A), whose camera axes, x left and y up, are turned
/// to a rig's.
Rig bouguet(const std::vector<std::string>& files, const Options& options);

/// COLMAP's text model: the folder with cameras.txt and images.txt, or one of these. Cameras are named
/// by their images' distinct_names(). Of images of one camera or of one folder at one place, which
/// are of several instants, the first is taken, with a note.
Rig colmap(const std::string& folder, const Options& options);

/// Kalibr's camchain.yaml, without distortion or with its radtan model (also called plumb_bob, and
/// with more of OpenCV's coefficients): camN, with any first N and no gap. Cameras are named after their
/// topics (/NAME/image_raw), else after their keys, and so all
/// where two names are the same. The world is that of T_cam_imu (or T_imu_cam, the way back) where
/// every camera has one, else the first camera's, from which T_cn_cnm1 lead on.
Rig kalibr(const std::string& file, const Options& options);

/// Like kalibr() on text; \p source names it in messages.
Rig parse_kalibr(const std::string& text, const std::string& source, const Options& options = {});

/// OpenTrackIO samples (JSON), one file per camera, named by static.camera.label where all differ,
/// else like opencv()'s. Metres, z up; lenses by the OpenLensIO model from undistorted to distorted.
Rig opentrackio(const std::vector<std::string>& files, const Options& options);

/// The camera of one sample, named by its label or not at all; \p source names it in messages.
Camera parse_opentrackio(const std::string& text, const std::string& source,
                         const Options& options);

/// \p rig as parse_rig() takes it from a file: validated, its rotations made exact. Throws Error, naming
/// \p source, also for focal lengths of less than a fiftieth of a picture's width: such a K is none of
/// its pixels.
Rig finished(const Rig& rig, const std::string& source);

/// The rotation about \p v by |v| radians.
Mat3 rotation_of(const Vec3& v);

/// distinct_names() of files, whose folders are known where their paths do not tell them.
std::vector<std::string> names_of(const std::vector<std::string>& files);

}  // namespace polyhull::import
