// SPDX-License-Identifier: LGPL-2.1-or-later
// COLMAP's text model: cameras.txt (intrinsics) and images.txt (poses; every second line holds
// points).
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "base/error.h"
#include "rig/import.h"
#include "rig/import/lines.h"
#include "text_file.h"

namespace polyhull::import {
namespace {

constexpr std::size_t most_megabytes = 1024;  // images.txt has the points of all images

std::string read_model_text(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw Error(
        Error::Kind::not_found,
        "Cannot read '{}'; give the folder with COLMAP's cameras.txt and images.txt, such as "
        "sparse/0 (colmap model_converter --output_type TXT makes them).",
        path);
  return read_text(path, most_megabytes);
}

// A line's words, the first of which are numbers.
struct Numbers {
  const std::string& file;
  const Line& line;
  const char* expected;
  std::vector<std::string_view> words = words_of(line.text);

  [[noreturn]] void fail() const {
    const auto has_comma = [](std::string_view word) { return word.find(',') != word.npos; };
    const auto name = words.begin() + std::min<std::ptrdiff_t>(9, std::ssize(words));
    const bool commas = std::any_of(words.begin(), name, has_comma);
    fail_at(file, line.number,
            fmt::format("expected: {}{}", expected,
                        commas ? ", with blanks between them and no commas" : ""));
  }
  double number(std::size_t i) const {
    const std::optional<double> value =
        i < words.size() ? number_of(words[i]) : std::optional<double>();
    if (!value || !std::isfinite(*value)) fail();
    return *value;
  }
  int whole(std::size_t i) const {
    const double value = number(i);
    if (value != std::floor(value) || std::abs(value) > 1e9) fail();
    return static_cast<int>(value);
  }
};

// COLMAP counts pixels from the corner of the first one, rigs from its centre.
Mat3 intrinsics(double fx, double fy, double cx, double cy) {
  return from_rows({fx, 0, cx - 0.5, 0, fy, cy - 0.5, 0, 0, 1});
}

void set_model(Camera& camera, const std::string& model, const std::vector<double>& p,
               const std::string& file, std::size_t line) {
  const std::map<std::string, std::size_t> counts{{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4},
                                                  {"SIMPLE_RADIAL", 4},  {"RADIAL", 5},
                                                  {"OPENCV", 8},         {"FULL_OPENCV", 12}};
  const auto known = counts.find(model);
  if (known == counts.end())
    fail_at(
        file, line,
        fmt::format("camera model {} cannot be had in OpenCV's terms; undistort the pictures with "
                    "COLMAP first",
                    model));
  if (p.size() != known->second)
    fail_at(file, line,
            fmt::format("{} has {} parameters, found {}", model, known->second, p.size()));
  const bool one_focal = model == "SIMPLE_PINHOLE" || model == "SIMPLE_RADIAL" || model == "RADIAL";
  camera.K = one_focal ? intrinsics(p[0], p[0], p[1], p[2]) : intrinsics(p[0], p[1], p[2], p[3]);
  if (model == "SIMPLE_RADIAL") camera.distortion = {p[3], 0, 0, 0};
  if (model == "RADIAL") camera.distortion = {p[3], p[4], 0, 0};
  if (model == "OPENCV" || model == "FULL_OPENCV") camera.distortion.assign(p.begin() + 4, p.end());
  if (model == "FULL_OPENCV" && p[9] == 0.0 && p[10] == 0.0 && p[11] == 0.0)
    camera.distortion.resize(5);  // no denominator
}

bool empty_or_comment(const Line& line) {
  return line.text.empty() || line.text[0] == '#';
}

std::map<int, Camera> read_cameras(const std::string& file) {
  const std::string text = read_model_text(file);
  std::map<int, Camera> cameras;
  for (const Line& line : lines_of(text)) {
    if (empty_or_comment(line)) continue;
    const Numbers values{file, line, "id model width height parameters"};
    const int id = values.whole(0);
    Camera camera;
    camera.width = values.whole(2);
    camera.height = values.whole(3);
    std::vector<double> parameters;
    for (std::size_t i = 4; i < values.words.size(); ++i) parameters.push_back(values.number(i));
    set_model(camera, std::string(values.words[1]), parameters, file, line.number);
    if (!cameras.emplace(id, camera).second)
      fail_at(file, line.number, fmt::format("there is a camera {} before", id));
  }
  return cameras;
}

struct Image {
  std::string path;
  int camera_id;
  Camera camera;
};

Image read_image(const std::map<int, Camera>& cameras, const std::string& file, const Line& line) {
  const Numbers values{file, line, "id qw qx qy qz tx ty tz camera name"};
  std::array<double, 9> v;
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = values.number(i);
  if (values.words.size() < 10) values.fail();
  Image image;
  image.path =
      line.text.substr(static_cast<std::size_t>(values.words[9].data() - line.text.data()));
  image.camera_id = values.whole(8);
  const auto found = cameras.find(image.camera_id);
  if (found == cameras.end())
    fail_at(file, line.number, fmt::format("camera {} is not in cameras.txt", image.camera_id));
  const double w = v[1], x = v[2], y = v[3], z = v[4];
  const double size = w * w + x * x + y * y + z * z;
  if (!(std::abs(std::sqrt(size) - 1.0) < 0.02))
    fail_at(file, line.number,
            fmt::format("the rotation's quaternion (columns 2 to 5, qw qx qy qz) has length {:.3g} "
                        "instead of 1; the place comes behind it: id qw qx qy qz tx ty tz camera "
                        "name",
                        std::sqrt(size)));
  const double s = 2.0 / size;
  image.camera = found->second;
  image.camera.R = from_rows({1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
                              s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),
                              s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)});
  image.camera.t = Vec3(v[5], v[6], v[7]);
  return image;
}

// Triples x y point, of which the last is a whole number: an image's rotation is none.
bool holds_points(const Line& line) {
  const std::vector<std::string_view> words = words_of(line.text);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::optional<double> value = number_of(words[i]);
    if (!value || (i % 3 == 2 && *value != std::floor(*value))) return false;
  }
  return words.size() % 3 == 0;
}

// Throws where \p line, which comes behind that of \p image, is none of points.
void check_points(const Image& image, const std::string& file, const Line& line) {
  if (!empty_or_comment(line) && !holds_points(line))
    fail_at(file, line.number,
            fmt::format("the second line of image '{}' must be empty or hold triples of numbers (x "
                        "y point); each image has two lines, the second one empty where there are "
                        "no points",
                        image.path));
}

std::vector<Image> read_images(const std::map<int, Camera>& cameras, const std::string& file) {
  const std::string text = read_model_text(file);
  std::vector<Image> images;
  bool points_follow = false, empty_before = false;
  for (const Line& line : lines_of(text)) {
    if (points_follow) {
      check_points(images.back(), file, line);
      points_follow = false;
      empty_before = line.text.empty();
    } else if (empty_before && holds_points(line) && words_of(line.text).size() != 9) {
      // Of a file with an empty line behind each line; nine numbers may be an image without a name.
      empty_before = false;
    } else if (!empty_or_comment(line)) {
      images.push_back(read_image(cameras, file, line));
      points_follow = true;
    }
  }
  return images;
}

// By how many radians two rotations differ, if by few.
double turned(const Mat3& a, const Mat3& b) {
  const Mat3 off = a - b;
  return std::sqrt(
      0.5 * (glm::dot(off[0], off[0]) + glm::dot(off[1], off[1]) + glm::dot(off[2], off[2])));
}

std::string folder_of(std::string path) {
  std::ranges::replace(path, '\\', '/');
  return std::filesystem::path(path).parent_path().string();
}

// The diagonal of the box around where they stand.
double size_of(const std::vector<Image>& images) {
  Vec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const Image& image : images) {
    low = glm::min(low, image.camera.centre());
    high = glm::max(high, image.camera.centre());
  }
  return glm::length(high - low);
}

// Notes images of one camera in one folder that stand too far apart to be taken for one, yet so near
// that they may be: COLMAP's poses of a still camera's instants differ where few points are found.
void note_spread(const std::vector<Image>& images, const Options& options) {
  constexpr double likely_still = 0.1;  // of the rig's size
  std::map<std::pair<int, std::string>, std::vector<Image>> groups;
  for (const Image& image : images)
    groups[{image.camera_id, folder_of(image.path)}].push_back(image);
  for (const auto& [key, group] : groups) {
    const double share = size_of(group) / size_of(images);
    if (group.size() < 2 || !(share <= likely_still)) continue;
    double angle = 0.0;
    for (const Image& image : group)
      angle = std::max(angle, turned(group.front().camera.R, image.camera.R));
    options.note(fmt::format(
        "COLMAP's camera {} becomes {} cameras ('{}', '{}', and so on): these images stand up to "
        "{:.1f} % of the rig's size and {:.1f} degrees apart. If they are instants of one still "
        "camera, leave one of them in images.txt, or give COLMAP the pictures of one instant",
        key.first, group.size(), group[0].path, group[1].path, 100.0 * share, glm::degrees(angle)));
  }
}

// Of images of one camera in one folder that stand at the same place, the first: a still camera's
// pictures of several instants, whose poses COLMAP finds apart. Where it was not told otherwise, each
// picture is of a camera of its own; then a folder whose pictures all stand there is one.
std::vector<Image> first_instants(std::vector<Image> images, const Options& options) {
  constexpr double same_place = 0.005, same_direction = 0.01;  // of the rig's size; radians
  const double near = same_place * size_of(images);
  const auto together = [&](const Camera& a, const Camera& b) {
    return glm::length(a.centre() - b.centre()) <= near && turned(a.R, b.R) <= same_direction;
  };
  std::map<std::string, Camera> first_of_folder;
  std::set<std::string> spread{""};  // folders of several places, or none
  for (const Image& image : images) {
    const std::string folder = folder_of(image.path);
    const auto [first, is_new] = first_of_folder.try_emplace(folder, image.camera);
    if (!is_new && !together(first->second, image.camera)) spread.insert(folder);
  }
  std::vector<Image> kept;
  std::size_t left_out = 0;
  for (Image& image : images) {
    const auto same = [&](const Image& other) {
      const std::string folder = folder_of(image.path);
      return folder == folder_of(other.path) && together(other.camera, image.camera) &&
             (other.camera_id == image.camera_id || !spread.contains(folder));
    };
    if (const auto first = std::ranges::find_if(kept, same); first == kept.end()) {
      kept.push_back(std::move(image));
    } else if (left_out++ == 0) {
      options.note(fmt::format(
          "several images are of one camera at one place, as of several instants: of these only "
          "the first is taken ('{}', not '{}', and so on)",
          first->path, image.path));
    }
  }
  note_spread(kept, options);
  return kept;
}

}  // namespace

Rig colmap(const std::string& folder, const Options& options) {
  const std::filesystem::path given(folder);
  const auto path = std::filesystem::is_regular_file(given) ? given.parent_path() : given;
  const std::map<int, Camera> cameras = read_cameras((path / "cameras.txt").string());
  const std::string file = (path / "images.txt").string();
  Rig rig;
  std::vector<std::string> paths;
  for (Image& image : first_instants(read_images(cameras, file), options)) {
    rig.cameras.push_back(std::move(image.camera));
    paths.push_back(std::move(image.path));
  }
  const std::vector<std::string> names = distinct_names(paths);
  for (std::size_t i = 0; i < names.size(); ++i) rig.cameras[i].name = names[i];
  return finished(rig, file);
}

}  // namespace polyhull::import
