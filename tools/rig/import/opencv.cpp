// SPDX-License-Identifier: LGPL-2.1-or-later
// Cameras of OpenCV's files: one in each, a stereo pair, or EasyMocap's.
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

#include "rig/import.h"
#include "rig/import/opencv_file.h"

namespace polyhull::import {
namespace {

using Names = OpenCvFile::Names;

constexpr Names matrix_names = {
    "camera_matrix",     "K",          "M",  "intrinsics", "intrinsic_matrix", "intrinsic",
    "camera_intrinsics", "cam_matrix", "mtx"};
constexpr Names distortion_names = {"distortion_coefficients",
                                    "distortion_coeffs",
                                    "distortion_coeff",
                                    "dist_coeffs",
                                    "dist_coeff",
                                    "distortion_parameters",
                                    "distortion",
                                    "distortion_vector",
                                    "dist",
                                    "kc",
                                    "D"};
constexpr Names rotation_names = {"rotation", "rotation_matrix", "rot",
                                  "R",        "rotation_vector", "rvec"};
constexpr Names translation_names = {"translation", "translation_vector", "T", "t", "tvec"};

// What tells the cameras of a stereo pair apart, behind or before such a name.
struct Labels {
  const char *left, *right;
};
constexpr Labels stereo_labels[] = {{"1", "2"}, {"left", "right"}, {"l", "r"}, {"0", "1"}};

Mat3 matrix(const cv::Mat& m) {
  std::array<double, 9> rows;
  std::copy_n(m.ptr<double>(), 9, rows.begin());
  return from_rows(rows);
}

Vec3 vector(const cv::Mat& m) {
  const double* v = m.ptr<double>();
  return {v[0], v[1], v[2]};
}

// A matrix, or a vector along the axis, as long as the angle.
Mat3 rotation(const cv::Mat& m, const OpenCvFile& file) {
  if (m.total() == 9) return matrix(m);
  if (const double angle = glm::length(vector(m)); angle > 6.3)
    file.fail(
        fmt::format("its rotation's three numbers are no rotation vector, for its length is the "
                    "angle in radians, and theirs is {:.4g}; of angles in degrees make a matrix R",
                    angle));
  return rotation_of(vector(m));
}

void set_size(Camera& camera, const OpenCvFile& file, const Options& options,
              const std::string& label = "") {
  const std::array<int, 2> size = file.picture_size(label);
  camera.width = options.width > 0 ? options.width : size[0];
  camera.height = options.height > 0 ? options.height : size[1];
  if (camera.width <= 0 || camera.height <= 0)
    file.fail("it does not say the pictures' size; give it with --size WIDTHxHEIGHT");
}

// Pairs of numbers may be height and width, as Python's arrays have them.
void check_size(const Camera& camera, const OpenCvFile& file) {
  const auto off = [&](double width, double height) {
    return std::abs(camera.K[2][0] / width - 0.5) + std::abs(camera.K[2][1] / height - 0.5);
  };
  constexpr double clearly = 0.2;
  if (off(camera.width, camera.height) > off(camera.height, camera.width) + clearly)
    file.fail(
        fmt::format("its pictures of {}x{} have the principal point ({:.0f}, {:.0f}), as if "
                    "height and width were swapped; give the size with --size WIDTHxHEIGHT",
                    camera.width, camera.height, camera.K[2][0], camera.K[2][1]));
}

// cv::fisheye writes four coefficients as well, often under the same names.
void note_fisheye(const Camera& camera, const OpenCvFile& file, const Options& options) {
  constexpr double rarely = 0.005;  // is a lens's decentring more
  const std::vector<double>& k = camera.distortion;
  if (k.size() != 4 || k == std::vector<double>(4, 0.0)) return;
  if (std::max(std::abs(k[2]), std::abs(k[3])) <= rarely && !file.has("DIM")) return;
  options.note(fmt::format(
      "{}: of its four distortion coefficients the last two, {:g} and {:g}, are taken for p1 and "
      "p2, and {}. A fisheye calibration (cv::fisheye) writes four, too: if it is one, undistort "
      "the pictures first and calibrate these",
      file.path(), k[2], k[3],
      file.has("DIM") ? "the size is called DIM, as beside a fisheye's K and D"
                      : "few lenses have such large ones"));
}

void set_intrinsics(Camera& camera, const OpenCvFile& file, const Options& options,
                    const std::string& label = "") {
  camera.K = matrix(file.need(matrix_names, {9}, "camera matrix", label));
  if (options.width <= 0) check_size(camera, file);
  const cv::Mat distortion = file.find(distortion_names, label);
  const double* values = distortion.ptr<double>();
  camera.distortion.assign(values, values + distortion.total());
  if (distortion.empty() && label.empty()) camera.distortion = file.single_coefficients();
  if (camera.distortion.empty()) file.refuse_unread_distortion();
  note_fisheye(camera, file, options);
  // The last two of OpenCV's 14 tilt the sensor; calibrations that do not use them hold zeros.
  if (camera.distortion.size() != 14) return;
  if (camera.distortion[12] != 0.0 || camera.distortion[13] != 0.0)
    file.fail(
        "its last two of 14 distortion coefficients tilt the sensor, which a rig's lenses do not "
        "do; calibrate without CALIB_TILTED_MODEL");
  camera.distortion.resize(12);
}

void set_pose(Camera& camera, const OpenCvFile& file, const std::string& label = "") {
  camera.R = rotation(file.need(rotation_names, {3, 9}, "rotation", label), file);
  camera.t = vector(file.need(translation_names, {3}, "translation", label));
}

Camera read_opencv_camera(const std::string& path, const Options& options) {
  const OpenCvFile file(path);
  Camera camera;
  file.need(matrix_names, {9}, "camera matrix");  // what it is comes before what it lacks
  set_size(camera, file, options);
  set_intrinsics(camera, file, options);
  if (file.find(rotation_names).empty()) file.refuse_board_poses();
  set_pose(camera, file);
  return camera;
}

// The first camera is the world's origin.
Rig stereo_pair(const OpenCvFile& intrinsics, const Labels& labels, const OpenCvFile& extrinsics,
                const Options& options) {
  Rig rig;
  rig.cameras.resize(2);
  for (Camera& camera : rig.cameras) set_size(camera, intrinsics, options);
  rig.cameras[0].name = "left";
  set_intrinsics(rig.cameras[0], intrinsics, options, labels.left);
  rig.cameras[1].name = "right";
  set_intrinsics(rig.cameras[1], intrinsics, options, labels.right);
  set_pose(rig.cameras[1], extrinsics);
  return rig;
}

// How \p file tells a stereo pair's lenses apart; null: it holds none.
const Labels* labels_in(const OpenCvFile& file) {
  const auto has = [&](const char* label) { return !file.find(matrix_names, label).empty(); };
  if (has("1") && has("2") && (has("0") || has("3")))
    file.fail("it holds more than two cameras; give a file for each, with its R and T");
  for (const Labels& labels : stereo_labels)
    if (has(labels.left) && has(labels.right)) return &labels;
  return nullptr;
}

// EasyMocap's intri.yml and extri.yml: K_NAME, dist_NAME, and R_NAME or Rot_NAME and T_NAME.
std::optional<Rig> easymocap(const OpenCvFile& intrinsics, const OpenCvFile& extrinsics,
                             const Options& options) {
  const std::vector<std::string> names = intrinsics.strings("names");
  if (names.empty() || intrinsics.find(matrix_names, names.front()).empty()) return std::nullopt;
  Rig rig;
  for (const std::string& name : names) {
    Camera& camera = rig.cameras.emplace_back();
    camera.name = name;
    set_size(camera, intrinsics, options, name);
    set_intrinsics(camera, intrinsics, options, name);
    set_pose(camera, extrinsics, name);
  }
  return rig;
}

// Of several cameras in one file, or their lenses in one and where they stand in the other;
// nothing: they hold one each.
std::optional<Rig> several_in(const std::vector<std::string>& files, const Options& options) {
  if (files.size() > 2) return std::nullopt;
  const OpenCvFile first(files.front()), last(files.back());
  if (auto rig = easymocap(first, last, options)) return rig;
  if (auto rig = easymocap(last, first, options)) return rig;
  const Labels *of_first = labels_in(first), *of_last = labels_in(last);
  if (files.size() == 2 && of_first && of_last)
    last.fail("it holds a stereo pair's lenses, as the file before it does; give one pair");
  if (of_first) return stereo_pair(first, *of_first, last, options);
  if (of_last) return stereo_pair(last, *of_last, first, options);
  return std::nullopt;
}

}  // namespace

Rig opencv(const std::vector<std::string>& files, const Options& options) {
  Rig rig;
  if (auto several = several_in(files, options)) {
    rig = *std::move(several);
  } else {
    const std::vector<std::string> names = names_of(files);
    for (std::size_t i = 0; i < files.size(); ++i) {
      rig.cameras.push_back(read_opencv_camera(files[i], options));
      rig.cameras.back().name = names[i];
    }
  }
  return finished(rig, files.front());
}

}  // namespace polyhull::import
