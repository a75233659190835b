// SPDX-License-Identifier: LGPL-2.1-or-later
#include "camera_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>

#include "base/error.h"

namespace polyhull {
namespace {

// Whether a file called so is named after the camera: cam1.png and cam1_left.png after cam1,
// cam10.png not.
bool belongs(const std::string& name, const std::string& camera) {
  return !camera.empty() && name.starts_with(camera) &&
         (name.size() == camera.size() ||
          !std::isalnum(static_cast<unsigned char>(name[camera.size()])));
}

// The camera of the longest name that \p name is named after; the number of cameras: none.
std::size_t camera_of(const std::string& name, const Rig& rig) {
  std::size_t found = rig.cameras.size();
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const std::string& camera = rig.cameras[i].name;
    if (belongs(name, camera) &&
        (found == rig.cameras.size() || camera.size() > rig.cameras[found].name.size()))
      found = i;
  }
  return found;
}

using AssignedFiles = std::vector<std::pair<std::size_t, std::string>>;

// \p ordered: the files that no name assigned, their indices.
void say_doubts(const AssignedFiles& files, const std::vector<std::size_t>& ordered, const Rig& rig,
                const std::string& program) {
  std::string list;
  for (const std::size_t i : ordered)
    list += (list.empty() ? "" : ", ") + rig.cameras[files[i].first].name + "=" + files[i].second;
  if (!list.empty())
    std::cerr << program
              << ": note: these files are named after no camera and go by the rig's order: " << list
              << "\n";
  for (std::size_t i = 0; i < files.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (files[i].second == files[k].second)
        std::cerr << program << ": warning: " << files[i].second << " is the picture of both \""
                  << rig.cameras[files[k].first].name << "\" and \""
                  << rig.cameras[files[i].first].name << "\"\n";
}

}  // namespace

std::vector<std::pair<std::size_t, std::string>> assign_files(const std::vector<std::string>& files,
                                                              const Rig& rig,
                                                              const std::string& option,
                                                              const std::string& program) {
  const auto fail = [&](const std::string& file, const std::string& what) {
    throw Error(Error::Kind::bad_input, "{} {}: {}; give CAMERA=FILE, one per camera.", option,
                file, what);
  };
  const std::size_t none = rig.cameras.size();
  std::vector<bool> taken(rig.cameras.size());
  AssignedFiles result;
  for (const std::string& file : files) {
    const auto equals = file.find('=');
    const bool named = equals < file.find('/');
    const std::string path = named ? file.substr(equals + 1) : file;
    const std::filesystem::path whole(path);
    std::size_t found = none;
    if (named) {
      const auto camera =
          std::find_if(rig.cameras.begin(), rig.cameras.end(),
                       [&](const Camera& each) { return file.compare(0, equals, each.name) == 0; });
      found = static_cast<std::size_t>(camera - rig.cameras.begin());
    } else {
      found = camera_of(whole.filename().string(), rig);
      if (found == none) found = camera_of(whole.parent_path().filename().string(), rig);
    }
    if (named && found == none) {
      std::string names;
      for (const Camera& camera : rig.cameras) names += (names.empty() ? "" : ", ") + camera.name;
      fail(file,
           fmt::format("the rig has no camera '{}', it has {}", file.substr(0, equals), names));
    }
    if (found != none && taken[found])
      fail(file, fmt::format("camera '{}' has a file already", rig.cameras[found].name));
    if (found != none) taken[found] = true;
    result.emplace_back(found, path);
  }
  std::vector<std::size_t> ordered;
  for (std::size_t i = 0; i < result.size(); ++i) {
    auto& [camera, path] = result[i];
    if (camera != none) continue;
    ordered.push_back(i);
    camera = static_cast<std::size_t>(std::find(taken.begin(), taken.end(), false) - taken.begin());
    if (camera == none) fail(path, "there are more files than cameras");
    taken[camera] = true;
  }
  say_doubts(result, ordered, rig, program);
  return result;
}

}  // namespace polyhull
