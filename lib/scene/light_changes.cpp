// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/light_changes.h"

#include <algorithm>
#include <charconv>
#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"

namespace polyhull {
namespace {

constexpr float most_given = 1e6f;
constexpr float most_radiance = 1e20f, most_away = 1e8f;
constexpr double far_away = 50.0;  // scene sizes: only suns are so far

Error not_understood(std::string_view what, const char* expected) {
  return Error(Error::Kind::bad_input,
               "The light changes are not understood at '{}': expected {}, as in 'lamp "
               "intensity=0.5 colour=1,0.8,0.6; 2 move=0,-0.2,0 turn=0,90,0 size=2'.",
               what, expected);
}

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/// A word of an entry.
struct Word {
  std::string text;
  bool quoted = false;
};

/// The next word of \p rest, which is left behind it; none at the entry's end.
std::optional<Word> next_word(std::string_view& rest) {
  while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
  if (rest.empty() || rest.front() == ';') return {};
  Word word;
  if (const char quote = rest.front(); quote == '"' || quote == '\'') {
    const std::size_t end = rest.find(quote, 1);
    if (end == rest.npos) throw not_understood(rest, "a quotation mark behind the name");
    word = {std::string(rest.substr(1, end - 1)), true};
    rest.remove_prefix(end + 1);
    return word;
  }
  std::size_t end = 0;
  while (end < rest.size() && !is_space(rest[end]) && rest[end] != ';') ++end;
  word.text = rest.substr(0, end);
  rest.remove_prefix(end);
  return word;
}

/// \p count numbers with commas between, each from \p least to \p most; none: they are not.
std::optional<Vec3f> numbers_of(std::string_view text, int count, float least, float most) {
  Vec3f out(0.0f);
  for (int k = 0; k < count; ++k) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out[k]);
    if (error != std::errc() || !(out[k] >= least && out[k] <= most)) return {};
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (k + 1 == count) break;
    if (text.empty() || text.front() != ',') return {};
    text.remove_prefix(1);
  }
  return text.empty() ? std::optional(out) : std::nullopt;
}

void take_setting(const std::string& word, LightChange& change) {
  const std::size_t equals = word.find('=');
  const std::string name = word.substr(0, equals);
  const std::string value = equals == word.npos ? "" : word.substr(equals + 1);
  const auto read = [&](int count, float least, float most, const char* expected) {
    const std::optional<Vec3f> numbers = numbers_of(value, count, least, most);
    if (!numbers) throw not_understood(word, expected);
    return *numbers;
  };
  if (name == "intensity")
    change.intensity *= read(1, 0.0f, most_given, "intensity=FACTOR from 0 to 1e6").x;
  else if (name == "colour")
    change.colour = read(3, 0.0f, most_given, "colour=RED,GREEN,BLUE, each from 0 to 1e6");
  else if (name == "move")
    change.move = read(3, -most_given, most_given, "move=X,Y,Z in metres, each from -1e6 to 1e6");
  else if (name == "turn")
    change.turn = read(3, -most_given, most_given, "turn=X,Y,Z in degrees, each from -1e6 to 1e6");
  else if (name == "size")
    change.size *= read(1, 0.001f, 1000.0f, "size=FACTOR from 0.001 to 1000").x;
  else
    throw not_understood(word, "one of intensity=, colour=, move=, turn= and size=");
}

/// About x, then y, then z.
Mat3 rotation_of(const Vec3f& degrees) {
  const Vec3 angles = glm::radians(Vec3(degrees));
  Mat4 turn = glm::rotate(Mat4(1.0), angles.z, Vec3(0, 0, 1));
  turn = glm::rotate(turn, angles.y, Vec3(0, 1, 0));
  return Mat3(glm::rotate(turn, angles.x, Vec3(1, 0, 0)));
}

void apply(const LightChange& change, const Bounds& bounds, Light& light) {
  if (change.colour)
    light.radiance =
        std::max({light.radiance.x, light.radiance.y, light.radiance.z}) * *change.colour;
  light.radiance *= change.intensity;
  if (light.is_area() && change.size != 1.0f) {
    light.u *= change.size;
    light.v *= change.size;
    light.radiance /= change.size * change.size;
  }
  if (change.turn != Vec3f(0.0f)) {
    const Mat3 turn = rotation_of(change.turn);
    const Vec3 middle = 0.5 * (bounds.min + bounds.max), way = Vec3(light.centre) - middle;
    if (glm::length(way) > far_away * glm::length(bounds.max - bounds.min))
      light.centre = Vec3f(middle + turn * way);
    light.u = Vec3f(turn * Vec3(light.u));
    light.v = Vec3f(turn * Vec3(light.v));
  }
  light.centre += change.move;
  // What several entries add up to can be drawn with (drawable.h), too.
  light.radiance = glm::min(light.radiance, Vec3f(most_radiance));
  for (Vec3f* v : {&light.centre, &light.u, &light.v})
    *v = glm::clamp(*v, Vec3f(-most_away), Vec3f(most_away));
}

/// Whether light \p index, called \p name, is meant.
bool is_meant(const LightChange& change, std::size_t index, const std::string& name) {
  if (change.light == name) return true;
  return !change.quoted && (change.light == "*" || change.light == std::to_string(index + 1));
}

}  // namespace

std::vector<LightChange> parse_light_changes(std::string_view text) {
  std::vector<LightChange> changes;
  while (!text.empty()) {
    if (const std::optional<Word> light = next_word(text)) {
      LightChange& change = changes.emplace_back();
      if (!light->quoted && light->text.find('=') != std::string::npos)
        throw not_understood(light->text, "a light's name or number first");
      change.light = light->text;
      change.quoted = light->quoted;
      while (const std::optional<Word> word = next_word(text)) take_setting(word->text, change);
    }
    if (!text.empty()) text.remove_prefix(1);  // the semicolon
  }
  return changes;
}

std::string change_lights(const std::vector<LightChange>& changes, const Bounds& bounds,
                          const std::string& scene, std::vector<Light>& lights) {
  std::string missing;
  for (const LightChange& change : changes) {
    bool found = false;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      if (!is_meant(change, i, lights[i].name)) continue;
      found = true;
      apply(change, bounds, lights[i]);
    }
    if (!found) missing += fmt::format("{}'{}'", missing.empty() ? "" : ", ", change.light);
  }
  if (missing.empty()) return {};
  constexpr std::size_t most_named = 20;
  std::string there;
  for (std::size_t i = 0; i < std::min(lights.size(), most_named); ++i)
    there += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i + 1, lights[i].name);
  if (lights.size() > most_named) there += fmt::format(" and {} more", lights.size() - most_named);
  return fmt::format("The scene '{}' has no light {}; it has {}.", scene, missing,
                     there.empty() ? "none" : there);
}

namespace {

/// Whether light \p i of \p scene is shown by a mesh that is not where \p light is.
bool is_elsewhere(const Scene& scene, std::size_t i, const Light& light) {
  const Light& own = scene.lights[i];
  return own.mesh >= 0 && own.mesh == light.mesh && own.is_area() && light.is_area() &&
         (own.centre != light.centre || own.u != light.u || own.v != light.v);
}

}  // namespace

bool lamps_differ(const Scene& scene, const std::vector<Light>& lights) {
  for (std::size_t i = 0; i < std::min(lights.size(), scene.lights.size()); ++i)
    if (is_elsewhere(scene, i, lights[i])) return true;
  return false;
}

void move_lamps(Scene& scene, const std::vector<Light>& lights) {
  for (std::size_t i = 0; i < std::min(lights.size(), scene.lights.size()); ++i) {
    if (!is_elsewhere(scene, i, lights[i])) continue;
    Light moved = lights[i];
    moved.radiance = scene.lights[i].radiance;
    set_light(scene, i, moved);
  }
}

}  // namespace polyhull
