// SPDX-License-Identifier: LGPL-2.1-or-later
// Importers of formats that are lines of numbers.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "base/error.h"
#include "base/picture.h"
#include "rig/file_names.h"
#include "rig/import.h"
#include "rig/projection_matrix.h"

namespace polyhull::import {
namespace {

struct Line {
  std::size_t number;
  std::vector<std::string> words;
};

std::vector<Line> read_lines(const std::string& file) {
  std::ifstream in(file);
  if (!in || std::filesystem::is_directory(file))
    throw Error(Error::Kind::not_found,
                "Cannot read '{}'; check that it exists, is a file and may be read.", file);
  std::vector<Line> lines;
  std::size_t number = 0;
  for (std::string text; std::getline(in, text);) {
    ++number;
    std::istringstream words(text.substr(0, text.find('#')));
    Line line{number, {}};
    for (std::string word; words >> word;) line.words.push_back(word);
    if (!line.words.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

bool is_number(const std::string& word) {
  char* end = nullptr;
  std::strtod(word.c_str(), &end);
  return end != word.c_str() && *end == '\0';
}

double number(const std::string& file, std::size_t line, const std::string& word) {
  if (!is_number(word)) fail_at(file, line, fmt::format("'{}' is not a number", word));
  const double value = std::strtod(word.c_str(), nullptr);
  if (!std::isfinite(value)) fail_at(file, line, fmt::format("'{}' is not finite", word));
  return value;
}

std::vector<double> numbers(const std::string& file, const Line& line, std::size_t first,
                            std::size_t count) {
  if (line.words.size() != first + count)
    fail_at(file, line.number,
            fmt::format("expected {} numbers, found {}", count,
                        line.words.size() - std::min(first, line.words.size())));
  std::vector<double> result;
  for (std::size_t i = first; i < line.words.size(); ++i)
    result.push_back(number(file, line.number, line.words[i]));
  return result;
}

Mat3 matrix_at(const std::vector<double>& values, std::size_t first) {
  std::array<double, 9> rows;
  std::copy_n(values.begin() + first, 9, rows.begin());
  return from_rows(rows);
}

Vec3 vector_at(const std::vector<double>& values, std::size_t first) {
  return {values[first], values[first + 1], values[first + 2]};
}

void set_picture_size(Camera& camera, const Options& options, const std::string& file,
                      const std::string& picture) {
  camera.width = options.width;
  camera.height = options.height;
  if (camera.width > 0) return;
  const std::filesystem::path path = std::filesystem::path(file).parent_path() / picture;
  if (picture.empty() || !std::filesystem::exists(path))
    throw Error(Error::Kind::bad_input,
                "{}: the pictures' size is not known; give it with --size WIDTHxHEIGHT.", file);
  const Picture found = load_picture(path.string());
  camera.width = found.width;
  camera.height = found.height;
}

// The rotation that the text meant; others are left for the rig's check to name.
Rig finish(Rig rig, const std::string& source) {
  return parse_rig(rig_to_json(rig), source);
}

std::string numbered(const Options& options, std::size_t index) {
  const std::size_t percent = options.name.find('%');
  std::size_t end = percent + 1;
  while (end < options.name.size() && std::isdigit(static_cast<unsigned char>(options.name[end])))
    ++end;
  if (percent == std::string::npos || end >= options.name.size() || options.name[end] != 'd' ||
      options.name.find('%', end) != std::string::npos || end - percent > 4)
    throw Error(Error::Kind::bad_input,
                "The name pattern '{}' needs exactly one %d, or one such as %03d.", options.name);
  char text[64];
  const std::string format = options.name.substr(percent, end - percent) + "d";
  std::snprintf(text, sizeof text, format.c_str(), options.first + static_cast<int>(index));
  return options.name.substr(0, percent) + text + options.name.substr(end + 1);
}

}  // namespace

std::vector<std::string> names_of(const std::vector<std::string>& files) {
  std::vector<std::string> stems, folders;
  for (const std::string& file : files) {
    const std::filesystem::path path = std::filesystem::absolute(file);
    stems.push_back(name_of_file(path.stem().string()));
    folders.push_back(path.parent_path().filename().string());
  }
  const bool all_same = std::set<std::string>(stems.begin(), stems.end()).size() == 1;
  return all_same && files.size() > 1 ? folders : stems;
}

Mat3 rotation_of(const Vec3& v) {
  const double angle = glm::length(v);
  if (angle == 0.0) return Mat3(1.0);
  const Vec3 k = v / angle;
  const Mat3 cross = from_rows({0, -k.z, k.y, k.z, 0, -k.x, -k.y, k.x, 0});
  return Mat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * (cross * cross);
}

Rig middlebury(const std::string& file, const Options& options) {
  const std::vector<Line> lines = read_lines(file);
  if (lines.empty() || lines[0].words.size() != 1 || !is_number(lines[0].words[0]))
    fail_at(file, 1, "a Middlebury file starts with the number of its cameras");
  Rig rig;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<double> values = numbers(file, lines[i], 1, 21);
    Camera& camera = rig.cameras.emplace_back();
    const std::string& picture = lines[i].words[0];
    camera.name = std::filesystem::path(picture).stem().string();
    set_picture_size(camera, options, file, picture);
    camera.K = matrix_at(values, 0);
    camera.R = matrix_at(values, 9);
    camera.t = vector_at(values, 18);
  }
  const double promised = number(file, lines[0].number, lines[0].words[0]);
  if (promised != static_cast<double>(rig.cameras.size()))
    fail_at(
        file, lines[0].number,
        fmt::format("it promises {} cameras and holds {}", lines[0].words[0], rig.cameras.size()));
  return finish(std::move(rig), file);
}

Rig projection_matrices(const std::vector<std::string>& files, const Options& options) {
  std::vector<ProjectionMatrix> matrices;
  std::vector<std::string> places;
  for (const std::string& file : files) {
    std::vector<double> row;
    for (const Line& line : read_lines(file)) {
      if (!is_number(line.words[0])) continue;  // CONTOUR and the like
      if (line.words.size() != 4 && line.words.size() != 12)
        fail_at(file, line.number,
                fmt::format("a projection matrix has 12 numbers on one line or 4 on each of three "
                            "lines; found {}",
                            line.words.size()));
      if (row.empty()) places.push_back(file + ", line " + std::to_string(line.number));
      for (const std::string& word : line.words) row.push_back(number(file, line.number, word));
      if (row.size() > 12) fail_at(file, line.number, "a projection matrix is cut short before it");
      if (row.size() < 12) continue;
      ProjectionMatrix& P = matrices.emplace_back();
      for (int i = 0; i < 12; ++i) P[i / 4][i % 4] = row[i];
      row.clear();
    }
    if (!row.empty())
      throw Error(
          Error::Kind::bad_input,
          "{}: the last projection matrix is not complete; a matrix has 12 numbers, three rows of "
          "four.",
          file);
  }
  const std::optional<Vec3> focus = common_focus(matrices);
  const std::vector<std::string> names = names_of(files);
  Rig rig;
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    Camera& camera = rig.cameras.emplace_back();
    camera.name =
        files.size() == matrices.size() && files.size() > 1 ? names[i] : numbered(options, i);
    set_picture_size(camera, options, files.front(), "");
    set_projection(camera, matrices[i], focus, places[i]);
  }
  return finish(std::move(rig), files.front());
}

Rig text(const std::string& file, const Options& options) {
  Rig rig;
  for (const Line& line : read_lines(file)) {
    const std::vector<double> values = numbers(file, line, 1, 26);
    Camera& camera = rig.cameras.emplace_back();
    camera.name = line.words[0];
    set_picture_size(camera, options, file, "");
    camera.K = matrix_at(values, 0);
    camera.distortion.assign(values.begin() + 9, values.begin() + 14);
    camera.R = matrix_at(values, 14);
    camera.t = vector_at(values, 23);
  }
  return finish(std::move(rig), file);
}

}  // namespace polyhull::import
