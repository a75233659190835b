// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <map>

#include "base/error.h"
#include "base/plain_text.h"
#include "camera_files.h"
#include "studio/calibration/outline_poses.h"

namespace polyhull {
namespace {

/// The number at the end of the file's name, without leading zeros; the whole name without one.
std::string instant_of(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  const auto last = std::find_if(stem.rbegin(), stem.rend(), digit);
  if (last == stem.rend()) return stem;
  const auto before = std::find_if_not(last, stem.rend(), digit);
  const std::string number(before.base(), last.base());
  const auto first = number.find_first_not_of('0');
  return first == std::string::npos ? "0" : number.substr(first);
}

bool is_picture(const std::filesystem::path& file) {
  const std::string ending = lower_case(file.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

using Instants = std::map<std::string, calibration::OutlineInstant>;

void read_folder(const std::string& folder, const Rig& rig, std::size_t camera,
                 const MaskSettings& mask, Instants& instants) {
  if (!std::filesystem::is_directory(folder))
    throw Error(Error::Kind::bad_input,
                "'{}' is no folder: `refine` takes one folder of pictures for each camera.",
                folder);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (is_picture(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    calibration::OutlineInstant& instant = instants[instant_of(file)];
    instant.resize(rig.cameras.size());
    if (!instant[camera].empty())
      throw Error(Error::Kind::bad_input,
                  "Two pictures in '{}' are of instant {}: the last number in their names tells.",
                  folder, instant_of(file));
    try {
      instant[camera] = contours_of_picture(file.string(), rig.cameras[camera], mask);
    } catch (const Error& error) {
      std::cerr << "polyhull-rig: left out: " << error.what() << "\n";
    }
  }
}

std::vector<std::size_t> numbers_of(const Rig& rig, const std::vector<std::string>& names) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    if (names.empty() || std::count(names.begin(), names.end(), rig.cameras[i].name) > 0)
      numbers.push_back(i);
  for (const std::string& name : names)
    if (rig.find(name) == nullptr)
      throw Error(Error::Kind::bad_input, "--only names camera '{}', which the rig does not have.",
                  name);
  return numbers;
}

double degrees_between(const Mat3& a, const Mat3& b) {
  const Mat3 turn = a * glm::transpose(b);
  const double cosine = 0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0);
  return glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0)));
}

void print(const Rig& rig, const calibration::OutlinePoses& found, std::size_t instants) {
  std::cout << fmt::format("{} frontier points in {} instants; error {:.2f} px, {:.2f} px before\n",
                           found.tangencies, instants, found.error_after, found.error_before);
  std::cout << fmt::format("{:16} {:>10} {:>10} {:>12} {:>10}\n", "camera", "px before", "px",
                           "moved, " + rig.unit, "turned, °");
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera &was = rig.cameras[i], &is = found.rig.cameras[i];
    std::cout << fmt::format("{:16} {:10.2f} {:10.2f} {:12.4g} {:10.3f}\n", was.name,
                             found.camera_before[i], found.camera_after[i],
                             glm::distance(was.centre(), is.centre()),
                             degrees_between(was.R, is.R));
  }
}

}  // namespace

Rig refine_rig(const Rig& rig, const RefineArguments& arguments) {
  Instants by_name;
  for (const auto& [camera, folder] :
       assign_files(arguments.folders, rig, "--pictures", "polyhull-rig"))
    read_folder(folder, rig, camera, arguments.mask, by_name);
  std::vector<calibration::OutlineInstant> instants;
  for (const auto& [name, instant] : by_name)
    if (std::count_if(instant.begin(), instant.end(),
                      [](const Rings& rings) { return !rings.empty(); }) >= 2)
      instants.push_back(instant);
  if (instants.empty())
    throw Error(Error::Kind::bad_input,
                "No two folders have pictures of one instant: their names must end in the same "
                "numbers, as of cam0/0001.png and cam1/0001.png.");
  const calibration::OutlinePoses found =
      calibration::poses_from_outlines(rig, instants, numbers_of(rig, arguments.only));
  print(rig, found, instants.size());
  return found.rig;
}

}  // namespace polyhull
