// SPDX-License-Identifier: LGPL-2.1-or-later
#include "colours/match_colours.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <sstream>

#include "base/colour_difference.h"
#include "base/error.h"
#include "camera_files.h"
#include "studio/calibration/colour_chart.h"

namespace polyhull {
namespace {

constexpr std::size_t least_patches = 6;

struct Seen {
  std::string camera;
  ChartColours chart;
  std::vector<Vec3> colours;  // linear, of the patches that all cameras hold
};

/// An option that says where in each camera's picture something is.
struct Where {
  const char* option;
  const char* form;
  const char* what;
  std::size_t points;
};
constexpr Where chart{"--corners", "X,Y,X,Y,X,Y,X,Y",
                      "the chart's corners in pixels at dark skin, bluish green, black and white",
                      4};
constexpr Where card{"--grey", "LEFT,TOP,RIGHT,BOTTOM",
                     "a rectangle within the grey card in pixels", 2};

/// By camera.
std::map<std::string, std::vector<Vec2>> read_points(const std::vector<std::string>& arguments,
                                                     const Where& where, const Rig& rig) {
  std::map<std::string, std::vector<Vec2>> all;
  for (const std::string& argument : arguments) {
    const std::size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    std::vector<Vec2> points(where.points);
    std::istringstream numbers(equals == std::string::npos ? "" : argument.substr(equals + 1));
    for (std::size_t i = 0; i < 2 * where.points; ++i) {
      char comma = ',';
      if (i > 0) numbers >> comma;
      numbers >> points[i / 2][static_cast<int>(i % 2)];
      if (comma != ',') numbers.setstate(std::ios::failbit);
    }
    if (!numbers || numbers.peek() != std::istringstream::traits_type::eof())
      throw Error(Error::Kind::bad_input, "{} is '{}'; expected CAMERA={}, {}.", where.option,
                  argument, where.form, where.what);
    if (!rig.find(name))
      throw Error(Error::Kind::bad_input, "{}: the rig has no camera '{}'.", where.option, name);
    if (!all.emplace(name, points).second)
      throw Error(Error::Kind::bad_input, "{} are given twice for camera '{}'.", where.option,
                  name);
  }
  return all;
}

/// Which patches a camera sees, in which colours; of a card the one "patch" that stands for it.
ChartColours read_one(const Picture& picture, const std::vector<Vec2>& at,
                      const std::string& camera) {
  if (at.size() == chart.points) return read_chart(picture, {at[0], at[1], at[2], at[3]}, camera);
  ChartColours colours;
  colours.clipped.fill(true);
  colours.clipped[0] = false;
  colours.linear[0] = read_card(picture, at[0], at[1], camera);
  return colours;
}

std::vector<Seen> read_pictures(const Rig& rig, const ColourArguments& arguments) {
  const Where& where = arguments.grey.empty() ? chart : card;
  auto corners =
      read_points(arguments.grey.empty() ? arguments.corners : arguments.grey, where, rig);
  std::vector<Seen> seen;
  for (const auto& [number, path] :
       assign_files(arguments.pictures, rig, "--pictures", "polyhull-rig")) {
    const Camera& camera = rig.cameras[number];
    const auto four = corners.extract(camera.name);
    if (four.empty())
      throw Error(Error::Kind::bad_input, "Camera '{0}' has no {1}; give {0}={2}.", camera.name,
                  where.option, where.form);
    const Picture picture = load_picture(path, 3);
    if (picture.width != camera.width || picture.height != camera.height)
      throw Error(
          Error::Kind::bad_input,
          "'{}' has {}x{} pixels, camera '{}' of the rig {}x{}; take it as the rig's camera "
          "takes its pictures.",
          path, picture.width, picture.height, camera.name, camera.width, camera.height);
    seen.push_back({camera.name, read_one(picture, four.mapped(), camera.name), {}});
  }
  if (!corners.empty())
    throw Error(Error::Kind::bad_input, "Camera '{}' has {} but no picture.",
                corners.begin()->first, where.option);
  return seen;
}

// The patches that no camera clips; those that some clip are named.
std::vector<int> common_patches(const std::vector<Seen>& seen) {
  std::vector<int> common;
  std::string lost;
  for (int patch = 0; patch < chart_patches; ++patch) {
    std::string by;
    for (const Seen& one : seen)
      if (one.chart.clipped[patch]) by += (by.empty() ? "" : " ") + one.camera;
    if (by.empty())
      common.push_back(patch);
    else
      lost += fmt::format("{}{} ({})", lost.empty() ? "" : ", ", chart_patch_name(patch), by);
  }
  if (!lost.empty())
    std::cerr << "polyhull-rig: note: left out as over- or underexposed: " << lost << "\n";
  if (common.size() < least_patches)
    throw Error(Error::Kind::bad_input,
                "Only {} of {} patches are well exposed in all cameras; {} are needed. Mend the "
                "exposure of the cameras named above.",
                common.size(), chart_patches, least_patches);
  return common;
}

std::vector<Vec3> reference_colours(const std::vector<Seen>& seen, const std::vector<int>& patches,
                                    const std::string& reference) {
  for (const Seen& one : seen)
    if (one.camera == reference) return one.colours;
  std::vector<Vec3> colours(patches.size(), Vec3(0.0));
  if (reference == "chart") {
    for (std::size_t i = 0; i < patches.size(); ++i) colours[i] = published_chart()[patches[i]];
    return colours;
  }
  if (reference != "mean")
    throw Error(Error::Kind::bad_input,
                "--reference is '{}'; expected mean, chart or a camera with a picture.", reference);
  for (const Seen& one : seen)
    for (std::size_t i = 0; i < patches.size(); ++i)
      colours[i] += one.colours[i] / static_cast<double>(seen.size());
  return colours;
}

/// The card's light: without a colour where it is to be grey, as bright as the cameras see it.
std::vector<Vec3> reference_grey(const std::vector<Seen>& seen, const std::string& reference) {
  if (reference != "chart") return reference_colours(seen, {0}, reference);
  const Vec3 mean = reference_colours(seen, {0}, "mean")[0];
  return {Vec3(glm::dot(mean, Vec3(0.2126729, 0.7151522, 0.0721750)))};
}

struct Apart {
  double mean = 0.0, worst = 0.0;
};

Apart apart(const Mat3& matrix, const std::vector<Vec3>& colours, const std::vector<Vec3>& wanted) {
  Apart result;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const double difference =
        colour_difference(lab_of_linear(matrix * colours[i]), lab_of_linear(wanted[i]));
    result.mean += difference / static_cast<double>(colours.size());
    result.worst = std::max(result.worst, difference);
  }
  return result;
}

}  // namespace

std::string match_colours(Rig& rig, const ColourArguments& arguments) {
  const bool grey = !arguments.grey.empty();
  if (grey == !arguments.corners.empty())
    throw Error(Error::Kind::bad_input,
                "Give either --corners of a colour checker, --grey of a grey card or --overlaps.");
  std::vector<Seen> seen = read_pictures(rig, arguments);
  const std::vector<int> patches = grey ? std::vector<int>{0} : common_patches(seen);
  for (Seen& one : seen)
    for (int patch : patches) one.colours.push_back(one.chart.linear[patch]);
  const std::vector<Vec3> wanted = grey ? reference_grey(seen, arguments.reference)
                                        : reference_colours(seen, patches, arguments.reference);

  std::string table = fmt::format(
      "delta E00 to {}, {}: mean, worst; after the matrix: mean, worst\n", arguments.reference,
      grey ? "a grey card" : fmt::format("{} patches", patches.size()));
  for (const Seen& one : seen) {
    const Vec3 gain = wanted[0] / one.colours[0];
    const Mat3 matrix =
        grey ? Mat3(gain.r, 0, 0, 0, gain.g, 0, 0, 0, gain.b) : colour_matrix(one.colours, wanted);
    const Apart before = apart(Mat3(1.0), one.colours, wanted);
    const Apart after = apart(matrix, one.colours, wanted);
    table += fmt::format("{:12} {:6.2f} {:6.2f}   {:6.2f} {:6.2f}\n", one.camera, before.mean,
                         before.worst, after.mean, after.worst);
    const auto m = to_rows(matrix);
    for (int row = 0; row < 3; ++row)
      table += fmt::format("{:12} {:9.5f} {:9.5f} {:9.5f}\n", "", m[3 * row], m[3 * row + 1],
                           m[3 * row + 2]);
    const auto camera = std::find_if(rig.cameras.begin(), rig.cameras.end(),
                                     [&](const Camera& c) { return c.name == one.camera; });
    camera->colour = matrix;
  }
  validate_rig(rig, "the matrices found");
  return table;
}

}  // namespace polyhull
