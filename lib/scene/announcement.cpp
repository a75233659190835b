// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/announcement.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/rotation.h"
#include "scene/announcement_json.h"
#include "scene/drawable.h"

namespace polyhull {
namespace {

using nlohmann::json;

constexpr const char* format = "polyhull-announcement";
constexpr int version = 1;

Error broken(const std::string& what) {
  return Error(Error::Kind::bad_input, "A background's announcement cannot be used: {}.", what);
}

json numbers(const Vec3f& v) {
  return json::array({v.x, v.y, v.z});
}

constexpr int largest_side = 32768;  // pixels
constexpr std::size_t most_lights = 1024;
constexpr std::size_t longest_name = 4096;  // bytes

/// Many values end up as float.
double finite_number(const json& value, const char* name) {
  if (!value.is_number() || !(std::abs(value.get<double>()) < 1e30))
    throw broken(fmt::format("'{}' must hold finite numbers", name));
  return value.get<double>();
}

const json& member(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) throw broken(fmt::format("'{}' is missing", name));
  return *found;
}

template <std::size_t count>
std::array<double, count> array_of(const json& object, const char* name) {
  const json& value = member(object, name);
  if (!value.is_array() || value.size() != count) {
    throw broken(fmt::format("'{}' must be an array of {} numbers", name, count));
  }
  std::array<double, count> numbers;
  for (std::size_t i = 0; i < count; ++i) numbers[i] = finite_number(value[i], name);
  return numbers;
}

Vec3f vector_of(const json& object, const char* name) {
  const auto v = array_of<3>(object, name);
  return Vec3f(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
}

/// Metres; 0 where there is none.
double length_of(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) return 0.0;
  const double length = finite_number(*found, name);
  if (length < 0.0) throw broken(fmt::format("'{}' must not be below 0", name));
  return length;
}

std::string name_of(const json& value, const char* name) {
  std::string text = value.get<std::string>();
  if (text.size() > longest_name)
    throw broken(fmt::format("'{}' must have at most {} bytes", name, longest_name));
  return text;
}

int side_of(const json& object, const char* name) {
  const double pixels = finite_number(member(object, name), name);
  if (!(pixels >= 1.0 && pixels <= largest_side))
    throw broken(
        fmt::format("the viewport's '{}' must be from 1 to {} pixels", name, largest_side));
  return static_cast<int>(pixels);
}

/// 0 where there is none.
int count_of(const json& root, const char* name) {
  const double count = finite_number(root.value(name, json(0)), name);
  if (count != std::floor(count) || count < 0.0 || count > INT_MAX)
    throw broken(fmt::format("'{}' must be a whole number from 0 on", name));
  return static_cast<int>(count);
}

/// Empty where there is none.
EnvironmentFile environment_of(const json& root) {
  EnvironmentFile out;
  const auto found = root.find("environment");
  if (found == root.end()) return out;
  if (!found->is_object()) throw broken("'environment' must be an object");
  out.name = name_of(member(*found, "name"), "name");
  out.version = count_of(*found, "version");
  out.turn = finite_number(found->value("turn", json(0)), "turn");
  return out;
}

/// The mesh that shines; -1 where there is none.
int mesh_of(const json& light) {
  const double mesh = finite_number(light.value("mesh", json(-1)), "mesh");
  if (mesh != std::floor(mesh) || mesh < -1.0 || mesh > INT_MAX)
    throw broken("a light's 'mesh' must be a whole number from -1 on");
  return static_cast<int>(mesh);
}

/// Other programs may have computed it in single precision.
void check_rotation(const Mat3& R) {
  if (!(rotation_error(R) < 1e-5)) throw broken("'R' of the viewport is not a rotation");
}

json camera_to_json(const Camera& camera) {
  json out = {{"name", camera.name},     {"width", camera.width},
              {"height", camera.height}, {"K", to_rows(camera.K)},
              {"R", to_rows(camera.R)},  {"t", {camera.t.x, camera.t.y, camera.t.z}}};
  if (!camera.distortion.empty()) out["distortion"] = camera.distortion;
  return out;
}

Camera camera_from_json(const json& object) {
  if (!object.is_object()) throw broken("'viewport' must be an object");
  Camera camera;
  camera.name = name_of(object.value("name", json("viewport")), "name");
  camera.width = side_of(object, "width");
  camera.height = side_of(object, "height");
  camera.K = from_rows(array_of<9>(object, "K"));
  camera.R = from_rows(array_of<9>(object, "R"));
  check_rotation(camera.R);
  const auto t = array_of<3>(object, "t");
  camera.t = Vec3(t[0], t[1], t[2]);
  check_viewport(camera);
  check_projection(camera);
  if (const auto found = object.find("distortion"); found != object.end()) {
    const std::size_t count = found->is_array() ? found->size() : 1;
    if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12)
      throw broken("'distortion' must be a list of 4, 5, 8 or 12 numbers");
    for (const json& k : *found) camera.distortion.push_back(finite_number(k, "distortion"));
  }
  return camera;
}

}  // namespace

std::string announcement_to_json(const Announcement& announcement) {
  json lights = json::array();
  for (std::size_t i = 0; i < announcement.lights.size(); ++i) {
    const Light& light = announcement.lights[i];
    lights.push_back({{"name", light.name},
                      {"centre", numbers(light.centre)},
                      {"u", numbers(light.u)},
                      {"v", numbers(light.v)},
                      {"radiance", numbers(light.radiance)},
                      {"mesh", light.mesh}});
    if (light.outer_cone > 0.0f) lights.back()["cone"] = {light.inner_cone, light.outer_cone};
    if (i < announcement.undimmed.size())
      lights.back()["undimmed"] = numbers(announcement.undimmed[i].radiance);
  }
  json out = {{"format", format},
              {"version", version},
              {"viewport", camera_to_json(announcement.viewport)},
              {"scene", announcement.scene},
              {"lights", lights},
              {"exposure", announcement.exposure},
              {"ambient", numbers(announcement.ambient)}};
  if (announcement.scene_version > 0) out["scene_version"] = announcement.scene_version;
  if (!announcement.pose.nodes.empty()) out["nodes"] = announcement.pose.nodes;
  if (announcement.pose.animation > 0) {
    out["animation"] = announcement.pose.animation;
    out["animation_time"] = announcement.pose.animation_time;
  }
  if (const EnvironmentFile& around = announcement.environment; !around.name.empty())
    out["environment"] = {
        {"name", around.name}, {"version", around.version}, {"turn", around.turn}};
  if (announcement.sky != Vec3f(0.0f)) out["sky"] = numbers(announcement.sky);
  if (announcement.undimmed_sky) out["undimmed_sky"] = numbers(*announcement.undimmed_sky);
  if (announcement.aperture > 0.0) out["aperture"] = announcement.aperture;
  if (announcement.focus_distance > 0.0) out["focus-distance"] = announcement.focus_distance;
  if (announcement.depth_near > 0.0) out["depth_near"] = announcement.depth_near;
  // Names may hold any bytes; JSON must be UTF-8.
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

Announcement parse_announcement(std::string_view text) {
  return announcement_of(parse_json<json>(text, "announcement of the scene"));
}

Announcement announcement_of(const json& root) {
  if (!root.is_object() || root.value("format", json()) != format)
    throw broken("it is not JSON of the format 'polyhull-announcement'");
  if (root.value("version", json()) != version) throw broken("this program reads version 1 only");
  try {
    Announcement announcement;
    announcement.viewport = camera_from_json(member(root, "viewport"));
    announcement.scene = name_of(member(root, "scene"), "scene");
    announcement.scene_version = count_of(root, "scene_version");
    announcement.pose.nodes = name_of(root.value("nodes", json("")), "nodes");
    announcement.pose.animation = count_of(root, "animation");
    if (announcement.pose.animation > 0)
      announcement.pose.animation_time =
          finite_number(root.value("animation_time", json(0)), "animation_time");
    announcement.environment = environment_of(root);
    const json& lights = member(root, "lights");
    if (!lights.is_array() || lights.size() > most_lights)
      throw broken(fmt::format("'lights' must be a list of at most {}", most_lights));
    bool dimmed = false;  // any of them
    for (const json& object : lights) {
      if (!object.is_object()) throw broken("each light must be an object");
      Light light;
      light.name = name_of(object.value("name", json("")), "name");
      light.centre = vector_of(object, "centre");
      light.u = vector_of(object, "u");
      light.v = vector_of(object, "v");
      light.radiance = vector_of(object, "radiance");
      light.mesh = mesh_of(object);
      if (object.contains("cone")) {
        const auto cone = array_of<2>(object, "cone");
        light.inner_cone = static_cast<float>(cone[0]);
        light.outer_cone = static_cast<float>(cone[1]);
      }
      announcement.lights.push_back(light);
      if (object.contains("undimmed")) {
        light.radiance = vector_of(object, "undimmed");
        dimmed = true;
      }
      announcement.undimmed.push_back(std::move(light));
    }
    if (!dimmed) announcement.undimmed.clear();
    if (root.contains("undimmed_sky")) announcement.undimmed_sky = vector_of(root, "undimmed_sky");
    announcement.exposure = static_cast<float>(finite_number(member(root, "exposure"), "exposure"));
    announcement.ambient = vector_of(root, "ambient");
    if (root.contains("sky")) announcement.sky = vector_of(root, "sky");
    check_light(announcement.lights, announcement.exposure, announcement.ambient, announcement.sky);
    check_light(announcement.undimmed, announcement.exposure, announcement.ambient,
                announcement.undimmed_sky.value_or(Vec3f(0.0f)));
    announcement.aperture = length_of(root, "aperture");
    announcement.focus_distance = length_of(root, "focus-distance");
    if (root.contains("depth_near")) {
      announcement.depth_near = finite_number(root["depth_near"], "depth_near");
      if (!(announcement.depth_near >= 1e-6)) throw broken("'depth_near' must be above 0 metres");
    }
    return announcement;
  } catch (const json::exception& error) {
    throw broken(error.what());
  }
}

}  // namespace polyhull
