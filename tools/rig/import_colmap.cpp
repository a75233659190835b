// SPDX-License-Identifier: LGPL-2.1-or-later
// COLMAP's text model: cameras.txt (intrinsics) and images.txt (poses; every second line holds
// points).
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "base/error.h"
#include "rig/file_names.h"
#include "rig/import.h"

namespace polyhull::import {
namespace {

std::ifstream open_file(const std::string& path) {
  std::ifstream in(path);
  if (!in)
    throw Error(Error::Kind::not_found,
                "Cannot read '{}'; give the folder with COLMAP's cameras.txt and images.txt "
                "(colmap model_converter --output_type TXT makes them).",
                path);
  return in;
}

// COLMAP counts pixels from the corner of the first one, rigs from its centre.
Mat3 intrinsics(double fx, double fy, double cx, double cy) {
  return from_rows({fx, 0, cx - 0.5, 0, fy, cy - 0.5, 0, 0, 1});
}

void set_model(Camera& camera, const std::string& model, const std::vector<double>& p,
               const std::string& file, std::size_t line) {
  const std::map<std::string, std::size_t> counts{{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4},
                                                  {"SIMPLE_RADIAL", 4},  {"RADIAL", 5},
                                                  {"OPENCV", 8},         {"FULL_OPENCV", 12}};
  const auto known = counts.find(model);
  if (known == counts.end())
    fail_at(
        file, line,
        fmt::format("camera model {} cannot be had in OpenCV's terms; undistort the pictures with "
                    "COLMAP first",
                    model));
  if (p.size() != known->second)
    fail_at(file, line,
            fmt::format("{} has {} parameters, found {}", model, known->second, p.size()));
  const bool one_focal = model == "SIMPLE_PINHOLE" || model == "SIMPLE_RADIAL" || model == "RADIAL";
  camera.K = one_focal ? intrinsics(p[0], p[0], p[1], p[2]) : intrinsics(p[0], p[1], p[2], p[3]);
  if (model == "SIMPLE_RADIAL") camera.distortion = {p[3], 0, 0, 0};
  if (model == "RADIAL") camera.distortion = {p[3], p[4], 0, 0};
  if (model == "OPENCV" || model == "FULL_OPENCV") camera.distortion.assign(p.begin() + 4, p.end());
  if (model == "FULL_OPENCV" && p[9] == 0.0 && p[10] == 0.0 && p[11] == 0.0)
    camera.distortion.resize(5);  // no denominator
}

std::map<int, Camera> read_cameras(const std::string& file) {
  std::ifstream in = open_file(file);
  std::map<int, Camera> cameras;
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    std::istringstream words(line);
    int id = 0;
    std::string model;
    Camera camera;
    if (line.empty() || line[0] == '#') continue;
    if (!(words >> id >> model >> camera.width >> camera.height))
      fail_at(file, number, "expected: id model width height parameters");
    std::vector<double> parameters;
    for (double value; words >> value;) parameters.push_back(value);
    set_model(camera, model, parameters, file, number);
    cameras[id] = camera;
  }
  return cameras;
}

}  // namespace

Rig colmap(const std::string& folder, const Options&) {
  const std::filesystem::path path(folder);
  const std::map<int, Camera> cameras = read_cameras((path / "cameras.txt").string());
  const std::string file = (path / "images.txt").string();
  std::ifstream in = open_file(file);
  Rig rig;
  std::size_t number = 0;
  bool points_follow = false;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (points_follow) {
      points_follow = false;
      continue;
    }
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    int id = 0, camera_id = 0;
    double w = 0, x = 0, y = 0, z = 0;
    Vec3 t;
    std::string name;
    if (!(words >> id >> w >> x >> y >> z >> t.x >> t.y >> t.z >> camera_id >> name))
      fail_at(file, number, "expected: id qw qx qy qz tx ty tz camera name");
    points_follow = true;
    const auto found = cameras.find(camera_id);
    if (found == cameras.end())
      fail_at(file, number, fmt::format("camera {} is not in cameras.txt", camera_id));
    const double size = w * w + x * x + y * y + z * z;
    if (!(size > 0.0)) fail_at(file, number, "the rotation's quaternion is zero");
    const double s = 2.0 / size;
    Camera& camera = rig.cameras.emplace_back(found->second);
    camera.name = name_of_file(std::filesystem::path(name).stem().string());
    camera.R = from_rows({1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
                          s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),
                          s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)});
    camera.t = t;
  }
  return parse_rig(rig_to_json(rig), file);
}

}  // namespace polyhull::import
