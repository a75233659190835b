// SPDX-License-Identifier: LGPL-2.1-or-later
// Bouguet's toolbox writes assignments: fc = [ 657.4 ; 657.8 ]; Its frames are OpenCV's: x right, y
// down, z forward, distortion k1 k2 p1 p2 k3, the first pixel's centre at (0, 0).
#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>

#include "base/error.h"
#include "rig/import.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

using Variables = std::map<std::string, std::vector<double>>;

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

// The numbers between brackets, or the one number, at the beginning of \p text up to its semicolon;
// nothing for what else Matlab assigns.
std::optional<std::vector<double>> read_numbers(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  std::string values;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == text.npos) return std::nullopt;
    values = text.substr(1, end - 1);
    text.remove_prefix(end + 1);
  } else {
    const std::size_t end = std::min(text.find_first_not_of("+-.0123456789eE"), text.size());
    values = text.substr(0, end);
    text.remove_prefix(end);
    if (values.empty()) return std::nullopt;
  }
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  if (!text.starts_with(';')) return std::nullopt;
  for (char& c : values)
    if (c == ';' || c == ',') c = ' ';
  std::vector<double> numbers;
  std::istringstream words(values);
  for (double value; words >> value;) numbers.push_back(value);
  return numbers;
}

Variables read_assignments(const std::string& file) {
  std::istringstream in(read_text(file));
  std::string content;
  for (std::string line; std::getline(in, line);) content += line.substr(0, line.find('%')) + '\n';
  Variables variables;
  for (std::size_t equals = content.find('='); equals != content.npos;
       equals = content.find('=', equals + 1)) {
    std::size_t end = equals;
    while (end > 0 && (content[end - 1] == ' ' || content[end - 1] == '\t')) --end;
    std::size_t begin = end;
    while (begin > 0 && is_word(content[begin - 1])) --begin;
    if (begin == end) continue;
    if (auto numbers = read_numbers(std::string_view(content).substr(equals + 1)))
      variables[content.substr(begin, end - begin)] = std::move(*numbers);
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

Camera read_bouguet_camera(const std::string& file, const Options& options) {
  const Variables variables = read_assignments(file);
  const auto number = [&](const std::string& name) { return get(variables, file, name, 1)[0]; };
  Camera camera;
  // A rig's check refuses what is not between 1 and 32768.
  const auto pixels = [&](const std::string& name) {
    return static_cast<int>(std::clamp(number(name), 0.0, 1e6));
  };
  camera.width = options.width > 0 ? options.width : pixels("nx");
  camera.height = options.height > 0 ? options.height : pixels("ny");
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
  // World points (y, -x, z) of the board's (x, y, z).
  if (options.prototype_axes)
    camera.R = camera.R * glm::transpose(from_rows({0, 1, 0, -1, 0, 0, 0, 0, 1}));
  return camera;
}

}  // namespace

Rig bouguet(const std::vector<std::string>& files, const Options& options) {
  Rig rig;
  const std::vector<std::string> names = names_of(files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    rig.cameras.push_back(read_bouguet_camera(files[i], options));
    rig.cameras.back().name = names[i];
  }
  return parse_rig(rig_to_json(rig), files.front());
}

}  // namespace polyhull::import
