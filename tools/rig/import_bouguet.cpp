// SPDX-License-Identifier: LGPL-2.1-or-later
// Bouguet's toolbox writes assignments: fc = [ 657.4 ; 657.8 ]; Its frames are OpenCV's: x right, y
// down, z forward, distortion k1 k2 p1 p2 k3, the first pixel's centre at (0, 0).
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "base/error.h"
#include "rig/import.h"

namespace polyhull::import {
namespace {

using Variables = std::map<std::string, std::vector<double>>;

Variables read_assignments(const std::string& file) {
  std::ifstream in(file);
  if (!in)
    throw Error(Error::Kind::not_found,
                "Cannot read '{}'; check that the file exists and may be read.", file);
  std::ostringstream all;
  for (std::string line; std::getline(in, line);) all << line.substr(0, line.find('%')) << '\n';
  const std::string content = all.str();
  static const std::regex assignment(R"((\w+)\s*=\s*(\[([^\]]*)\]|[-+.\deE]+)\s*;)");
  Variables variables;
  for (std::sregex_iterator found(content.begin(), content.end(), assignment), end; found != end;
       ++found) {
    std::string values = (*found)[3].matched ? (*found)[3].str() : (*found)[2].str();
    for (char& c : values)
      if (c == ';' || c == ',') c = ' ';
    std::istringstream words(values);
    std::vector<double>& target = variables[(*found)[1].str()];
    target.clear();
    for (double value; words >> value;) target.push_back(value);
  }
  return variables;
}

const std::vector<double>& get(const Variables& variables, const std::string& file,
                               const std::string& name, std::size_t count) {
  const auto found = variables.find(name);
  if (found == variables.end())
    throw Error(Error::Kind::bad_input,
                "{}: it does not set {}; give a Calib_Results.m of Bouguet's toolbox.", file, name);
  if (found->second.size() != count)
    throw Error(Error::Kind::bad_input, "{}: {} has {} numbers, expected {}.", file, name,
                found->second.size(), count);
  return found->second;
}

Camera read_camera(const std::string& file, const Options& options) {
  const Variables variables = read_assignments(file);
  const auto number = [&](const std::string& name) { return get(variables, file, name, 1)[0]; };
  Camera camera;
  camera.width = options.width > 0 ? options.width : static_cast<int>(number("nx"));
  camera.height = options.height > 0 ? options.height : static_cast<int>(number("ny"));
  const auto& fc = get(variables, file, "fc", 2);
  const auto& cc = get(variables, file, "cc", 2);
  const double alpha = variables.count("alpha_c") ? number("alpha_c") : 0.0;
  camera.K = from_rows({fc[0], alpha * fc[0], cc[0], 0, fc[1], cc[1], 0, 0, 1});
  if (variables.count("kc")) camera.distortion = get(variables, file, "kc", 5);
  const std::string board = std::to_string(options.board);
  if (variables.count("Rc_ext") && variables.count("Tc_ext")) {
    const auto& r = get(variables, file, "Rc_ext", 9);
    camera.R = from_rows({r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]});
    const auto& t = get(variables, file, "Tc_ext", 3);
    camera.t = Vec3(t[0], t[1], t[2]);
  } else {
    const auto& om = get(variables, file, "omc_" + board, 3);
    const auto& t = get(variables, file, "Tc_" + board, 3);
    camera.R = rotation_of(Vec3(om[0], om[1], om[2]));
    camera.t = Vec3(t[0], t[1], t[2]);
  }
  return camera;
}

}  // namespace

Rig bouguet(const std::vector<std::string>& files, const Options& options) {
  Rig rig;
  const std::vector<std::string> names = names_of(files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    rig.cameras.push_back(read_camera(files[i], options));
    rig.cameras.back().name = names[i];
  }
  return parse_rig(rig_to_json(rig), files.front());
}

}  // namespace polyhull::import
