// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/scene_changes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"
#include "base/rotation.h"

namespace polyhull {
namespace {

constexpr float most_given = 1e6f;
constexpr float most_repeated = 1e12f;  // what words that stand there again and again come to
constexpr float least_side = 1e-6f;  // metres; of smaller lamps nothing tells which way they face
constexpr float most_radiance = 1e20f, most_away = 1e8f;
constexpr std::size_t longest_text = 4096;  // as an announcement's names
constexpr double far_away = 50.0;           // scene sizes: only suns are so far

Error not_understood(std::string_view what, const char* expected) {
  return Error(Error::Kind::bad_input,
               "Changes of a scene are not understood at '{}': expected {}, as in 'lamp "
               "move=0,-0.2,0 turn=0,90,0; \"key light\" move=1,0,0'.",
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

/// NAME=VALUE in an entry.
struct Setting {
  const std::string& word;
  std::string name, value;

  explicit Setting(const std::string& text) : word(text) {
    const std::size_t equals = text.find('=');
    name = text.substr(0, equals);
    if (equals != text.npos) value = text.substr(equals + 1);
  }
  Vec3f numbers(int count, float least, float most, const char* expected) const {
    const std::optional<Vec3f> read = numbers_of(value, count, least, most);
    if (!read) throw not_understood(word, expected);
    return *read;
  }
  /// What lights and nodes have alike; false: it is something else.
  bool take_motion(Vec3f& move, Vec3f& turn) const {
    if (name == "move")
      move = numbers(3, -most_given, most_given, "move=X,Y,Z in metres, each from -1e6 to 1e6");
    else if (name == "turn")
      turn = numbers(3, -most_given, most_given, "turn=X,Y,Z in degrees, each from -1e6 to 1e6");
    else
      return false;
    return true;
  }
};

void take(const Setting& setting, LightChange& change) {
  if (setting.take_motion(change.move, change.turn)) return;
  if (setting.name == "intensity")
    change.intensity = std::min(
        change.intensity * setting.numbers(1, 0.0f, most_given, "intensity=FACTOR from 0 to 1e6").x,
        most_repeated);
  else if (setting.name == "colour")
    change.colour =
        setting.numbers(3, 0.0f, most_given, "colour=RED,GREEN,BLUE, each from 0 to 1e6");
  else if (setting.name == "size")
    change.size = std::clamp(
        change.size * setting.numbers(1, 0.001f, 1000.0f, "size=FACTOR from 0.001 to 1000").x,
        1.0f / most_repeated, most_repeated);
  else
    throw not_understood(setting.word, "one of intensity=, colour=, move=, turn= and size=");
}

void take(const Setting& setting, NodeChange& change) {
  if (setting.take_motion(change.move, change.turn)) return;
  if (setting.name == "scale") {
    change.scale = std::clamp(
        change.scale * setting.numbers(1, 0.001f, 1000.0f, "scale=FACTOR from 0.001 to 1000").x,
        0.001f, 1000.0f);
  } else if (setting.name == "visible") {
    change.visible = setting.value == "yes" || setting.value == "true";
    if (!*change.visible && setting.value != "no" && setting.value != "false")
      throw not_understood(setting.word, "visible=yes or visible=no");
  } else {
    throw not_understood(setting.word, "one of move=, turn=, scale= and visible=");
  }
}

/// The entries of \p text: who is meant goes to name(), which gives what the settings go to.
template <class Name>
void read_entries(std::string_view text, const Name& name) {
  if (text.size() > longest_text) throw not_understood(text.substr(0, 40), "at most 4096 bytes");
  while (!text.empty()) {
    if (const std::optional<Word> who = next_word(text)) {
      if (!who->quoted && who->text.find('=') != std::string::npos)
        throw not_understood(who->text, "a name first");
      auto& change = name(*who);
      while (const std::optional<Word> word = next_word(text)) take(Setting(word->text), change);
    }
    if (!text.empty()) text.remove_prefix(1);  // the semicolon
  }
}

/// "no light 'a', 'b'; it has 1 'c', 2 'd'".
std::string missing_words(const std::string& scene, const char* kind, const std::string& missing,
                          const std::vector<std::string>& there, bool numbered) {
  constexpr std::size_t most_named = 20;
  std::string list;
  for (std::size_t i = 0; i < std::min(there.size(), most_named); ++i) {
    list += i == 0 ? "" : ", ";
    list += numbered ? fmt::format("{} '{}'", i + 1, there[i]) : fmt::format("'{}'", there[i]);
  }
  if (there.size() > most_named) list += fmt::format(" and {} more", there.size() - most_named);
  return fmt::format("The scene '{}' has no {} {}; it has {}.", scene, kind, missing,
                     list.empty() ? "none" : list);
}

Vec3 middle_of(const Bounds& bounds) {
  return 0.5 * (bounds.min + bounds.max);
}

bool is_sun(const Light& light, const Bounds& bounds) {
  return glm::distance(Vec3(light.centre), middle_of(bounds)) >
         far_away * glm::length(bounds.max - bounds.min);
}

/// \p point turned about the middle of \p bounds.
Vec3f around(const Mat3& turn, const Bounds& bounds, const Vec3f& point) {
  const Vec3 middle = middle_of(bounds);
  return Vec3f(middle + turn * (Vec3(point) - middle));
}

/// What several entries add up to can be drawn with (drawable.h), too.
void hold(Light& light) {
  light.radiance = glm::min(light.radiance, Vec3f(most_radiance));
  for (Vec3f* v : {&light.centre, &light.u, &light.v})
    *v = glm::clamp(*v, Vec3f(-most_away), Vec3f(most_away));
}

void apply(const LightChange& change, const Bounds& bounds, Light& light) {
  if (change.colour)
    light.radiance =
        std::max({light.radiance.x, light.radiance.y, light.radiance.z}) * *change.colour;
  light.radiance *= change.intensity;
  if (light.is_area() && change.size != 1.0f) {
    const float sides = std::min(glm::length(light.u), glm::length(light.v));
    const float size = std::max(change.size, std::min(least_side / sides, 1.0f));
    light.u *= size;
    light.v *= size;
    light.radiance /= size * size;
  }
  if (change.turn != Vec3f(0.0f)) {
    const Mat3 turn(rotation_of(change.turn));
    if (is_sun(light, bounds)) light.centre = around(turn, bounds, light.centre);
    light.u = Vec3f(turn * Vec3(light.u));
    light.v = Vec3f(turn * Vec3(light.v));
  }
  light.centre += change.move;
  hold(light);
}

/// Whether light \p index, called \p name, is meant.
bool is_meant(const LightChange& change, std::size_t index, const std::string& name) {
  if (change.light == name) return true;
  return !change.quoted && (change.light == "*" || change.light == std::to_string(index + 1));
}

}  // namespace

std::vector<LightChange> parse_light_changes(std::string_view text) {
  std::vector<LightChange> changes;
  read_entries(text, [&](const Word& who) -> LightChange& {
    LightChange& change = changes.emplace_back();
    change.light = who.text;
    change.quoted = who.quoted;
    return change;
  });
  return changes;
}

std::vector<NodeChange> parse_node_changes(std::string_view text) {
  std::vector<NodeChange> changes;
  read_entries(text, [&](const Word& who) -> NodeChange& {
    changes.emplace_back().node = who.text;
    return changes.back();
  });
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
  std::vector<std::string> there;
  for (const Light& light : lights) there.push_back(light.name);
  return missing_words(scene, "light", missing, there, true);
}

namespace {

/// What becomes of a node and all below it.
struct Pose {
  Mat4 moved{1.0};  // from where the file has it, scene coordinates
  bool visible = true;
};

void name_nodes(Scene& scene) {
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    scene.meshes[m].node = static_cast<int>(m);
    scene.nodes.push_back({scene.meshes[m].name, -1, Vec3f(0.0f)});
  }
  for (Light& light : scene.lights)
    if (light.mesh >= 0) light.node = light.mesh;
}

/// Of each node; parents come before their children.
std::vector<Pose> poses_of(const std::vector<NodeChange>& changes,
                           const std::vector<SceneNode>& nodes) {
  std::vector<Pose> poses(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    Pose& pose = poses[n];
    if (nodes[n].parent >= 0) pose = poses[static_cast<std::size_t>(nodes[n].parent)];
    const Vec3 origin(nodes[n].origin);
    Vec3 move(0.0);
    Mat3 turned(1.0);
    bool visible = true;
    for (const NodeChange& change : changes) {
      if (change.node != nodes[n].name || change.node.empty()) continue;
      move += Vec3(change.move);
      turned = static_cast<double>(change.scale) * Mat3(rotation_of(change.turn)) * turned;
      visible = change.visible.value_or(visible);
    }
    pose.visible = pose.visible && visible;
    if (move == Vec3(0.0) && turned == Mat3(1.0)) continue;
    pose.moved = pose.moved * glm::translate(Mat4(1.0), origin + move) * Mat4(turned);
    pose.moved = glm::translate(pose.moved, -origin);
  }
  return poses;
}

void carry(const Mat4& moved, SceneMesh& mesh) {
  const Mat3 normals = glm::transpose(glm::inverse(Mat3(moved)));
  for (Vec3f& p : mesh.positions) p = Vec3f(moved * Vec4(Vec3(p), 1.0));
  for (Vec3f& n : mesh.normals) n = Vec3f(glm::normalize(normals * Vec3(n)));
}

/// A lamp that a mesh shows grows with it; another one keeps its power. A sun keeps its distance.
void carry(const Mat4& moved, const Bounds& bounds, Light& light) {
  Mat3 turned(moved);
  if (is_sun(light, bounds)) {
    turned /= std::cbrt(glm::determinant(turned));
    light.centre = around(turned, bounds, light.centre);
  } else {
    light.centre = Vec3f(moved * Vec4(Vec3(light.centre), 1.0));
  }
  const float area = glm::length(glm::cross(light.u, light.v));
  light.u = Vec3f(turned * Vec3(light.u));
  light.v = Vec3f(turned * Vec3(light.v));
  const float now = glm::length(glm::cross(light.u, light.v));
  if (light.mesh < 0 && area > 0.0f && now > 0.0f) light.radiance *= area / now;
  hold(light);
}

/// Throws Error where \p scene is no longer to be drawn.
void check_reach(const Scene& scene) {
  const auto within = [](const Vec3f& p) {
    return glm::all(glm::lessThanEqual(glm::abs(p), Vec3f(most_given)));
  };
  const auto whole = [&](const Vec3f& direction) { return glm::dot(direction, direction) < 2.0f; };
  for (const SceneMesh& mesh : scene.meshes)
    if (!std::all_of(mesh.positions.begin(), mesh.positions.end(), within) ||
        !std::all_of(mesh.normals.begin(), mesh.normals.end(), whole))
      throw Error(
          Error::Kind::bad_input,
          "The nodes of the scene '{}' are moved or scaled so that '{}' reaches beyond 1e6 m or "
          "shrinks to nothing; expected smaller changes.",
          scene.name, mesh.name);
}

/// Takes the meshes of nodes that are not visible out, and the light from their lights.
void hide(const std::vector<Pose>& poses, Scene& scene) {
  const auto is_hidden = [&](int node) {
    return node >= 0 && !poses[static_cast<std::size_t>(node)].visible;
  };
  std::vector<int> number(scene.meshes.size(), -1);
  std::vector<SceneMesh> left;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    if (is_hidden(scene.meshes[m].node)) continue;
    number[m] = static_cast<int>(left.size());
    left.push_back(std::move(scene.meshes[m]));
  }
  scene.meshes = std::move(left);
  for (Light& light : scene.lights) {
    if (light.mesh >= 0) light.mesh = number[static_cast<std::size_t>(light.mesh)];
    if (is_hidden(light.node)) light.radiance = Vec3f(0.0f);
  }
}

}  // namespace

std::string change_nodes(const std::vector<NodeChange>& changes, Scene& scene) {
  if (changes.empty()) return {};
  if (scene.nodes.empty()) name_nodes(scene);
  const std::vector<Pose> poses = poses_of(changes, scene.nodes);
  const Bounds bounds = scene_bounds(scene);
  for (SceneMesh& mesh : scene.meshes)
    if (mesh.node >= 0 && poses[static_cast<std::size_t>(mesh.node)].moved != Mat4(1.0))
      carry(poses[static_cast<std::size_t>(mesh.node)].moved, mesh);
  for (Light& light : scene.lights)
    if (light.node >= 0 && poses[static_cast<std::size_t>(light.node)].moved != Mat4(1.0))
      carry(poses[static_cast<std::size_t>(light.node)].moved, bounds, light);
  hide(poses, scene);
  scene.mirrors = find_mirrors(scene);
  check_reach(scene);
  scene_bounds(scene);  // throws where nothing is left
  std::string missing;
  std::vector<std::string> there;
  for (const SceneNode& node : scene.nodes)
    if (!node.name.empty()) there.push_back(node.name);
  for (const NodeChange& change : changes)
    if (std::find(there.begin(), there.end(), change.node) == there.end())
      missing += fmt::format("{}'{}'", missing.empty() ? "" : ", ", change.node);
  return missing.empty() ? "" : missing_words(scene.name, "node", missing, there, false);
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
