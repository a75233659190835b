// SPDX-License-Identifier: LGPL-2.1-or-later
// Importers of formats that are lines of numbers.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/error.h"
#include "base/picture.h"
#include "rig/import.h"
#include "rig/import/lines.h"
#include "rig/projection_matrix.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

double number(const std::string& file, std::size_t line, const std::string& word) {
  const std::optional<double> value = number_of(word);
  if (!value) fail_at(file, line, fmt::format("'{}' is not a number", word));
  if (!std::isfinite(*value)) fail_at(file, line, fmt::format("'{}' is not finite", word));
  return *value;
}

// The last \p count words of \p row, which a name stands before, of any number of words.
std::vector<double> numbers(const std::string& file, const Row& row, std::size_t count) {
  if (row.words.size() <= count)
    fail_at(file, row.number,
            fmt::format("expected {} numbers, found {}", count, row.words.size() - 1));
  std::vector<double> result;
  for (std::size_t i = row.words.size() - count; i < row.words.size(); ++i)
    result.push_back(number(file, row.number, row.words[i]));
  return result;
}

std::string name_before(const std::string& file, const Row& row, std::size_t count) {
  const std::size_t words = row.words.size() - count;
  if (words > 1 && number_of(row.words[0]))
    fail_at(
        file, row.number,
        fmt::format("expected a name and {} numbers, found {} numbers", count, row.words.size()));
  std::string name = row.words[0];
  for (std::size_t i = 1; i < words; ++i) name += ' ' + row.words[i];
  return name;
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

bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
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

// The innermost lists of \p text, where lists stand within lists and hold all numbers, as in JSON and
// numpy's; none: they do not.
std::vector<Row> rows_of_lists(const std::string& text) {
  std::vector<Row> rows;
  std::string beside;
  std::size_t depth = 0, deepest = 0, line = 1, begin = text.npos;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '[') {
      deepest = std::max(deepest, ++depth);
      begin = i + 1;
    } else if (text[i] == ']') {
      if (begin != text.npos) {
        std::string list = text.substr(begin, i - begin);
        std::ranges::replace(list, '\n', ' ');
        for (Row& row : rows_of(list)) rows.push_back({line, std::move(row.words)});
      }
      begin = text.npos;
      depth -= depth > 0;
    } else if (depth == 0) {
      beside += text[i];
    }
    line += text[i] == '\n';
  }
  if (deepest < 2 || std::ranges::any_of(rows_of(beside), [](const Row& row) {
        return std::ranges::count_if(row.words, [](auto& word) { return !!number_of(word); }) > 2;
      }))
    return {};
  return rows;
}

// The lines of \p file without what Matlab, numpy and Blender write around numbers: P1 = [ … ];,
// array([[ … ]]), <Matrix 3x4 ( … )> and … at a line's end.
std::vector<Row> matrix_rows(const std::string& file) {
  const std::string text = read_text(file);
  if (auto rows = rows_of_lists(text); !rows.empty()) return rows;
  std::string plain;
  for (const Line& line : lines_of(text)) {
    std::string content(line.text);
    if (!content.starts_with('#') && !content.starts_with('%')) {
      content.erase(0, content.rfind('=') + 1);
      // A name before the numbers' bracket.
      if (const std::size_t open = content.find('(');
          open != content.npos && std::any_of(content.begin(), content.begin() + open, is_letter))
        content.erase(0, open);
    }
    for (const char bracket : {'[', ']', '{', '}', '(', ')', '<', '>', '|'})
      std::ranges::replace(content, bracket, ' ');
    if (content.ends_with("...")) content.resize(content.size() - 3);
    plain += content + '\n';
  }
  return rows_of(plain);
}

// CONTOUR, Camera 2, and the like.
bool is_heading(const Row& row) {
  return !number_of(row.words[0]) &&
         std::ranges::count_if(row.words, [](const auto& word) { return !!number_of(word); }) < 3;
}

bool names_columns(const Row& row) {
  return std::ranges::none_of(row.words, [](const auto& word) { return !!number_of(word); });
}

struct FoundMatrix {
  ProjectionMatrix P;
  std::string name, place;
};

// The numbers of \p row, of a 4x4 matrix without its last row; none: they are that row. A name before
// twelve goes to \p name.
std::vector<double> numbers_of_matrix(const std::string& file, Row row, std::string& name) {
  if (row.words.size() == 13 && !number_of(row.words[0])) {
    name = row.words[0];
    if (name.ends_with(':')) name.pop_back();  // KITTI's
    row.words.erase(row.words.begin());
  }
  if (row.words.size() == 2 && row.words[1] == "*")
    fail_at(file, row.number,
            "Matlab shows a matrix here, divided by a number and in few digits; write it by "
            "writematrix(P, 'P.txt') or disp(mat2str(P))");
  std::vector<double> found;
  for (const std::string& word : row.words) found.push_back(number(file, row.number, word));
  const auto ends = [&](std::size_t count) {  // as such a matrix, which may be multiplied
    return found.size() == count && found[count - 1] > 0.0 &&
           std::all_of(found.end() - 4, found.end() - 1, [](double v) { return v == 0.0; });
  };
  if (ends(16)) found.resize(12);
  if (ends(4)) found.clear();
  return found;
}

std::vector<FoundMatrix> matrices_in(const std::string& file) {
  std::vector<FoundMatrix> matrices;
  std::vector<double> values;
  const auto fail_cut = [&](const Row& row) {
    fail_at(file, row.number, "a projection matrix is cut short before it");
  };
  for (const Row& row : matrix_rows(file)) {
    if (is_heading(row)) {
      if (!values.empty()) fail_cut(row);
      continue;
    }
    std::string name;
    const std::vector<double> found = numbers_of_matrix(file, row, name);
    if (found.empty()) {
      if (!values.empty()) fail_cut(row);
      continue;
    }
    if (found.size() != 4 && found.size() != 12)
      fail_at(file, row.number,
              fmt::format("a projection matrix has 12 numbers on one line or 4 on each of three "
                          "lines; found {}",
                          found.size()));
    if (values.empty())
      matrices.push_back({{}, name, file + ", line " + std::to_string(row.number)});
    values.insert(values.end(), found.begin(), found.end());
    if (values.size() > 12) fail_cut(row);
    if (values.size() < 12) continue;
    for (int i = 0; i < 12; ++i) matrices.back().P[i / 4][i % 4] = values[i];
    values.clear();
  }
  if (!values.empty())
    throw Error(
        Error::Kind::bad_input,
        "{}: the last projection matrix is not complete; a matrix has 12 numbers, three rows of "
        "four.",
        file);
  return matrices;
}

/// Leaves KITTI's Tr: beside cameras out of \p matrices: it is the pose of the lidar.
void drop_lidar(std::vector<FoundMatrix>& matrices, const Options& options) {
  const auto is_lidar = [](const FoundMatrix& found) { return found.name == "Tr"; };
  if (std::ranges::all_of(matrices, is_lidar)) return;
  for (const FoundMatrix& found : matrices)
    if (is_lidar(found))
      options.note(found.place + ": Tr is left out, as the lidar's pose and no camera.");
  std::erase_if(matrices, is_lidar);
}

}  // namespace

std::vector<std::string> names_of(const std::vector<std::string>& files) {
  std::vector<std::string> paths;
  for (const std::string& file : files) paths.push_back(std::filesystem::absolute(file).string());
  return distinct_names(paths);
}

Rig finished(const Rig& rig, const std::string& source) {
  constexpr double least = 0.02;  // of the picture's width: a view of 175 degrees
  const Rig result = parse_rig(rig_to_json(rig), source);
  for (const Camera& camera : result.cameras)
    if (camera.K[0][0] < least * camera.width)
      throw Error(
          Error::Kind::bad_input,
          "{}: the focal length of '{}' is {:.3g} px, and its pictures are {} px wide, which "
          "is no lens's. K or P is probably for pictures of width 1: multiply its first row by "
          "the width, the second by the height.",
          source, camera.name, camera.K[0][0], camera.width);
  return result;
}

Mat3 rotation_of(const Vec3& v) {
  const double angle = glm::length(v);
  if (angle == 0.0) return Mat3(1.0);
  const Vec3 k = v / angle;
  const Mat3 cross = from_rows({0, -k.z, k.y, k.z, 0, -k.x, -k.y, k.x, 0});
  return Mat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * (cross * cross);
}

Rig middlebury(const std::string& file, const Options& options) {
  const std::vector<Row> rows = rows_of(read_text(file));
  if (rows.empty() || rows[0].words.size() != 1 || !number_of(rows[0].words[0]))
    fail_at(file, rows.empty() ? 1 : rows[0].number,
            "a Middlebury file starts with the number of its cameras");
  Rig rig;
  std::vector<std::string> pictures;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const std::vector<double> values = numbers(file, rows[i], 21);
    Camera& camera = rig.cameras.emplace_back();
    pictures.push_back(name_before(file, rows[i], 21));
    set_picture_size(camera, options, file, pictures.back());
    camera.K = matrix_at(values, 0);
    camera.R = matrix_at(values, 9);
    camera.t = vector_at(values, 18);
  }
  const std::vector<std::string> names = distinct_names(pictures);
  for (std::size_t i = 0; i < names.size(); ++i) rig.cameras[i].name = names[i];
  const double promised = number(file, rows[0].number, rows[0].words[0]);
  if (promised != static_cast<double>(rig.cameras.size()))
    fail_at(
        file, rows[0].number,
        fmt::format("it promises {} cameras and holds {}", rows[0].words[0], rig.cameras.size()));
  return finished(rig, file);
}

Rig projection_matrices(const std::vector<std::string>& files, const Options& options) {
  std::vector<FoundMatrix> matrices;
  for (const std::string& file : files)
    for (FoundMatrix& found : matrices_in(file)) matrices.push_back(std::move(found));
  drop_lidar(matrices, options);
  if (matrices.empty())
    throw Error(Error::Kind::bad_input,
                "{}: no line of it holds the 12 numbers of a projection matrix, or 4 of them.",
                files.front());
  std::vector<ProjectionMatrix> all;
  for (const FoundMatrix& found : matrices) all.push_back(found.P);
  const std::optional<Vec3> focus = common_focus(all);
  const std::vector<std::string> names = names_of(files);
  const bool one_each = files.size() == matrices.size() && files.size() > 1;
  Rig rig;
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    const FoundMatrix& found = matrices[i];
    Camera& camera = rig.cameras.emplace_back();
    camera.name = !found.name.empty() ? found.name : one_each ? names[i] : numbered(options, i);
    set_picture_size(camera, options, files.front(), "");
    set_projection(camera, found.P, focus, found.place);
  }
  return finished(rig, files.front());
}

Rig text(const std::string& file, const Options& options) {
  Rig rig;
  for (const Row& row : rows_of(read_text(file))) {
    if (rig.cameras.empty() && row.words.size() > 26 && names_columns(row)) continue;
    const std::vector<double> values = numbers(file, row, 26);
    Camera& camera = rig.cameras.emplace_back();
    camera.name = name_before(file, row, 26);
    set_picture_size(camera, options, file, "");
    camera.K = matrix_at(values, 0);
    camera.distortion.assign(values.begin() + 9, values.begin() + 14);
    camera.R = matrix_at(values, 14);
    camera.t = vector_at(values, 23);
  }
  return finished(rig, file);
}

}  // namespace polyhull::import
