// SPDX-License-Identifier: LGPL-2.1-or-later
#include "camera_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

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

}  // namespace

std::vector<std::pair<std::size_t, std::string>> assign_files(const std::vector<std::string>& files,
                                                              const Rig& rig,
                                                              const std::string& option) {
  const auto fail = [&](const std::string& file, const std::string& what) {
    throw Error(Error::Kind::bad_input,
                option + " " + file + ": " + what + "; give CAMERA=FILE, one per camera");
  };
  const std::size_t none = rig.cameras.size();
  std::vector<bool> taken(rig.cameras.size());
  std::vector<std::pair<std::size_t, std::string>> result;
  for (const std::string& file : files) {
    const auto equals = file.find('=');
    const bool named = equals < file.find('/');
    const std::string path = named ? file.substr(equals + 1) : file;
    const std::string name =
        named ? file.substr(0, equals) : std::filesystem::path(path).filename().string();
    std::size_t found = none;
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      const std::string& camera = rig.cameras[i].name;
      const bool fits = named ? camera == name : belongs(name, camera);
      if (fits && (found == none || camera.size() > rig.cameras[found].name.size())) found = i;
    }
    if (named && found == none) {
      std::string names;
      for (const Camera& camera : rig.cameras) names += (names.empty() ? "" : ", ") + camera.name;
      fail(file, "the rig has no camera \"" + name + "\", it has " + names);
    }
    if (found != none && taken[found])
      fail(file, "camera \"" + rig.cameras[found].name + "\" has a file already");
    if (found != none) taken[found] = true;
    result.emplace_back(found, path);
  }
  for (auto& [camera, path] : result) {
    if (camera != none) continue;
    camera = static_cast<std::size_t>(std::find(taken.begin(), taken.end(), false) - taken.begin());
    if (camera == none) fail(path, "there are more files than cameras");
    taken[camera] = true;
  }
  return result;
}

}  // namespace polyhull
