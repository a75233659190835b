// SPDX-License-Identifier: LGPL-2.1-or-later
#include "floor_points.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "rig/floor.h"
#include "text_file.h"

namespace polyhull {

std::vector<Vec3> read_floor_points(const std::string& path, const Rig& rig) {
  std::istringstream in(read_text(path));
  std::vector<std::pair<std::string, std::vector<std::pair<std::size_t, Vec2>>>> points;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream words(line);
    std::string point, camera, rest;
    Vec2 pixel;
    const bool read = static_cast<bool>(words >> point >> camera >> pixel.x >> pixel.y);
    if (!read || (words >> rest))
      throw Error(Error::Kind::bad_input, "'{}', line {}: expected POINT CAMERA U V.", path,
                  number);
    const Camera* found = rig.find(camera);
    if (!found)
      throw Error(Error::Kind::bad_input, "'{}', line {}: there is no camera '{}'.", path, number,
                  camera);
    auto at = std::ranges::find(points, point, [](const auto& p) { return p.first; });
    if (at == points.end()) at = points.insert(points.end(), {point, {}});
    at->second.emplace_back(found - rig.cameras.data(), pixel);
  }
  std::vector<Vec3> out;
  for (const auto& [name, seen] : points) {
    try {
      out.push_back(triangulate(rig, seen));
    } catch (const Error& error) {
      throw Error(Error::Kind::bad_input, "'{}', point '{}': {}", path, name, error.what());
    }
  }
  return out;
}

}  // namespace polyhull
