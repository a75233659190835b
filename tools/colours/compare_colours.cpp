// SPDX-License-Identifier: LGPL-2.1-or-later
#include "colours/compare_colours.h"

#include <iostream>
#include <map>

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

std::map<std::string, std::array<Vec2, 4>> read_corners(const ColourArguments& arguments,
                                                        const Rig& rig) {
  std::map<std::string, std::array<Vec2, 4>> corners;
  for (const std::string& argument : arguments.corners) {
    const std::size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    std::array<Vec2, 4> four;
    char rest = 0;
    if (equals == std::string::npos ||
        std::sscanf(argument.c_str() + equals + 1, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf%c", &four[0].x,
                    &four[0].y, &four[1].x, &four[1].y, &four[2].x, &four[2].y, &four[3].x,
                    &four[3].y, &rest) != 8)
      throw Error(Error::Kind::bad_input,
                  "--corners is '{}'; expected CAMERA=X,Y,X,Y,X,Y,X,Y, the chart's corners in "
                  "pixels at dark skin, bluish green, black and white.",
                  argument);
    if (!rig.find(name))
      throw Error(Error::Kind::bad_input, "--corners: the rig has no camera '{}'.", name);
    if (!corners.emplace(name, four).second)
      throw Error(Error::Kind::bad_input, "--corners are given twice for camera '{}'.", name);
  }
  return corners;
}

std::vector<Seen> read_charts(const Rig& rig, const ColourArguments& arguments) {
  auto corners = read_corners(arguments, rig);
  std::vector<Seen> seen;
  for (const auto& [number, path] :
       assign_files(arguments.pictures, rig, "--pictures", "polyhull-rig")) {
    const Camera& camera = rig.cameras[number];
    const auto four = corners.extract(camera.name);
    if (four.empty())
      throw Error(Error::Kind::bad_input,
                  "Camera '{0}' has no --corners; give {0}=X,Y,X,Y,X,Y,X,Y.", camera.name);
    const Picture picture = load_picture(path, 3);
    if (picture.width != camera.width || picture.height != camera.height)
      throw Error(
          Error::Kind::bad_input,
          "'{}' has {}x{} pixels, camera '{}' of the rig {}x{}; take it as the rig's camera "
          "takes its pictures.",
          path, picture.width, picture.height, camera.name, camera.width, camera.height);
    seen.push_back({camera.name, read_chart(picture, four.mapped(), camera.name), {}});
  }
  if (!corners.empty())
    throw Error(Error::Kind::bad_input, "Camera '{}' has --corners but no picture.",
                corners.begin()->first);
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

std::string compare_colours(const Rig& rig, const ColourArguments& arguments) {
  std::vector<Seen> seen = read_charts(rig, arguments);
  const std::vector<int> patches = common_patches(seen);
  for (Seen& one : seen)
    for (int patch : patches) one.colours.push_back(one.chart.linear[patch]);
  const std::vector<Vec3> wanted = reference_colours(seen, patches, arguments.reference);

  std::string table =
      fmt::format("delta E00 to {}, {} patches: mean, worst; after the matrix: mean, worst\n",
                  arguments.reference, patches.size());
  for (const Seen& one : seen) {
    const Mat3 matrix = colour_matrix(one.colours, wanted);
    const Apart before = apart(Mat3(1.0), one.colours, wanted);
    const Apart after = apart(matrix, one.colours, wanted);
    table += fmt::format("{:12} {:6.2f} {:6.2f}   {:6.2f} {:6.2f}\n", one.camera, before.mean,
                         before.worst, after.mean, after.worst);
    const auto m = to_rows(matrix);
    for (int row = 0; row < 3; ++row)
      table += fmt::format("{:12} {:9.5f} {:9.5f} {:9.5f}\n", "", m[3 * row], m[3 * row + 1],
                           m[3 * row + 2]);
  }
  return table;
}

}  // namespace polyhull
