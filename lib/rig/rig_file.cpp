// SPDX-License-Identifier: LGPL-2.1-or-later
// The rig file: JSON to Rig and back.
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/plain_text.h"
#include "base/rotation.h"
#include "rig/projection_matrix.h"
#include "rig/rig.h"
#include "rig/rig_error.h"

namespace polyhull {
namespace {

using nlohmann::json;

const json& member(const json& object, const char* key, const std::string& where) {
  const auto found = object.find(key);
  if (found == object.end()) fail_rig(where, fmt::format("'{}' is missing", key));
  return *found;
}

double number(const json& value, const std::string& where) {
  if (!value.is_number())
    fail_rig(where, fmt::format("expected a number, found {}", value.dump().substr(0, 40)));
  const double result = value.get<double>();
  if (!std::isfinite(result)) fail_rig(where, "the number is not finite");
  return result;
}

std::vector<double> numbers(const json& value, const std::string& where) {
  if (!value.is_array()) fail_rig(where, "expected a list of numbers");
  std::vector<double> result;
  for (std::size_t i = 0; i < value.size(); ++i)
    result.push_back(number(value[i], fmt::format("{}[{}]", where, i)));
  return result;
}

Vec3 vector3(const json& value, const std::string& where) {
  const std::vector<double> v = numbers(value, where);
  if (v.size() != 3) fail_rig(where, fmt::format("expected three numbers, found {}", v.size()));
  return {v[0], v[1], v[2]};
}

std::vector<double> matrix(const json& value, std::size_t columns, const std::string& where) {
  if (!value.is_array() || value.size() != 3)
    fail_rig(where, fmt::format("expected three rows of {} numbers", columns));
  std::vector<double> result;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string row_where = fmt::format("{}[{}]", where, i);
    const std::vector<double> row = numbers(value[i], row_where);
    if (row.size() != columns)
      fail_rig(row_where, fmt::format("expected {} numbers, found {}", columns, row.size()));
    result.insert(result.end(), row.begin(), row.end());
  }
  return result;
}

Mat3 matrix3(const json& value, const std::string& where) {
  const std::vector<double> m = matrix(value, 3, where);
  std::array<double, 9> rows;
  std::copy(m.begin(), m.end(), rows.begin());
  return from_rows(rows);
}

int whole(const json& value, const std::string& where) {
  const double result = number(value, where);
  if (result != std::floor(result) || std::abs(result) > 1e9)
    fail_rig(where, "expected a whole number");
  return static_cast<int>(result);
}

std::string text(const json& value, const std::string& where) {
  if (!value.is_string()) fail_rig(where, "expected a string");
  return value.get<std::string>();
}

// Rotations written with few digits: the nearest rotation by Newton's iteration for the polar
// factor. Those that are exact to rounding stay as they are, so that a file read and written is the
// same.
void orthonormalise(Mat3& R) {
  for (int round = 0; round < 10; ++round) {
    if (!(orthonormal_error(R) > 1e-13)) return;
    R = 0.5 * (R + glm::transpose(glm::inverse(R)));
  }
}

Camera read_camera(const json& value, const std::string& where,
                   std::optional<ProjectionMatrix>& projection) {
  if (!value.is_object()) fail_rig(where, "expected an object describing a camera");
  Camera camera;
  camera.name = text(member(value, "name", where), where + ".name");
  const std::string named = fmt::format("{} ('{}')", where, camera.name);
  camera.width = whole(member(value, "width", named), named + ".width");
  camera.height = whole(member(value, "height", named), named + ".height");
  if (value.contains("P")) {
    for (const char* key : {"K", "R", "t"})
      if (value.contains(key))
        fail_rig(named, fmt::format("gives both P and {}; give either P or K, R and t", key));
    const std::vector<double> p = matrix(value["P"], 4, named + ".P");
    projection.emplace();
    for (int i = 0; i < 12; ++i) (*projection)[i / 4][i % 4] = p[i];
  } else {
    camera.K = matrix3(member(value, "K", named), named + ".K");
    camera.R = matrix3(member(value, "R", named), named + ".R");
    camera.t = vector3(member(value, "t", named), named + ".t");
  }
  if (value.contains("distortion"))
    camera.distortion = numbers(value["distortion"], named + ".distortion");
  if (value.contains("colour")) camera.colour = matrix3(value["colour"], named + ".colour");
  return camera;
}

void read_cameras(const json& list, Rig& rig, const std::string& source) {
  if (!list.is_array()) fail_rig(source + ": cameras", "expected a list of cameras");
  std::vector<std::optional<ProjectionMatrix>> projections(list.size());
  std::vector<ProjectionMatrix> given;
  for (std::size_t i = 0; i < list.size(); ++i) {
    rig.cameras.push_back(
        read_camera(list[i], fmt::format("{}: cameras[{}]", source, i), projections[i]));
    if (projections[i]) given.push_back(*projections[i]);
  }
  std::optional<Vec3> focus;
  if (rig.bounds)
    focus = 0.5 * (rig.bounds->min + rig.bounds->max);
  else
    focus = common_focus(given);
  for (std::size_t i = 0; i < projections.size(); ++i)
    if (projections[i])
      set_projection(rig.cameras[i], *projections[i], focus,
                     fmt::format("{}: cameras[{}] ('{}')", source, i, rig.cameras[i].name));
}

std::string list(const double* values, std::size_t count) {
  std::string out = "[";
  for (std::size_t i = 0; i < count; ++i) out += (i ? ", " : "") + json(values[i]).dump();
  return out + "]";
}

std::string list(const Vec3& v) {
  return list(&v.x, 3);
}

std::string rows(const Mat3& m) {
  const auto r = to_rows(m);
  return "[" + list(&r[0], 3) + ", " + list(&r[3], 3) + ", " + list(&r[6], 3) + "]";
}

}  // namespace

Rig parse_rig(std::string_view content, const std::string& source) {
  const json root = parse_json(plain_text(std::string(content), source), source);
  if (!root.is_object() || !root.contains("format") || root["format"] != "polyhull-rig")
    fail_rig(source, "not a rig file: expected an object with \"format\": \"polyhull-rig\"");
  const int version = whole(member(root, "version", source), source + ": version");
  if (version != 1)
    throw Error(Error::Kind::unsupported, "{}: rig file version {}; this program reads version 1.",
                source, version);
  Rig rig;
  if (root.contains("up")) rig.up = vector3(root["up"], source + ": up");
  if (root.contains("unit")) rig.unit = text(root["unit"], source + ": unit");
  if (root.contains("bounds")) {
    const json& bounds = root["bounds"];
    if (!bounds.is_object()) fail_rig(source + ": bounds", "expected {\"min\": [3], \"max\": [3]}");
    rig.bounds =
        Bounds{vector3(member(bounds, "min", source + ": bounds"), source + ": bounds.min"),
               vector3(member(bounds, "max", source + ": bounds"), source + ": bounds.max")};
  }
  read_cameras(member(root, "cameras", source), rig, source);
  validate_rig(rig, source);
  for (Camera& camera : rig.cameras) orthonormalise(camera.R);
  return rig;
}

Rig load_rig(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw Error(Error::Kind::not_found, "Cannot read the rig file '{}': {}.", path,
                std::strerror(errno));
  std::ostringstream content;
  content << file.rdbuf();
  if (file.bad() || content.fail())
    throw Error(Error::Kind::io, "Cannot read the rig file '{}'; is it a folder or empty?", path);
  return parse_rig(content.str(), path);
}

std::string rig_to_json(const Rig& rig) {
  std::string out = "{\n  \"format\": \"polyhull-rig\",\n  \"version\": 1,\n";
  out += "  \"up\": " + list(rig.up) + ",\n  \"unit\": " + json(rig.unit).dump() + ",\n";
  if (rig.bounds)
    out += "  \"bounds\": {\"min\": " + list(rig.bounds->min) +
           ", \"max\": " + list(rig.bounds->max) + "},\n";
  out += "  \"cameras\": [\n";
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    out += "    {\n      \"name\": " +
           json(camera.name).dump(-1, ' ', false, json::error_handler_t::replace) +
           ",\n      \"width\": " + std::to_string(camera.width) +
           ",\n      \"height\": " + std::to_string(camera.height) +
           ",\n      \"K\": " + rows(camera.K);
    if (!camera.distortion.empty())
      out += ",\n      \"distortion\": " + list(camera.distortion.data(), camera.distortion.size());
    out += ",\n      \"R\": " + rows(camera.R) + ",\n      \"t\": " + list(camera.t);
    if (camera.colour != Mat3(1.0)) out += ",\n      \"colour\": " + rows(camera.colour);
    out += "\n    }";
    out += i + 1 < rig.cameras.size() ? ",\n" : "\n";
  }
  return out + "  ]\n}\n";
}

}  // namespace polyhull
