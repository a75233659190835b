// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/wand_input.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "base/error.h"
#include "base/picture.h"
#include "text_file.h"

namespace polyhull::calibrate_tool {

using calibration::LightFault;
using calibration::Take;
Take find_light_views(const Pictures& pictures, int lights, std::vector<LightCounts>* counts,
                      const calibration::Progress& progress) {
  Take take = calibration::empty_wand_take();
  for (const std::string& name : pictures.instants) {
    take.instants.push_back(lights == 2 ? name + " a" : name);
    if (lights == 2) take.instants.push_back(name + " b");
  }
  counts->assign(pictures.cameras.size(), {});
  for (std::size_t c = 0; c < pictures.cameras.size(); ++c) {
    progress("looking for the light", static_cast<double>(c) / pictures.cameras.size());
    calibration::TakeCamera camera{pictures.cameras[c], 0, 0, {}};
    LightCounts& count = (*counts)[c];
    for (std::size_t i = 0; i < pictures.instants.size(); ++i) {
      if (pictures.files[c][i].empty()) continue;
      const Picture grey = load_picture(pictures.files[c][i], 1);
      take_size(grey.width, grey.height, pictures.files[c][i], camera);
      const calibration::Lights found = calibration::find_lights(grey, lights);
      count.used += found.fault == LightFault::none;
      count.dark += found.fault == LightFault::dark;
      count.several += found.fault == LightFault::several;
      count.too_large += found.fault == LightFault::too_large;
      count.too_bright += found.fault == LightFault::too_bright;
      for (std::size_t k = 0; k < found.places.size(); ++k)
        take.views.push_back({c, i * static_cast<std::size_t>(lights) + k, {0}, {found.places[k]}});
    }
    take.cameras.push_back(camera);
  }
  progress("looking for the light", 1.0);
  return take;
}

void read_detections(const std::string& path, int width, int height, Take& take) {
  std::map<std::string, std::size_t> cameras, instants;
  for (const auto& camera : take.cameras) cameras.emplace(camera.name, cameras.size());
  for (const std::string& name : take.instants) instants.emplace(name, instants.size());
  std::set<std::pair<std::size_t, std::size_t>> seen;
  for (const auto& view : take.views) seen.emplace(view.camera, view.instant);
  std::istringstream in(read_text(path));
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line = line.substr(0, line.find('#'));
    std::ranges::replace(line, ',', ' ');
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream words(line);
    std::string point, camera, rest;
    Vec2 pixel(NAN);
    if (!(words >> point >> camera >> pixel.x >> pixel.y) || (words >> rest))
      throw Error(Error::Kind::bad_input, "'{}', line {}: expected POINT CAMERA U V.", path,
                  number);
    const auto [c, new_camera] = cameras.emplace(camera, take.cameras.size());
    if (new_camera) take.cameras.push_back({camera, width, height, {}});
    const auto [i, new_instant] = instants.emplace(point, take.instants.size());
    if (new_instant) take.instants.push_back(point);
    if (!seen.emplace(c->second, i->second).second)
      throw Error(Error::Kind::bad_input, "'{}', line {}: camera '{}' has point '{}' already.",
                  path, number, camera, point);
    take.views.push_back({c->second, i->second, {0}, {pixel}});
  }
}

}  // namespace polyhull::calibrate_tool
