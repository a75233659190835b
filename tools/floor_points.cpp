// SPDX-License-Identifier: LGPL-2.1-or-later
#include "floor_points.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "rig/floor.h"
#include "text_file.h"

namespace polyhull {
namespace {

constexpr const char* blanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

// What is before the last word of \p text, and that as a number; nothing: it is none.
std::optional<std::pair<std::string_view, double>> last_number(std::string_view text) {
  text = trimmed(text);
  const std::size_t blank = text.find_last_of(blanks);
  std::istringstream word{std::string(text.substr(blank + 1))};
  double value = 0.0;
  if (!(word >> value) || word.peek() != std::istringstream::traits_type::eof()) return {};
  return std::pair(trimmed(text.substr(0, blank + 1)), value);
}

// The camera whose name, which may have blanks, ends \p text behind a blank.
const Camera* camera_at_end(const Rig& rig, std::string_view text) {
  const Camera* found = nullptr;
  for (const Camera& camera : rig.cameras)
    if (text.ends_with(camera.name) && text.size() > camera.name.size() + 1 &&
        std::string_view(blanks).find(text[text.size() - camera.name.size() - 1]) !=
            std::string_view::npos &&
        (!found || found->name.size() < camera.name.size()))
      found = &camera;
  return found;
}

}  // namespace

std::vector<Vec3> read_floor_points(const std::string& path, const Rig& rig) {
  std::istringstream in(read_text(path));
  std::vector<std::pair<std::string, std::vector<std::pair<std::size_t, Vec2>>>> points;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    for (std::size_t i = 0; i < line.size(); ++i)
      if (line[i] == '#' &&
          (i == 0 || std::string_view(blanks).find(line[i - 1]) != std::string_view::npos))
        line.resize(i);
    if (trimmed(line).empty()) continue;
    const auto v = last_number(line), u = v ? last_number(v->first) : v;
    const std::string_view names = u ? u->first : "";
    const std::size_t blank = names.find_first_of(blanks);
    if (blank == names.npos)
      throw Error(Error::Kind::bad_input, "'{}', line {}: expected POINT CAMERA U V.", path,
                  number);
    const Camera* found = camera_at_end(rig, names);
    if (!found)
      throw Error(Error::Kind::bad_input, "'{}', line {}: there is no camera '{}'.", path, number,
                  trimmed(names.substr(blank)));
    const std::string point(trimmed(names.substr(0, names.size() - found->name.size())));
    const Vec2 pixel(u->second, v->second);
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
