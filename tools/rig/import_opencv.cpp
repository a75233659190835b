// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenCV's FileStorage files, XML or YAML.
#include <filesystem>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "rig/import.h"

namespace polyhull::import {
namespace {

using Names = std::initializer_list<const char*>;

constexpr Names matrix_names = {
    "CameraMatrix", "camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M", "intrinsics"};
constexpr Names distortion_names = {"DistortionCoeffs",
                                    "distortion_coefficients",
                                    "Distortion_Coefficients",
                                    "distCoeffs",
                                    "dist_coeffs",
                                    "D"};
constexpr Names rotation_names = {"Rotation", "R", "rvec", "rotation", "Rvec"};
constexpr Names translation_names = {"Translation", "T", "t", "tvec", "translation", "Tvec"};

class File {
 public:
  explicit File(const std::string& path) : path_(path) {
    if (!std::filesystem::is_regular_file(path))
      throw Error(Error::Kind::not_found, "Cannot read '{}'; check that it exists and is a file.",
                  path);
    try {
      storage_.open(path, cv::FileStorage::READ);
    } catch (const cv::Exception& error) {
      throw Error(Error::Kind::bad_input, "{}: not an OpenCV XML or YAML file: {}.", path,
                  error.err);
    }
    if (!storage_.isOpened() || !storage_.root().isMap())
      throw Error(Error::Kind::bad_input, "{}: not an OpenCV XML or YAML file.", path);
  }

  bool has(const char* name) const { return !storage_[name].empty(); }

  // The first of the names that is there, as doubles; empty where none is.
  cv::Mat find(Names names) const {
    for (const char* name : names) {
      const cv::FileNode node = storage_[name];
      if (node.empty()) continue;
      cv::Mat raw, result;
      try {
        node >> raw;
        raw.convertTo(result, CV_64F);
      } catch (const cv::Exception& error) {
        throw Error(Error::Kind::bad_input, "{}: {} is no matrix: {}.", path_, name, error.err);
      }
      return result.isContinuous() ? result : result.clone();
    }
    return {};
  }

  cv::Mat need(Names names, std::initializer_list<std::size_t> sizes, const char* what) const {
    const cv::Mat found = find(names);
    if (found.empty()) {
      std::string list;
      for (const char* name : names) list += (list.empty() ? "" : ", ") + std::string(name);
      throw Error(Error::Kind::bad_input, "{}: no {}; looked for {}.", path_, what, list);
    }
    for (const std::size_t size : sizes)
      if (found.total() * found.channels() == size) return found;
    std::string expected;
    for (const std::size_t size : sizes)
      expected += (expected.empty() ? "" : " or ") + std::to_string(size);
    throw Error(Error::Kind::bad_input, "{}: the {} has {} numbers, expected {}.", path_, what,
                found.total() * found.channels(), expected);
  }

  int whole(Names names) const {
    for (const char* name : names)
      if (has(name) && storage_[name].isInt()) return static_cast<int>(storage_[name]);
    return 0;
  }

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  cv::FileStorage storage_;
};

Mat3 matrix(const cv::Mat& m) {
  std::array<double, 9> rows;
  std::copy_n(m.ptr<double>(), 9, rows.begin());
  return from_rows(rows);
}

Vec3 vector(const cv::Mat& m) {
  const double* v = m.ptr<double>();
  return {v[0], v[1], v[2]};
}

Mat3 rotation(const cv::Mat& m) {
  return m.total() == 9 ? matrix(m) : rotation_of(vector(m));
}

void set_size(Camera& camera, const File& file, const Options& options) {
  camera.width = options.width > 0
                     ? options.width
                     : file.whole({"image_width", "imageWidth", "Image_Width", "width"});
  camera.height = options.height > 0
                      ? options.height
                      : file.whole({"image_height", "imageHeight", "Image_Height", "height"});
  if (camera.width <= 0 || camera.height <= 0)
    throw Error(Error::Kind::bad_input,
                "{}: it does not say the pictures' size; give it with --size WIDTHxHEIGHT.",
                file.path());
}

void set_intrinsics(Camera& camera, const File& file, Names matrix_name, Names distortion_name) {
  camera.K = matrix(file.need(matrix_name, {9}, "camera matrix"));
  const cv::Mat distortion = file.find(distortion_name);
  const double* values = distortion.ptr<double>();
  camera.distortion.assign(values, values + distortion.total());
  // The last two of OpenCV's 14 tilt the sensor; calibrations that do not use them hold zeros.
  while (camera.distortion.size() > 12 && camera.distortion.back() == 0.0)
    camera.distortion.pop_back();
}

Camera read_opencv_camera(const std::string& path, const Options& options) {
  const File file(path);
  Camera camera;
  set_size(camera, file, options);
  set_intrinsics(camera, file, matrix_names, distortion_names);
  camera.R = rotation(file.need(rotation_names, {3, 9}, "rotation"));
  camera.t = vector(file.need(translation_names, {3}, "translation"));
  return camera;
}

// The first camera is the world's origin.
Rig stereo_pair(const File& intrinsics, const File& extrinsics, const Options& options) {
  Rig rig;
  rig.cameras.resize(2);
  for (Camera& camera : rig.cameras) set_size(camera, intrinsics, options);
  rig.cameras[0].name = "left";
  set_intrinsics(rig.cameras[0], intrinsics, {"M1"}, {"D1"});
  rig.cameras[1].name = "right";
  set_intrinsics(rig.cameras[1], intrinsics, {"M2"}, {"D2"});
  rig.cameras[1].R = rotation(extrinsics.need({"R"}, {3, 9}, "rotation"));
  rig.cameras[1].t = vector(extrinsics.need({"T"}, {3}, "translation"));
  return rig;
}

}  // namespace

Rig opencv(const std::vector<std::string>& files, const Options& options) {
  Rig rig;
  if (files.size() == 2 && File(files[0]).has("M1") && File(files[1]).has("T")) {
    rig = stereo_pair(File(files[0]), File(files[1]), options);
  } else {
    const std::vector<std::string> names = names_of(files);
    for (std::size_t i = 0; i < files.size(); ++i) {
      rig.cameras.push_back(read_opencv_camera(files[i], options));
      rig.cameras.back().name = names[i];
    }
  }
  return parse_rig(rig_to_json(rig), files.front());
}

}  // namespace polyhull::import
