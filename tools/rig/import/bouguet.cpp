// SPDX-License-Identifier: LGPL-2.1-or-later
// Bouguet's toolbox writes assignments: fc = [ 657.4 ; 657.8 ]; Its frames are OpenCV's: x right, y
// down, z forward, distortion k1 k2 p1 p2 k3, the first pixel's centre at (0, 0).
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "base/error.h"
#include "rig/import.h"
#include "rig/import/lines.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

struct Assigned {
  std::size_t line;
  std::vector<double> values;
};
using Variables = std::map<std::string, Assigned>;

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

// The numbers between brackets, or the one number, at the beginning of \p text, where that is all
// that is assigned; nothing for what else Matlab assigns.
std::optional<std::vector<double>> read_numbers(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\n"), text.size()));
  std::string values;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == text.npos) return std::nullopt;
    values = text.substr(1, end - 1);
    text.remove_prefix(end + 1);
  } else {
    const std::size_t end = std::min(text.find_first_of(" \t\n;,"), text.size());
    values = text.substr(0, end);
    text.remove_prefix(end);
  }
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  if (!text.empty() && text[0] != ';' && text[0] != ',' && text[0] != '\n') return std::nullopt;
  for (char& c : values)
    if (c == ';' || c == ',' || c == '\n') c = ' ';
  std::vector<double> numbers;
  for (const std::string_view word : words_of(values)) {
    if (word == "...") continue;
    const std::optional<double> number = number_of(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

Variables read_assignments(const std::string& file) {
  const std::string text = read_text(file);
  std::string content;
  int commented = 0;  // blocks within each other
  for (const Line& line : lines_of(text)) {
    commented += line.text == "%{";
    if (commented == 0) content += line.text.substr(0, line.text.find('%'));
    content += '\n';
    commented -= commented > 0 && line.text == "%}";
  }
  Variables variables;
  std::size_t line = 1, counted = 0;
  for (std::size_t equals = content.find('='); equals != content.npos;
       equals = content.find('=', equals + 1)) {
    line += static_cast<std::size_t>(std::count(content.begin() + static_cast<long>(counted),
                                                content.begin() + static_cast<long>(equals), '\n'));
    counted = equals;
    std::size_t end = equals;
    while (end > 0 && (content[end - 1] == ' ' || content[end - 1] == '\t')) --end;
    std::size_t begin = end;
    while (begin > 0 && is_word(content[begin - 1])) --begin;
    if (begin == end || (begin > 0 && content[begin - 1] == '.')) continue;  // a structure's field
    if (auto numbers = read_numbers(std::string_view(content).substr(equals + 1)))
      variables[content.substr(begin, end - begin)] = {line, std::move(*numbers)};
  }
  return variables;
}

// One camera's file.
struct Results {
  const std::string& file;
  Variables variables;

  bool has(const std::string& name) const { return variables.contains(name); }

  const std::vector<double>& get(const std::string& name, std::size_t count) const {
    const auto found = variables.find(name);
    if (found == variables.end())
      throw Error(Error::Kind::bad_input,
                  "{}: it does not set {}; give a Calib_Results.m of Bouguet's toolbox.", file,
                  name);
    const auto& [line, values] = found->second;
    if (name == "kc" && values.size() == 4)
      fail_at(file, line,
              "kc has 4 numbers, expected 5 (k1 k2 p1 p2 k3): the toolbox's fisheye model has 4, "
              "which cannot be had in OpenCV's terms; calibrate without it. A version of the "
              "toolbox that knew no k3 wrote 4, too: add a 0 to these");
    if (values.size() != count)
      fail_at(file, line,
              fmt::format("{} has {} numbers, expected {}", name, values.size(), count));
    for (const double value : values)
      if (!std::isfinite(value))
        fail_at(file, line,
                fmt::format("{} holds {}; the calibration did not succeed", name, value));
    return values;
  }
  double number(const std::string& name) const { return get(name, 1)[0]; }

  // Numbers of the pictures whose board has a pose; others, which were not used, hold NaN or none.
  std::set<int> boards() const {
    const auto finite = [&](const std::string& name) {
      const auto found = variables.find(name);
      return found != variables.end() && found->second.values.size() == 3 &&
             std::ranges::all_of(found->second.values, [](double v) { return std::isfinite(v); });
    };
    std::set<int> boards;
    for (const auto& item : variables) {
      int number = 0;
      const std::string& name = item.first;
      if (name.starts_with("omc_") && name.size() > 4 &&
          std::from_chars(name.data() + 4, name.data() + name.size(), number).ptr ==
              name.data() + name.size() &&
          finite(name) && finite(fmt::format("Tc_{}", number)))
        boards.insert(number);
    }
    return boards;
  }

  [[noreturn]] void fail_board(int board, const std::set<int>& in_all_files) const {
    const std::set<int> used = boards();
    const auto found = variables.find(fmt::format("omc_{}", board));
    if (used.empty() && found == variables.end())
      throw Error(Error::Kind::bad_input,
                  "{}: it sets neither omc_{} nor Rc_ext and Tc_ext, the poses of a board; give a "
                  "Calib_Results.m of Bouguet's toolbox.",
                  file, board);
    std::string what =
        found == variables.end()
            ? fmt::format("there is no picture {} (omc_{}) in this calibration", board, board)
            : fmt::format("picture {} was not used in this calibration", board);
    if (used.empty())
      what += ", nor was any other";
    else
      what += fmt::format("; {}", listed(used));
    if (!used.empty() && in_all_files != used)
      what += in_all_files.empty() ? ", but none in all files"
                                   : fmt::format(", and in all files {}", listed(in_all_files));
    what += used.empty() || in_all_files.empty()
                ? "; all cameras need a picture of the board at one place"
                : "; choose with --board N one where it stood at one place for all cameras";
    if (found == variables.end()) throw Error(Error::Kind::bad_input, "{}: {}.", file, what);
    fail_at(file, found->second.line, what);
  }

 private:
  static std::string listed(const std::set<int>& boards) {
    std::string text;
    std::size_t left = boards.size();
    for (const int board : boards) {
      text += (text.empty() ? "" : left == 1 ? " and " : ", ") + std::to_string(board);
      --left;
    }
    return (boards.size() == 1 ? "board " : "boards ") + text +
           (boards.size() == 1 ? " is" : " are");
  }
};

Camera read_bouguet_camera(const Results& results, const std::set<int>& in_all_files,
                           const Options& options) {
  Camera camera;
  // A rig's check refuses what is not between 1 and 32768.
  const auto pixels = [&](const std::string& name) {
    return static_cast<int>(std::clamp(results.number(name), 0.0, 1e6));
  };
  camera.width = options.width > 0 ? options.width : pixels("nx");
  camera.height = options.height > 0 ? options.height : pixels("ny");
  const auto& fc = results.get("fc", 2);
  const auto& cc = results.get("cc", 2);
  const double alpha = results.has("alpha_c") ? results.number("alpha_c") : 0.0;
  camera.K = from_rows({fc[0], alpha * fc[0], cc[0], 0, fc[1], cc[1], 0, 0, 1});
  if (results.has("kc")) camera.distortion = results.get("kc", 5);
  if (results.has("Rc_ext") && results.has("Tc_ext")) {
    const auto& r = results.get("Rc_ext", 9);
    camera.R = from_rows({r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]});
    const auto& t = results.get("Tc_ext", 3);
    camera.t = Vec3(t[0], t[1], t[2]);
  } else {
    if (!results.boards().contains(options.board)) results.fail_board(options.board, in_all_files);
    const auto& om = results.get(fmt::format("omc_{}", options.board), 3);
    const auto& t = results.get(fmt::format("Tc_{}", options.board), 3);
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
  std::vector<Results> all;
  std::set<int> in_all_files;
  for (const std::string& file : files) {
    const std::set<int> boards = all.emplace_back(Results{file, read_assignments(file)}).boards();
    if (all.size() == 1) in_all_files = boards;
    std::erase_if(in_all_files, [&](int board) { return !boards.contains(board); });
  }
  Rig rig;
  const std::vector<std::string> names = names_of(files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    rig.cameras.push_back(read_bouguet_camera(all[i], in_all_files, options));
    rig.cameras.back().name = names[i];
  }
  return finished(rig, files.front());
}

}  // namespace polyhull::import
