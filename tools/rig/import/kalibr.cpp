// SPDX-License-Identifier: LGPL-2.1-or-later
// Kalibr's camchain.yaml (github.com/ethz-asl/kalibr/wiki/yaml-formats).
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "base/plain_text.h"
#include "rig/import.h"
#include "rig/import/yaml.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

struct Transform {
  Mat3 R{1.0};
  Vec3 t{0.0};
};

struct Chain {
  const std::string& source;
  const Options& options;
  std::string key;       // of the camera at hand
  std::size_t line = 0;  // of its key

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::bad_input, "{}, line {}, {}: {}.", source, line, key, what);
  }

  std::vector<double> numbers(const YAML::Node& node, const char* name, std::size_t count) const {
    if (!node || !node.IsSequence() || node.size() != count)
      fail(fmt::format("{} must be a list of {} numbers", name, count));
    return numbers(node, name);
  }

  std::vector<double> numbers(const YAML::Node& node, const char* name) const {
    if (!node || !node.IsSequence()) fail(fmt::format("{} must be a list of numbers", name));
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

  // Four rows, or their 16 numbers, also as cv::FileStorage's matrix.
  Transform transform(const YAML::Node& node, const char* name) const {
    const YAML::Node given = node.IsMap() && node["data"] ? node["data"] : node;
    std::vector<double> m;
    if (given.IsSequence() && given.size() == 16) m = numbers(given, name);
    if (given.IsSequence() && given.size() == 4)
      for (const YAML::Node& row : given) {
        const std::vector<double> values = numbers(row, name, 4);
        m.insert(m.end(), values.begin(), values.end());
      }
    if (m.empty()) fail(fmt::format("{} must have four rows of four numbers", name));
    constexpr double rounding = 1e-9;
    for (std::size_t i = 12; i < 16; ++i)
      if (std::abs(m[i] - (i == 15)) > rounding)
        fail(fmt::format("the last row of {} must be 0 0 0 1", name));
    return {from_rows({m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}),
            Vec3(m[3], m[7], m[11])};
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
    // Kalibr's has four of OpenCV's coefficients, others write more of them.
    if (lens == "radtan" || lens == "plumb_bob" || lens == "rational_polynomial") {
      result.distortion = numbers(node["distortion_coeffs"], "distortion_coeffs");
      if (const std::size_t n = result.distortion.size(); n != 4 && n != 5 && n != 8)
        fail("distortion_coeffs must be a list of 4, 5 or 8 numbers");
    } else if (lens != "none")
      fail(
          fmt::format("the distortion model {} cannot be had in OpenCV's terms; calibrate with "
                      "radtan",
                      lens));
    std::vector<double> size{double(options.width), double(options.height)};
    if (options.width <= 0 && !node["resolution"])
      fail("resolution is missing; give the pictures' size as --size WIDTHxHEIGHT");
    if (options.width <= 0) size = numbers(node["resolution"], "resolution", 2);
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
    const YAML::Node root = parse_yaml(plain_text(text, source));
    if (root.IsMap() && root.size() > 0) return root;
  } catch (const YAML::Exception& error) {
    throw Error(Error::Kind::bad_input,
                "{}, line {}: not YAML: {}. Of Kalibr's files give its camchain-….yaml.", source,
                error.mark.line + 1, error.msg);
  }
  throw Error(Error::Kind::bad_input, "{}: no cameras; a Kalibr camchain has cam0, cam1, ….",
              source);
}

struct Entry {
  std::string key;
  std::size_t line;
  YAML::Node node;
};

// The cameras in the order of their numbers.
std::vector<Entry> entries_of(const YAML::Node& root, const std::string& source) {
  std::map<int, Entry> entries;
  for (const auto& item : root) {
    const std::string key = item.first.IsScalar() ? item.first.Scalar() : "";
    const auto line = static_cast<std::size_t>(item.first.Mark().line + 1);
    int number = 0;
    const char* const end = key.data() + key.size();
    if (!key.starts_with("cam") || std::from_chars(key.data() + 3, end, number).ptr != end ||
        key.size() == 3 || number < 0) {
      if (item.second.IsMap() && item.second["camera_model"])
        fail_at(source, line,
                fmt::format("the camera '{}' must be called cam and a number, as in cam0, cam1, …",
                            key));
      continue;
    }
    const auto [other, added] = entries.emplace(number, Entry{key, line, item.second});
    if (!added)
      fail_at(source, line,
              fmt::format("{} is there a second time, after line {}", key, other->second.line));
  }
  if (entries.empty())
    throw Error(Error::Kind::bad_input, "{}: no cam0; a Kalibr camchain has cam0, cam1, ….",
                source);
  std::vector<Entry> chain;
  int last = entries.begin()->first - 1;
  for (auto& [number, entry] : entries) {
    if (number != last + 1)
      fail_at(
          source, entry.line,
          fmt::format("cam{} is missing between cam{} and {}; a chain's numbers have no gap, so "
                      "renumber its cameras, or add it",
                      last + 1, last, entry.key));
    last = number;
    chain.push_back(std::move(entry));
  }
  return chain;
}

bool in_world(const Entry& entry) {
  return entry.node.IsMap() && (entry.node["T_cam_imu"] || entry.node["T_imu_cam"]);
}

// By keys, where two cameras have the same topic.
void make_names_distinct(Rig& rig, const std::vector<Entry>& entries) {
  std::set<std::string> names;
  for (const Camera& camera : rig.cameras) names.insert(camera.name);
  if (names.size() == entries.size()) return;
  for (std::size_t i = 0; i < entries.size(); ++i) rig.cameras[i].name = entries[i].key;
}

Rig read_chain(const YAML::Node& root, const std::string& source, const Options& options) {
  const std::vector<Entry> entries = entries_of(root, source);
  const bool all_in_world = std::ranges::all_of(entries, in_world);
  Chain chain{source, options, {}, 0};
  Rig rig;
  Transform last;
  for (const Entry& entry : entries) {
    chain.key = entry.key;
    chain.line = entry.line;
    const YAML::Node& node = entry.node;
    Camera& camera = rig.cameras.emplace_back(chain.camera(node));
    Transform pose;
    if (all_in_world && node["T_cam_imu"]) {
      pose = chain.transform(node["T_cam_imu"], "T_cam_imu");
    } else if (all_in_world) {
      const Transform back = chain.transform(node["T_imu_cam"], "T_imu_cam");
      pose.R = glm::transpose(back.R);
      pose.t = -(pose.R * back.t);
    } else if (rig.cameras.size() > 1) {
      const YAML::Node step = node["T_cn_cnm1"];
      if (!step)
        chain.fail(
            "T_cn_cnm1 is missing, so where the camera stands is not known (nor has every camera "
            "T_cam_imu or T_imu_cam)");
      const Transform to_this = chain.transform(step, "T_cn_cnm1");
      pose = {to_this.R * last.R, to_this.R * last.t + to_this.t};
    }
    camera.R = pose.R;
    camera.t = pose.t;
    last = pose;
  }
  make_names_distinct(rig, entries);
  return rig;
}

}  // namespace

Rig parse_kalibr(const std::string& text, const std::string& source, const Options& options) {
  const YAML::Node root = load(text, source);
  try {
    return finished(read_chain(root, source, options), source);
  } catch (const YAML::Exception& error) {
    throw Error(Error::Kind::bad_input, "{}: not a Kalibr camchain: {}.", source, error.what());
  }
}

Rig kalibr(const std::string& file, const Options& options) {
  return parse_kalibr(read_text(file), file, options);
}

}  // namespace polyhull::import
