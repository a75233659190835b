// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenTrackIO samples (SMPTE RIS OSVP, protocol 1.0) and their OpenLensIO lens model.
//
// World: metres, z up; a camera without rotation looks along y, x to its right. Transforms are from
// parent to child, each rotation about z (pan), then the turned x (tilt), then y (roll), right-handed.
// Lens: with F the pinhole focal length and (x, y) a point on the sensor without distortion, all in
// mm from the centre of projection, y down, s = x^2 + y^2, l1... the radial and q1 q2 the tangential
// coefficients of the model from undistorted to distorted ("U-D"),
//
//     x' = x (1 + l1 s + l3 s^2 + l5 s^3) / (1 + l2 s + l4 s^2 + l6 s^3) + 2 q1 x y + q2 (s + 2 x^2)
//
// and y' likewise: OpenCV's model in mm. With x = F x_n the radial k of OpenCV is l F^(2n) and the
// tangential p is q F, since that term is added (the group's paper on the conversion says F^2).
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/error.h"
#include "base/parse_json.h"
#include "rig/import.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

using Json = nlohmann::json;

class Sample {
 public:
  Sample(const Json& root, const std::string& source) : root_(root), source_(source) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::bad_input, "{}: {}.", source_, what);
  }

  // The value at a path such as /lens/distortion, or null.
  const Json* find(const char* path) const {
    const Json::json_pointer pointer(path);
    return root_.contains(pointer) ? &root_.at(pointer) : nullptr;
  }

  double number(const Json* value, const std::string& what) const {
    if (!value || !value->is_number()) fail(what + " must be a number");
    const double result = value->get<double>();
    if (!std::isfinite(result)) fail(what + " is not finite");
    return result;
  }

  double positive(const char* path) const {
    const double value = number(find(path), path);
    if (!(value > 0.0)) fail(fmt::format("{} must be above 0", path));
    return value;
  }

  double number_or_zero(const char* path) const {
    const Json* value = find(path);
    return value ? number(value, path) : 0.0;
  }

  Vec3 three(const Json& parent, const char* name, std::array<const char*, 3> members,
             double missing) const {
    Vec3 result(missing);
    if (!parent.contains(name)) return result;
    const Json& value = parent.at(name);
    for (int i = 0; i < 3; ++i) {
      const bool there = value.is_object() && value.contains(members[i]);
      result[i] = number(there ? &value.at(members[i]) : nullptr,
                         fmt::format("transforms: {}.{}", name, members[i]));
    }
    return result;
  }

  std::vector<double> list(const Json& parent, const char* name, std::size_t most) const {
    std::vector<double> values;
    if (!parent.contains(name)) return values;
    const Json& list = parent.at(name);
    if (!list.is_array() || list.size() > most)
      fail(fmt::format("lens.distortion: {} must be a list of at most {} numbers", name, most));
    for (const Json& item : list)
      values.push_back(number(&item, fmt::format("lens.distortion: {}", name)));
    return values;
  }

 private:
  const Json& root_;
  const std::string& source_;
};

Mat3 turn(int axis, double degrees) {
  Vec3 v(0.0);
  v[axis] = degrees * std::acos(-1.0) / 180.0;
  return rotation_of(v);
}

// The camera's axes (right, forward, up) and place in the world.
void set_pose(Camera& camera, const Sample& sample) {
  Mat3 axes(1.0);
  Vec3 place(0.0);
  if (const Json* transforms = sample.find("/transforms")) {
    if (!transforms->is_array()) sample.fail("transforms must be a list");
    for (const Json& transform : *transforms) {
      if (!transform.is_object()) sample.fail("transforms must hold objects");
      if (sample.three(transform, "scale", {"x", "y", "z"}, 1.0) != Vec3(1.0))
        sample.fail("a transform scales; a camera cannot");
      place += axes * sample.three(transform, "translation", {"x", "y", "z"}, 0.0);
      const Vec3 angles = sample.three(transform, "rotation", {"pan", "tilt", "roll"}, 0.0);
      axes = axes * turn(2, angles[0]) * turn(0, angles[1]) * turn(1, angles[2]);
    }
  }
  // The transform places the sensor; rays meet at the entrance pupil, so many metres before it.
  place += axes * Vec3(0.0, sample.number_or_zero("/lens/entrancePupilOffset"), 0.0);
  camera.R = from_rows({1, 0, 0, 0, 0, -1, 0, 1, 0}) * glm::transpose(axes);
  camera.t = -(camera.R * place);
}

// OpenCV's coefficients for a focal length of \p f mm.
std::vector<double> lens_model(const Sample& sample, double f) {
  const Json* models = sample.find("/lens/distortion");
  if (!models) return {};
  if (!models->is_array()) sample.fail("lens.distortion must be a list");
  const Json* found = nullptr;
  for (const Json& model : *models)
    if (model.is_object() && model.value("model", Json()) == "Brown-Conrady U-D") found = &model;
  if (models->empty()) return {};
  if (!found)
    sample.fail(
        "lens.distortion has no model \"Brown-Conrady U-D\"; one from distorted to undistorted "
        "(D-U) "
        "or another cannot be had in OpenCV's terms");
  for (const char* axis : {"/lens/distortionOffset/x", "/lens/distortionOffset/y"})
    if (sample.number_or_zero(axis) != 0.0)
      sample.fail(
          "lens.distortionOffset is not 0; OpenCV's lenses are centred on the principal point");
  std::vector<double> l = sample.list(*found, "radial", 6);
  std::vector<double> q = sample.list(*found, "tangential", 2);
  l.resize(6);
  q.resize(2);
  const double f2 = f * f, f4 = f2 * f2, f6 = f4 * f2;
  std::vector<double> k{l[0] * f2, l[2] * f4, q[0] * f,  q[1] * f,
                        l[4] * f6, l[1] * f2, l[3] * f4, l[5] * f6};
  if (l[1] == 0.0 && l[3] == 0.0 && l[5] == 0.0) k.resize(5);
  return k;
}

int pixels(const Sample& sample, const char* path, int given) {
  if (given > 0) return given;
  const double value = sample.positive(path);
  if (value != std::floor(value) || value > 32768)
    sample.fail(fmt::format("{} must be a whole number up to 32768", path));
  return static_cast<int>(value);
}

}  // namespace

Camera parse_opentrackio(const std::string& text, const std::string& source,
                         const Options& options) {
  const auto root = parse_json<Json>(text, source);
  const Sample sample(root, source);
  if (!root.is_object()) sample.fail("an OpenTrackIO sample is a JSON object");
  Camera camera;
  if (const Json* label = sample.find("/static/camera/label"); label && label->is_string())
    camera.name = label->get<std::string>();
  camera.width = pixels(sample, "/static/camera/activeSensorResolution/width", options.width);
  camera.height = pixels(sample, "/static/camera/activeSensorResolution/height", options.height);
  if (const Json* squeeze = sample.find("/static/camera/anamorphicSqueeze"))
    if (!squeeze->is_object() || squeeze->value("num", Json()) != squeeze->value("denom", Json()))
      sample.fail(
          "the lens squeezes the picture (static.camera.anamorphicSqueeze), which the "
          "OpenLensIO model of it does not tell in OpenCV's terms");
  const double x =
      camera.width / sample.positive("/static/camera/activeSensorPhysicalDimensions/width");
  const double y =
      camera.height / sample.positive("/static/camera/activeSensorPhysicalDimensions/height");
  const double f = sample.positive("/lens/pinholeFocalLength");
  camera.K = from_rows(
      {f * x, 0, 0.5 * camera.width - 0.5 + x * sample.number_or_zero("/lens/projectionOffset/x"),
       0, f * y, 0.5 * camera.height - 0.5 + y * sample.number_or_zero("/lens/projectionOffset/y"),
       0, 0, 1});
  camera.distortion = lens_model(sample, f);
  set_pose(camera, sample);
  return camera;
}

Rig opentrackio(const std::vector<std::string>& files, const Options& options) {
  Rig rig;
  std::set<std::string> labels;
  for (const std::string& file : files) {
    rig.cameras.push_back(parse_opentrackio(read_text(file), file, options));
    labels.insert(rig.cameras.back().name);
  }
  if (labels.size() < files.size() || labels.contains("")) {
    const std::vector<std::string> names = names_of(files);
    for (std::size_t i = 0; i < files.size(); ++i) rig.cameras[i].name = names[i];
  }
  rig.up = Vec3(0.0, 0.0, 1.0);
  return parse_rig(rig_to_json(rig), files.front());
}

}  // namespace polyhull::import
