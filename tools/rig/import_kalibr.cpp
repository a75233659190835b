// SPDX-License-Identifier: LGPL-2.1-or-later
// Kalibr's camchain.yaml (github.com/ethz-asl/kalibr/wiki/yaml-formats).
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "base/error.h"
#include "rig/import.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

struct Transform {
  Mat3 R{1.0};
  Vec3 t{0.0};
};

struct Chain {
  const std::string& source;
  std::string key;  // of the camera at hand

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::bad_input, "{}, {}: {}.", source, key, what);
  }

  std::vector<double> numbers(const YAML::Node& node, const char* name, std::size_t count) const {
    if (!node || !node.IsSequence() || node.size() != count)
      fail(fmt::format("{} must be a list of {} numbers", name, count));
    std::vector<double> values;
    for (const YAML::Node& item : node) {
      double value = NAN;
      if (!item.IsScalar() || !YAML::convert<double>::decode(item, value) || !std::isfinite(value))
        fail(fmt::format("{} holds something that is not a number", name));
      values.push_back(value);
    }
    return values;
  }

  std::string word(const YAML::Node& camera, const char* name) const {
    const YAML::Node node = camera[name];
    if (!node || !node.IsScalar()) fail(fmt::format("{} is missing", name));
    return node.Scalar();
  }

  Transform transform(const YAML::Node& node, const char* name) const {
    if (!node.IsSequence() || node.size() != 4) fail(fmt::format("{} must have four rows", name));
    std::array<double, 9> r;
    Transform result;
    for (int row = 0; row < 4; ++row) {
      const std::vector<double> values = numbers(node[row], name, 4);
      if (row == 3) {
        if (values != std::vector<double>{0, 0, 0, 1})
          fail(fmt::format("the last row of {} must be 0 0 0 1", name));
        break;
      }
      std::copy_n(values.begin(), 3, r.begin() + 3 * row);
      result.t[row] = values[3];
    }
    result.R = from_rows(r);
    return result;
  }

  Camera camera(const YAML::Node& node) const {
    if (!node.IsMap()) fail("it must hold a camera's parameters");
    Camera result;
    const std::string model = word(node, "camera_model");
    if (model != "pinhole")
      fail(fmt::format(
          "the camera model {} cannot be had in OpenCV's terms; calibrate with pinhole", model));
    const std::vector<double> k = numbers(node["intrinsics"], "intrinsics", 4);
    result.K = from_rows({k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1});
    const std::string lens = word(node, "distortion_model");
    if (lens == "radtan")
      result.distortion = numbers(node["distortion_coeffs"], "distortion_coeffs", 4);
    else if (lens != "none")
      fail(
          fmt::format("the distortion model {} cannot be had in OpenCV's terms; calibrate with "
                      "radtan",
                      lens));
    const std::vector<double> size = numbers(node["resolution"], "resolution", 2);
    for (const double side : size)
      if (side != std::floor(side) || side < 1 || side > 32768)
        fail("resolution must be two whole numbers from 1 to 32768");
    result.width = static_cast<int>(size[0]);
    result.height = static_cast<int>(size[1]);
    result.name = name(node["rostopic"]);
    return result;
  }

  // What the topic calls it: /NAME/image_raw, as most do.
  std::string name(const YAML::Node& topic) const {
    constexpr std::string_view ending = "/image_raw";
    if (!topic || !topic.IsScalar()) return key;
    const std::string& text = topic.Scalar();
    if (!text.starts_with('/') || !text.ends_with(ending) || text.size() <= 1 + ending.size())
      return key;
    return text.substr(1, text.size() - 1 - ending.size());
  }
};

YAML::Node load(const std::string& text, const std::string& source) {
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsMap() && root.size() > 0) return root;
  } catch (const YAML::Exception& error) {
    throw Error(Error::Kind::bad_input, "{}, line {}: not YAML: {}.", source, error.mark.line + 1,
                error.msg);
  }
  throw Error(Error::Kind::bad_input, "{}: no cameras; a Kalibr camchain has cam0, cam1, ….",
              source);
}

Rig read_chain(const YAML::Node& root, const std::string& source) {
  Chain chain{source, {}};
  const auto key_of = [](std::size_t i) { return "cam" + std::to_string(i); };
  bool all_in_world = true;
  std::size_t count = 0;
  for (; root[key_of(count)]; ++count)
    all_in_world = all_in_world && root[key_of(count)].IsMap() && root[key_of(count)]["T_cam_imu"];
  if (count == 0)
    throw Error(Error::Kind::bad_input, "{}: no cam0; a Kalibr camchain has cam0, cam1, ….",
                source);
  Rig rig;
  Transform last;
  for (std::size_t i = 0; i < count; ++i) {
    chain.key = key_of(i);
    const YAML::Node node = root[chain.key];
    Camera& camera = rig.cameras.emplace_back(chain.camera(node));
    Transform pose;
    if (all_in_world) {
      pose = chain.transform(node["T_cam_imu"], "T_cam_imu");
    } else if (const YAML::Node step = node["T_cn_cnm1"]) {
      const Transform to_this = chain.transform(step, "T_cn_cnm1");
      pose = {to_this.R * last.R, to_this.R * last.t + to_this.t};
    } else if (i > 0) {
      chain.fail("T_cn_cnm1 is missing, so where the camera stands is not known");
    }
    camera.R = pose.R;
    camera.t = pose.t;
    last = pose;
  }
  return rig;
}

}  // namespace

Rig parse_kalibr(const std::string& text, const std::string& source) {
  const YAML::Node root = load(text, source);
  try {
    return parse_rig(rig_to_json(read_chain(root, source)), source);
  } catch (const YAML::Exception& error) {
    throw Error(Error::Kind::bad_input, "{}: not a Kalibr camchain: {}.", source, error.what());
  }
}

Rig kalibr(const std::string& file) {
  return parse_kalibr(read_text(file), file);
}

}  // namespace polyhull::import
