// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenCV's FileStorage files, XML or YAML.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <stdexcept>

#include "base/error.h"
#include "rig/import.h"
#include "rig/import/lines.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

using Names = std::initializer_list<const char*>;

// By File::node_of(), which does not heed capitals and underscores.
constexpr Names matrix_names = {"camera_matrix", "K", "M", "intrinsics", "intrinsic_matrix"};
constexpr Names distortion_names = {"distortion_coefficients",
                                    "distortion_coeffs",
                                    "distortion_coeff",
                                    "dist_coeffs",
                                    "dist_coeff",
                                    "distortion_parameters",
                                    "distortion",
                                    "distortion_vector",
                                    "dist",
                                    "kc",
                                    "D"};
constexpr Names rotation_names = {"rotation", "R", "rvec"};
constexpr Names translation_names = {"translation", "T", "t", "tvec"};

// What tells the cameras of a stereo pair apart, behind or before such a name.
struct Labels {
  const char *left, *right;
};
constexpr Labels stereo_labels[] = {{"1", "2"}, {"left", "right"}, {"l", "r"}, {"0", "1"}};

// Lower case, without what joins words: image_Width and imageWidth are the same.
std::string plain_name(std::string_view name) {
  std::string result;
  for (const char c : name)
    if (c != '_' && c != '-')
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

constexpr const char* add_poses =
    "Where the camera stands must be in its file as R and T (world to camera; of OpenCV's solvePnP "
    "with one board that all cameras see, rvec and tvec); polyhull-calibrate finds lenses and "
    "poses of all cameras from pictures of a board";

class File {
 public:
  explicit File(const std::string& path) : path_(path), text_(read_text(path)) {
    const bool packed = text_.starts_with("\x1f\x8b");  // gzip, which cv::FileStorage unpacks
    if (!packed && is_ros()) fail(ros);
    if (!packed && !text_.starts_with("%YAML") && !text_.starts_with("<?xml") &&
        !text_.starts_with("{"))
      fail("not an OpenCV XML or YAML file; these begin with %YAML:1.0 or <?xml version=\"1.0\"?>");
    try {
      storage_.open(packed ? path : text_,
                    cv::FileStorage::READ | (packed ? 0 : cv::FileStorage::MEMORY));
    } catch (const cv::Exception& error) {
      // A parser's error has "FILE(LINE): what" for its function.
      const std::string& place = error.func;
      const std::size_t end = place.find("): "), open = place.rfind('(', end);
      std::size_t line = 0;
      if (end != place.npos && open != place.npos)
        std::from_chars(place.data() + open + 1, place.data() + end, line);
      if (line == 0) fail(fmt::format("not an OpenCV XML or YAML file: {}", error.err));
      fail_at(path_, line,
              fmt::format("not an OpenCV XML or YAML file: {}", place.substr(end + 3)));
    } catch (const std::logic_error&) {  // of its strings, for texts that end too early
      fail("not an OpenCV XML or YAML file");
    }
    if (!storage_.isOpened() || !storage_.root().isMap()) fail("not an OpenCV XML or YAML file");
    refuse_other_models();
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::bad_input, "{}: {}.", path_, what);
  }

  bool has(const char* name) const { return !storage_[name].empty(); }

  // The first of the names that is there, with \p label, as doubles; empty where none is.
  cv::Mat find(Names names, const std::string& label = "") const {
    const cv::FileNode node = node_of(names, label);
    if (node.empty()) return {};
    // OpenCV takes memory for all that a matrix says it has before it looks how much there is.
    constexpr double most_numbers = 1000.0;
    cv::Mat raw, result;
    try {
      if (!node.isMap() || !node["sizes"].empty() ||
          static_cast<double>(node["rows"]) * static_cast<double>(node["cols"]) > most_numbers)
        throw cv::Exception();
      node >> raw;
      raw.convertTo(result, CV_64F);
    } catch (const cv::Exception&) {
      fail_in(node,
              fmt::format("{} is no matrix of cv::FileStorage (!!opencv-matrix with rows, cols, "
                          "dt and data)",
                          node.name()));
    }
    if (!cv::checkRange(result))
      fail_in(node, fmt::format("{} holds a number that is not finite (NaN); the calibration did "
                                "not succeed",
                                node.name()));
    return result.isContinuous() ? result : result.clone();
  }

  cv::Mat need(Names names, std::initializer_list<std::size_t> sizes, const char* what,
               const std::string& label = "") const {
    const cv::Mat found = find(names, label);
    if (found.empty()) {
      std::string list;
      for (const char* name : names) list += (list.empty() ? "" : ", ") + (name + label);
      fail(fmt::format("no {}; looked for {}", what, list));
    }
    const std::size_t count = found.total() * static_cast<std::size_t>(found.channels());
    if (std::ranges::count(sizes, count)) return found;
    std::string expected;
    for (const std::size_t size : sizes)
      expected += (expected.empty() ? "" : " or ") + std::to_string(size);
    fail_in(node_of(names, label),
            fmt::format("the {} has {} numbers, expected {}", what, count, expected));
  }

  // Coefficients that are numbers of their own.
  std::vector<double> single_coefficients() const {
    std::vector<double> values;
    std::size_t used = 0;
    for (const char* name : {"k1", "k2", "p1", "p2", "k3"}) {
      const cv::FileNode node = storage_[name];
      const bool is_number = node.isInt() || node.isReal();
      values.push_back(is_number ? static_cast<double>(node) : 0.0);
      if (is_number) used = std::max<std::size_t>(values.size(), 4);
    }
    if (used > 0 && has("k4"))
      fail_in(
          storage_["k4"],
          "k4 is of another lens model than k1 k2 p1 p2 k3; give the coefficients as one matrix "
          "distortion_coefficients, in OpenCV's order");
    values.resize(used);
    return values;
  }

  // Throws where coefficients stand under a name that is not read.
  void refuse_unread_distortion() const {
    for (const cv::FileNode& node : storage_.root())
      if ((node.isMap() || node.isSeq()) &&
          plain_name(node.name()).find("dist") != std::string::npos &&
          !std::ranges::count(read_, node.name()))
        fail_in(node, fmt::format("{} looks like a lens's distortion, and is under no name that is "
                                  "read; call it distortion_coefficients, or take it out",
                                  node.name()));
  }

  int whole(Names names) const {
    const cv::FileNode node = node_of(names);
    if (!node.isInt() && !node.isReal()) return 0;
    const auto value = static_cast<double>(node);
    return value == std::floor(value) && value >= 0.0 && value < 1e6 ? static_cast<int>(value) : 0;
  }

  // Names where a file's poses are the board's, one per picture.
  void refuse_board_poses() const {
    const cv::FileNode poses =
        node_of({"extrinsic_parameters", "rvecs", "tvecs", "per_view_poses"});
    if (!poses.empty())
      fail_in(poses, fmt::format("{} holds poses of the board, one for each picture, as OpenCV's "
                                 "calibration sample writes them; the camera has none. {}",
                                 poses.name(), add_poses));
  }

 private:
  static constexpr const char* ros =
      "this is the form of ROS's camera_info (camera_calibration), which holds a lens and no pose. "
      "Write its camera_matrix and distortion_coefficients by cv::FileStorage, with R and T";

  // With the line of \p node.
  [[noreturn]] void fail_in(const cv::FileNode& node, const std::string& what) const {
    const std::string name = node.name();
    for (const Line& line : lines_of(text_))
      if (line.text.starts_with(name + ":") || line.text.starts_with("<" + name) ||
          line.text.starts_with("\"" + name + "\""))
        fail_at(path_, line.number, what);
    fail(what);
  }

  // Its matrices are maps of YAML without cv::FileStorage's tag, or sections of an INI file.
  bool is_ros() const {
    bool tagged = false, matrix = false, other = false;
    for (const Line& line : lines_of(text_)) {
      tagged = tagged || line.text.find("opencv-matrix") != line.text.npos;
      matrix = matrix || line.text == "camera_matrix:" || line.text == "camera matrix";
      for (const char* name :
           {"rectification_matrix:", "projection_matrix:", "distortion_model:", "[image]"})
        other = other || line.text.starts_with(name);
    }
    return matrix && other && !tagged;
  }

  // By their exact names, else (but for single letters without a label) as people spell them.
  cv::FileNode node_of(Names names, const std::string& label = "") const {
    const auto found = [&](const cv::FileNode& node) {
      read_.push_back(node.name());
      return node;
    };
    for (const char* name : names)
      if (label.empty() && has(name)) return found(storage_[name]);
    for (const char* name : names)
      for (const cv::FileNode& node : storage_.root()) {
        if (label.empty() ? name[1] == '\0' : !node.isMap()) continue;  // k1 is a number, K1 none
        const std::string plain = plain_name(node.name());
        if (plain == plain_name(name + label) || plain == plain_name(label + name))
          return found(node);
      }
    return {};
  }

  // Coefficients of other models stand under the same names.
  void refuse_other_models() const {
    const auto refuse = [&](const cv::FileNode& node, const std::string& value) {
      fail_in(node, fmt::format("{} is {}: its coefficients are those of another model than "
                                "OpenCV's ordinary one (k1 k2 p1 p2 k3). Calibrate without the "
                                "fisheye setting, or undistort the pictures first and calibrate "
                                "these",
                                node.name(), value));
    };
    const cv::FileNode flag = node_of(
        {"fisheye_model", "fisheye", "use_fisheye", "is_fisheye", "Calibrate_UseFisheyeModel"});
    std::string set;
    if (flag.isInt() || flag.isReal()) set = fmt::format("{:g}", static_cast<double>(flag));
    if (flag.isString()) set = static_cast<std::string>(flag);
    if (!set.empty() && set != "0" && plain_name(set) != "false" && plain_name(set) != "no")
      refuse(flag, set);
    for (const char* name : {"xi", "xi_1", "xi1"})
      if (has(name))
        fail_in(storage_[name],
                fmt::format("{} is of OpenCV's omnidirectional model (cv::omnidir), whose "
                            "coefficients are not those of its ordinary one (k1 k2 p1 p2 k3). "
                            "Undistort the pictures first (cv::omnidir::undistortImage) and "
                            "calibrate these",
                            name));
    const cv::FileNode model =
        node_of({"distortion_model", "camera_model", "model_type", "model", "distortion_type"});
    if (!model.isString()) return;
    const auto name = static_cast<std::string>(model);
    for (const char* other : {"fisheye", "equidistant", "kannala", "omni", "mei", "fov", "eucm"})
      if (plain_name(name).find(other) != std::string::npos) refuse(model, name);
  }

  std::string path_, text_;
  cv::FileStorage storage_;
  mutable std::vector<std::string> read_;  // names of nodes
};

Mat3 matrix(const cv::Mat& m) {
  std::array<double, 9> rows;
  std::copy_n(m.ptr<double>(), 9, rows.begin());
  return from_rows(rows);
}

Vec3 vector(const cv::Mat& m) {
  const double* v = m.ptr<double>();
  return {v[0], v[1], v[2]};
}

Mat3 rotation(const cv::Mat& m) {
  return m.total() == 9 ? matrix(m) : rotation_of(vector(m));
}

void set_size(Camera& camera, const File& file, const Options& options) {
  camera.width = options.width > 0 ? options.width : file.whole({"image_width", "width"});
  camera.height = options.height > 0 ? options.height : file.whole({"image_height", "height"});
  if (camera.width <= 0 || camera.height <= 0)
    file.fail("it does not say the pictures' size; give it with --size WIDTHxHEIGHT");
}

void set_intrinsics(Camera& camera, const File& file, const std::string& label = "") {
  camera.K = matrix(file.need(matrix_names, {9}, "camera matrix", label));
  const cv::Mat distortion = file.find(distortion_names, label);
  const double* values = distortion.ptr<double>();
  camera.distortion.assign(values, values + distortion.total());
  if (distortion.empty() && label.empty()) camera.distortion = file.single_coefficients();
  if (camera.distortion.empty()) file.refuse_unread_distortion();
  // The last two of OpenCV's 14 tilt the sensor; calibrations that do not use them hold zeros.
  if (camera.distortion.size() != 14) return;
  if (camera.distortion[12] != 0.0 || camera.distortion[13] != 0.0)
    file.fail(
        "its last two of 14 distortion coefficients tilt the sensor, which a rig's lenses do not "
        "do; calibrate without CALIB_TILTED_MODEL");
  camera.distortion.resize(12);
}

Camera read_opencv_camera(const std::string& path, const Options& options) {
  const File file(path);
  Camera camera;
  set_size(camera, file, options);
  set_intrinsics(camera, file);
  if (file.find(rotation_names).empty()) file.refuse_board_poses();
  camera.R = rotation(file.need(rotation_names, {3, 9}, "rotation"));
  camera.t = vector(file.need(translation_names, {3}, "translation"));
  return camera;
}

// The first camera is the world's origin.
Rig stereo_pair(const File& intrinsics, const Labels& labels, const File& extrinsics,
                const Options& options) {
  Rig rig;
  rig.cameras.resize(2);
  for (Camera& camera : rig.cameras) set_size(camera, intrinsics, options);
  rig.cameras[0].name = "left";
  set_intrinsics(rig.cameras[0], intrinsics, labels.left);
  rig.cameras[1].name = "right";
  set_intrinsics(rig.cameras[1], intrinsics, labels.right);
  rig.cameras[1].R = rotation(extrinsics.need(rotation_names, {3, 9}, "rotation"));
  rig.cameras[1].t = vector(extrinsics.need(translation_names, {3}, "translation"));
  return rig;
}

// How \p file tells a stereo pair's lenses apart; null: it holds none.
const Labels* labels_in(const File& file) {
  const auto has = [&](const char* label) { return !file.find(matrix_names, label).empty(); };
  if (has("1") && has("2") && (has("0") || has("3")))
    file.fail("it holds more than two cameras; give a file for each, with its R and T");
  for (const Labels& labels : stereo_labels)
    if (has(labels.left) && has(labels.right)) return &labels;
  return nullptr;
}

// Of one file, or of a pair's lenses in one and where it stands in the other; nothing: they hold
// none.
std::optional<Rig> stereo_pair_in(const std::vector<std::string>& files, const Options& options) {
  if (files.size() > 2) return std::nullopt;
  const File first(files.front()), last(files.back());
  const Labels *of_first = labels_in(first), *of_last = labels_in(last);
  if (files.size() == 2 && of_first && of_last)
    last.fail("it holds a stereo pair's lenses, as the file before it does; give one pair");
  if (of_first) return stereo_pair(first, *of_first, last, options);
  if (of_last) return stereo_pair(last, *of_last, first, options);
  return std::nullopt;
}

}  // namespace

Rig opencv(const std::vector<std::string>& files, const Options& options) {
  Rig rig;
  if (auto pair = stereo_pair_in(files, options)) {
    rig = *std::move(pair);
  } else {
    const std::vector<std::string> names = names_of(files);
    for (std::size_t i = 0; i < files.size(); ++i) {
      rig.cameras.push_back(read_opencv_camera(files[i], options));
      rig.cameras.back().name = names[i];
    }
  }
  return parse_rig(rig_to_json(rig), files.front());
}

}  // namespace polyhull::import
