// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/import/opencv_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <stdexcept>

#include "base/error.h"
#include "rig/import.h"
#include "rig/import/lines.h"
#include "rig/import/yaml.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

// OpenCV takes memory for all that a matrix says it has before it looks how much there is.
constexpr double most_numbers = 1000.0;

constexpr const char* ros =
    "this is the form of ROS's camera_info (camera_calibration), which holds a lens and no pose. "
    "Write its camera_matrix and distortion_coefficients by cv::FileStorage, with R and T";

constexpr const char* add_poses =
    "Where the camera stands must be in its file as R and T (world to camera; of OpenCV's solvePnP "
    "with one board that all cameras see, rvec and tvec); polyhull-calibrate finds lenses and "
    "poses of all cameras from pictures of a board";

// Files of other programs that people give for OpenCV's, told by texts that all of a kind have.
struct OtherProgram {
  std::initializer_list<const char*> marks;
  const char* name;
  bool at_beginning = false;  // where the mark must stand
};
const OtherProgram other_programs[] = {
    {{"<document", "<chunk", "<camera"}, "Metashape's file of cameras"},
    {{"<calibration>", "<projection>"}, "Metashape's file of a lens alone"},
    {{"\"frames\"", "\"transform_matrix\""}, "the transforms.json of NeRF programs"},
    {{"\"views\"", "\"poses\"", "\"intrinsics\""}, "a Meshroom file (cameras.sfm)"},
    {{"\"sfm_data_version\""}, "OpenMVG's sfm_data.json"},
    {{"\"shots\"", "\"cameras\""}, "OpenSfM's reconstruction.json"},
    {{"xcr:CalibrationPrior"}, "RealityCapture's XMP file"},
    {{"# Bundle file"}, "a Bundler file", true},
    {{"NVM_V"}, "a VisualSFM file", true},
};

// Lower case, without what joins words: image_Width and imageWidth are the same.
std::string plain_name(std::string_view name) {
  std::string result;
  for (const char c : name)
    if (c != '_' && c != '-')
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

bool contains_any(const std::string& text, std::initializer_list<const char*> parts) {
  return std::ranges::any_of(parts, [&](const char* part) { return text.find(part) != text.npos; });
}

// The refusal of a \p text without a camera matrix; nothing where it looks like no other program's.
std::optional<std::string> other_program(const std::string& text) {
  if (contains_any(text, {"<opencv_storage>", "%YAML"})) return {};
  const auto* found = std::ranges::find_if(other_programs, [&](const OtherProgram& program) {
    return std::ranges::all_of(program.marks, [&](const char* mark) {
      return program.at_beginning ? text.starts_with(mark) : text.find(mark) != text.npos;
    });
  });
  if (found == std::end(other_programs)) return {};
  return fmt::format(
      "this is {}, which is not read. Write the cameras as COLMAP's text model (cameras.txt and "
      "images.txt; many programs export it) for `import colmap`, or as an OpenCV file each: "
      "camera_matrix, distortion_coefficients, R and T, world to camera, x right, y down, z "
      "forward",
      found->name);
}

bool is_number(const cv::FileNode& node) {
  return node.isInt() || node.isReal();
}

// 0 for other numbers.
int whole_of(double value) {
  return value == std::floor(value) && value >= 0.0 && value < 1e6 ? static_cast<int>(value) : 0;
}

// The numbers of a list, or of lists in it; false: it holds something else, or too many.
bool read_list(const cv::FileNode& list, std::vector<double>& numbers) {
  for (const cv::FileNode& item : list) {
    if (is_number(item))
      numbers.push_back(static_cast<double>(item));
    else if (!item.isSeq() || !read_list(item, numbers))
      return false;
    if (static_cast<double>(numbers.size()) > most_numbers) return false;
  }
  return true;
}

}  // namespace

OpenCvFile::OpenCvFile(const std::string& path) : path_(path), text_(read_text(path)) {
  try {
    open();
    refuse_other_models();
  } catch (const Error&) {
    if (const auto other = other_program(text_)) fail(*other);
    throw;
  }
}

void OpenCvFile::fail(const std::string& what) const {
  throw Error(Error::Kind::bad_input, "{}: {}.", path_, what);
}

// With the line of \p node.
void OpenCvFile::fail_in(const cv::FileNode& node, const std::string& what) const {
  const std::string name = node.name();
  for (const Line& line : lines_of(text_))
    if (line.text.starts_with(name + ":") || line.text.starts_with("<" + name) ||
        line.text.starts_with("\"" + name + "\""))
      fail_at(path_, line.number, what);
  fail(what);
}

// Where cv::FileStorage does not read a text, because it is JSON without matrices' types, or YAML of
// which it knows a part, yaml-cpp may.
void OpenCvFile::open() {
  if (text_.starts_with("\x1f\x8b")) {  // gzip, which cv::FileStorage unpacks
    open_storage(path_, cv::FileStorage::READ, 0);
    return;
  }
  if (is_ros()) fail(ros);
  std::size_t begin = 0, lines_before = 0;
  for (const Line& line : lines_of(text_)) {
    if (!line.text.empty() && line.text[0] != '#') break;
    begin = text_.find('\n', begin) + 1;
    ++lines_before;
  }
  const std::string text = text_.substr(begin);
  constexpr int in_memory = cv::FileStorage::READ | cv::FileStorage::MEMORY;
  if (text.starts_with("<")) {
    const char* heading = text.starts_with("<?xml") ? "" : "<?xml version=\"1.0\"?>";
    open_storage(heading + text, in_memory, lines_before);
    return;
  }
  std::optional<Error> problem;
  if (text.starts_with("%YAML") || text.starts_with("{")) try {
      open_storage(text, in_memory, lines_before);
      return;
    } catch (const Error& error) {
      problem = error;
    }
  try {
    const YAML::Node root = parse_yaml(text);
    if (root.IsMap()) {
      open_storage(json_of_yaml(root), in_memory, 0);
      return;
    }
  } catch (const YAML::Exception&) {
  }
  if (problem) throw Error(*problem);
  fail("not an OpenCV XML or YAML file; these begin with %YAML:1.0 or <?xml version=\"1.0\"?>");
}

// \p text begins behind \p lines_before of the file.
void OpenCvFile::open_storage(const std::string& text, int flags, std::size_t lines_before) {
  try {
    storage_ = cv::FileStorage(text, flags);
  } catch (const cv::Exception& error) {
    // A parser's error has "FILE(LINE): what" for its function.
    const std::string& place = error.func;
    const std::size_t end = place.find("): "), open = place.rfind('(', end);
    std::size_t line = 0;
    if (end != place.npos && open != place.npos)
      std::from_chars(place.data() + open + 1, place.data() + end, line);
    if (line == 0) fail(fmt::format("not an OpenCV XML or YAML file: {}", error.err));
    fail_at(path_, line + lines_before,
            fmt::format("not an OpenCV XML or YAML file: {}", place.substr(end + 3)));
  } catch (const std::logic_error&) {  // of its strings, for texts that end too early
    fail("not an OpenCV XML or YAML file");
  }
  if (!storage_.isOpened() || !storage_.root().isMap()) fail("not an OpenCV XML or YAML file");
}

// Its matrices are maps of YAML without cv::FileStorage's tag, or sections of an INI file; or it is the
// message as `rostopic echo` prints it.
bool OpenCvFile::is_ros() const {
  bool tagged = false, data = false, matrix = false, other = false, message = false;
  for (const Line& line : lines_of(text_)) {
    tagged = tagged || line.text.find("opencv-matrix") != line.text.npos;
    data = data || line.text.starts_with("data:") || line.text.starts_with("[image]");
    matrix = matrix || line.text == "camera_matrix:" || line.text == "camera matrix";
    message = message || line.text.starts_with("binning_x:");
    for (const char* name :
         {"rectification_matrix:", "projection_matrix:", "distortion_model:", "[image]"})
      other = other || line.text.starts_with(name);
  }
  return other && !tagged && (message || (matrix && data));
}

// By their exact names, else (but for single letters without a label) as people spell them.
cv::FileNode OpenCvFile::node_of(Names names, const std::string& label) const {
  const auto found = [&](const cv::FileNode& node) {
    read_.push_back(node.name());
    return node;
  };
  for (const char* name : names)
    if (label.empty() && !storage_[name].empty()) return found(storage_[name]);
  for (const char* name : names)
    for (const std::string& spelt : {std::string(name) + "_" + label, name + label})
      if (!label.empty() && !storage_[spelt].empty()) return found(storage_[spelt]);
  for (const char* name : names)
    for (const cv::FileNode& node : storage_.root()) {
      if (label.empty() ? name[1] == '\0' : is_number(node)) continue;  // k1 is a number, K1 none
      const std::string plain = plain_name(node.name());
      if (plain == plain_name(name + label) || plain == plain_name(label + name))
        return found(node);
    }
  return {};
}

cv::Mat OpenCvFile::find(Names names, const std::string& label) const {
  const cv::FileNode node = node_of(names, label);
  if (node.empty()) return {};
  cv::Mat result;
  std::vector<double> numbers;
  try {
    if (node.isSeq() && read_list(node, numbers)) {
      result = cv::Mat(numbers, /*copyData=*/true).reshape(1, 1);
    } else if (node.isMap() && node["sizes"].empty() &&
               static_cast<double>(node["rows"]) * static_cast<double>(node["cols"]) <=
                   most_numbers) {
      cv::Mat raw;
      node >> raw;
      raw.convertTo(result, CV_64F);
    } else {
      throw cv::Exception();
    }
  } catch (const cv::Exception&) {
    // As Meshroom's "intrinsics": the first that was asked for is the camera matrix.
    if (const auto other = other_program(text_); other && read_.size() <= 1) fail(*other);
    fail_in(node, fmt::format("{} is no matrix of cv::FileStorage (!!opencv-matrix with rows, "
                              "cols, dt and data), and no list of numbers",
                              node.name()));
  }
  if (!cv::checkRange(result))
    fail_in(node, fmt::format("{} holds a number that is not finite (NaN); the calibration did "
                              "not succeed",
                              node.name()));
  return result.isContinuous() ? result : result.clone();
}

cv::Mat OpenCvFile::need(Names names, std::initializer_list<std::size_t> sizes, const char* what,
                         const std::string& label) const {
  const cv::Mat found = find(names, label);
  if (found.empty()) {
    if (const auto other = other_program(text_); other && read_.size() <= 1) fail(*other);
    std::string list;
    for (const char* name : names) list += (list.empty() ? "" : ", ") + (name + label);
    fail(fmt::format("no {}; looked for {}, and the file has {}", what, list, contents()));
  }
  const std::size_t count = found.total() * static_cast<std::size_t>(found.channels());
  if (std::ranges::count(sizes, count)) return found;
  std::string expected;
  for (const std::size_t size : sizes)
    expected += (expected.empty() ? "" : " or ") + std::to_string(size);
  fail_in(node_of(names, label),
          fmt::format("the {} has {} numbers, expected {}", what, count, expected));
}

// The names that it has, and where cameras may be that are not looked for.
std::string OpenCvFile::contents() const {
  constexpr std::size_t enough = 100;
  std::string names;
  bool nested = false;
  for (const cv::FileNode& node : storage_.root()) {
    if (names.size() < enough) names += (names.empty() ? "" : ", ") + node.name();
    nested = nested || (node.isMap() && node["data"].empty()) ||
             (node.isSeq() && node.size() > 0 && node[0].isMap());
  }
  return names +
         (nested ? ". Cameras within lists are not read: give a file for each, of one level" : "");
}

int OpenCvFile::whole(Names names) const {
  const cv::FileNode node = node_of(names);
  return is_number(node) ? whole_of(static_cast<double>(node)) : 0;
}

std::array<int, 2> OpenCvFile::picture_size(const std::string& label) const {
  if (!label.empty()) {  // EasyMocap's
    const std::array<int, 2> own{whole({("W_" + label).c_str()}), whole({("H_" + label).c_str()})};
    if (own[0] > 0 && own[1] > 0) return own;
  }
  std::array<int, 2> size{whole({"image_width", "img_width", "frame_width", "width"}),
                          whole({"image_height", "img_height", "frame_height", "height"})};
  if (size[0] > 0 && size[1] > 0) return size;
  static constexpr Names pairs = {"image_size", "img_size", "frame_size", "picture_size",
                                  "resolution", "size",     "DIM"};
  const cv::FileNode node = node_of(pairs);
  if (node.isMap() && is_number(node["width"]) && is_number(node["height"]))
    return {whole_of(static_cast<double>(node["width"])),
            whole_of(static_cast<double>(node["height"]))};
  const cv::Mat pair = node.isSeq() || node.isMap() ? find(pairs) : cv::Mat();
  for (std::size_t i = 0; i < 2 && pair.total() == 2; ++i)
    size[i] = whole_of(pair.ptr<double>()[i]);
  return size;
}

std::vector<std::string> OpenCvFile::strings(const char* name) const {
  std::vector<std::string> result;
  const cv::FileNode list = storage_[name];
  for (const cv::FileNode& item : list)
    if (list.isSeq() && item.isString()) result.push_back(static_cast<std::string>(item));
  return result;
}

std::vector<double> OpenCvFile::single_coefficients() const {
  std::vector<double> values;
  std::size_t used = 0;
  for (const char* name : {"k1", "k2", "p1", "p2", "k3"}) {
    const cv::FileNode node = storage_[name];
    values.push_back(is_number(node) ? static_cast<double>(node) : 0.0);
    if (is_number(node)) used = std::max<std::size_t>(values.size(), 4);
  }
  if (used > 0 && !storage_["k4"].empty())
    fail_in(storage_["k4"],
            "k4 is of another lens model than k1 k2 p1 p2 k3; give the coefficients as one matrix "
            "distortion_coefficients, in OpenCV's order");
  values.resize(used);
  return values;
}

void OpenCvFile::refuse_unread_distortion() const {
  for (const cv::FileNode& node : storage_.root())
    if ((node.isMap() || node.isSeq()) &&
        plain_name(node.name()).find("dist") != std::string::npos &&
        !std::ranges::count(read_, node.name()))
      fail_in(node, fmt::format("{} looks like a lens's distortion, and is under no name that is "
                                "read; call it distortion_coefficients, or take it out",
                                node.name()));
}

void OpenCvFile::refuse_board_poses() const {
  const cv::FileNode poses = node_of({"extrinsic_parameters", "rvecs", "tvecs", "per_view_poses"});
  if (!poses.empty())
    fail_in(poses, fmt::format("{} holds poses of the board, one for each picture, as OpenCV's "
                               "calibration sample writes them; the camera has none. {}",
                               poses.name(), add_poses));
}

// Coefficients of other models stand under the same names.
void OpenCvFile::refuse_other_models() const {
  const auto refuse = [&](const cv::FileNode& node, const std::string& value) {
    fail_in(node, fmt::format("{} is {}: its coefficients are those of another model than "
                              "OpenCV's ordinary one (k1 k2 p1 p2 k3). Calibrate without the "
                              "fisheye setting, or undistort the pictures first and calibrate "
                              "these",
                              node.name(), value));
  };
  for (const cv::FileNode& node : storage_.root()) {
    const std::string name = plain_name(node.name());
    if (!is_number(node) && !node.isString()) continue;
    const std::string value = node.isString() ? static_cast<std::string>(node)
                                              : fmt::format("{:g}", static_cast<double>(node));
    const std::string plain = plain_name(value);
    if (name == "xi" || name == "xi1")
      fail_in(node, fmt::format("{} is of OpenCV's omnidirectional model (cv::omnidir), whose "
                                "coefficients are not those of its ordinary one (k1 k2 p1 p2 k3). "
                                "Undistort the pictures first (cv::omnidir::undistortImage) and "
                                "calibrate these",
                                node.name()));
    if (name.find("fisheye") != name.npos && !value.empty() && plain != "0" && plain != "false" &&
        plain != "no")
      refuse(node, value);
    if (node.isString() && contains_any(name, {"model", "type", "lens", "projection", "dist"}) &&
        contains_any(plain, {"fisheye", "equidist", "kannala", "omni", "mei", "fov", "eucm",
                             "doublesphere", "thinprism"}))
      refuse(node, value);
  }
}

}  // namespace polyhull::import
