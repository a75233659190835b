// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenTrackIO samples (SMPTE RIS OSVP, protocol 1.0) and their OpenLensIO lens model
// (track/opentrackio_json.h).
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/error.h"
#include "base/parse_json.h"
#include "rig/import.h"
#include "text_file.h"
#include "track/opentrackio_json.h"

namespace polyhull::import {
namespace {

using namespace opentrackio;
using Json = nlohmann::json;

[[noreturn]] void fail(const std::string& what) {
  throw Error(Error::Kind::bad_input, "{}.", what);
}

double positive(const Json& root, const char* path) {
  const std::optional<double> value = length(root, path);
  if (!value) fail(fmt::format("{} must be a number", path));
  return *value;
}

/// Refuses a sample that lacks what a camera is made of, and says all that is missing.
void check_complete(const Json& root, const Options& options) {
  std::string missing;
  const auto need = [&](std::initializer_list<const char*> paths, const char* what) {
    for (const char* path : paths)
      if (!find(root, path)) {
        missing += (missing.empty() ? "" : "; ") + std::string(what);
        return;
      }
  };
  if (options.width <= 0 || options.height <= 0)
    need({"/static/camera/activeSensorResolution/width",
          "/static/camera/activeSensorResolution/height"},
         "static.camera.activeSensorResolution (give the pictures' size as --size WIDTHxHEIGHT)");
  need({"/static/camera/activeSensorPhysicalDimensions/width",
        "/static/camera/activeSensorPhysicalDimensions/height"},
       "static.camera.activeSensorPhysicalDimensions (width and height of the sensor, mm)");
  need({"/lens/pinholeFocalLength"}, "lens.pinholeFocalLength (mm)");
  if (!missing.empty()) fail("the sample lacks " + missing);
}

int pixels(const Json& root, const char* path, int given) {
  if (given > 0) return given;
  const double value = positive(root, path);
  if (value != std::floor(value) || value > 32768)
    fail(fmt::format("{} must be a whole number up to 32768", path));
  return static_cast<int>(value);
}

Camera camera_of(const Json& root, const Options& options) {
  if (!root.is_object()) fail("an OpenTrackIO sample is a JSON object");
  check_complete(root, options);
  Camera camera;
  if (const Json* label = find(root, "/static/camera/label"); label && label->is_string())
    camera.name = label->get<std::string>();
  camera.width = pixels(root, "/static/camera/activeSensorResolution/width", options.width);
  camera.height = pixels(root, "/static/camera/activeSensorResolution/height", options.height);
  if (const Json* squeeze = find(root, "/static/camera/anamorphicSqueeze"))
    if (!squeeze->is_object() || squeeze->value("num", Json()) != squeeze->value("denom", Json()))
      fail(
          "the lens squeezes the picture (static.camera.anamorphicSqueeze), which the "
          "OpenLensIO model of it does not tell in OpenCV's terms");
  const double x =
      camera.width / positive(root, "/static/camera/activeSensorPhysicalDimensions/width");
  const double y =
      camera.height / positive(root, "/static/camera/activeSensorPhysicalDimensions/height");
  const double f = positive(root, "/lens/pinholeFocalLength");
  const Vec2 offset(number_or_zero(root, "/lens/projectionOffset/x"),
                    number_or_zero(root, "/lens/projectionOffset/y"));
  const Vec2 half(0.5 * camera.width / x, 0.5 * camera.height / y);
  camera.K = from_rows({f * x, 0, 0.5 * camera.width - 0.5 + x * offset.x, 0, f * y,
                        0.5 * camera.height - 0.5 + y * offset.y, 0, 0, 1});
  FittedDistortion nothing_yet;
  try {
    camera.distortion = opencv_distortion(root, f, half + glm::abs(offset), nothing_yet);
  } catch (const Error& error) {
    throw Error(
        error.kind(),
        "{} Calibrate the lens with a board (polyhull-calibrate), or, to import the camera as "
        "if its lens did not distort, take lens.distortion out of the sample.",
        error.what());
  }
  const Placed pose = placed(root);
  camera.R = from_rows({1, 0, 0, 0, 0, -1, 0, 1, 0}) * glm::transpose(pose.axes);
  camera.t = -(camera.R * pose.place);
  return camera;
}

}  // namespace

Camera parse_opentrackio(const std::string& text, const std::string& source,
                         const Options& options) {
  const auto root = parse_json<Json>(text, source);
  try {
    return camera_of(root, options);
  } catch (const Error& error) {
    throw Error(error.kind(), "{}: {}", source, error.what());
  }
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
  return finished(rig, files.front());
}

}  // namespace polyhull::import
