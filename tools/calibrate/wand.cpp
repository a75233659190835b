// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/wand.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <tuple>

#include "base/error.h"
#include "calibrate/report.h"
#include "calibrate/wand_input.h"
#include "command_line.h"
#include "floor_points.h"
#include "picture_size.h"
#include "progress.h"
#include "text_file.h"

namespace polyhull::calibrate_tool {
namespace {

using calibration::Calibration;
using calibration::Take;
constexpr auto bad = Error::Kind::bad_input;

struct Arguments {
  std::string folder, detections, size, rig, output, report, floor_points;
  std::vector<std::string> between, cameras_apart;  // NAME NAME MM
  double length = 0.0, field_of_view = 60.0;        // mm, degrees
  int distortion = 5;
  bool quiet = false;
  calibration::Bar bar;
};

std::size_t place_of(const std::vector<std::string>& names, const std::string& name,
                     const char* what) {
  const auto at = std::ranges::find(names, name);
  if (at == names.end()) throw Error(bad, "There is no {} '{}'.", what, name);
  return static_cast<std::size_t>(at - names.begin());
}

double millimetres(const std::string& text, const char* option) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end) throw Error(bad, "{}: '{}' is no number of mm.", option, text);
  return 1e-3 * value;
}

// Points whose names differ in a last 'a' and 'b' only.
std::vector<std::array<std::size_t, 2>> ends_of(const std::vector<std::string>& names) {
  std::map<std::string, std::size_t> places;
  for (const std::string& name : names) places.emplace(name, places.size());
  std::vector<std::array<std::size_t, 2>> out;
  for (const auto& [name, place] : places) {
    if (!name.ends_with('a')) continue;
    const auto other = places.find(name.substr(0, name.size() - 1) + 'b');
    if (other != places.end()) out.push_back({place, other->second});
  }
  return out;
}

calibration::KnownDistance distance_of(const Arguments& arguments, bool length_given,
                                       const Take& take) {
  calibration::KnownDistance out;
  std::vector<std::string> cameras;
  for (const auto& camera : take.cameras) cameras.push_back(camera.name);
  if (!arguments.between.empty()) {
    out.instants = {{place_of(take.instants, arguments.between[0], "point"),
                     place_of(take.instants, arguments.between[1], "point")}};
    if (out.instants[0][0] == out.instants[0][1])
      throw Error(bad, "--between names one point twice; name two.");
    out.metres = millimetres(arguments.between[2], "--between");
  } else if (!arguments.cameras_apart.empty()) {
    out.cameras = {place_of(cameras, arguments.cameras_apart[0], "camera"),
                   place_of(cameras, arguments.cameras_apart[1], "camera")};
    out.metres = millimetres(arguments.cameras_apart[2], "--cameras-apart");
  } else if (length_given) {
    out.instants = ends_of(take.instants);
    out.metres = 1e-3 * arguments.length;
    if (out.instants.empty())
      throw Error(bad,
                  "--length needs the wand's two ends: points whose names differ in a last 'a' and "
                  "'b' only, such as 12a and 12b.");
  }
  return out;
}

Take read_take(const Arguments& arguments, bool wand, Pictures* pictures) {
  Take take = calibration::empty_wand_take();
  if (!arguments.folder.empty()) {
    *pictures = list_pictures(arguments.folder);
    std::vector<LightCounts> counts;
    take = find_light_views(*pictures, wand ? 2 : 1, &counts, ProgressLine(arguments.quiet));
    for (std::size_t c = 0; c < counts.size(); ++c)
      std::cout << fmt::format(
          "{}: {} pictures used; not: {} dark, {} with several lights, {} with a light too large, "
          "{} too bright\n",
          take.cameras[c].name, counts[c].used, counts[c].dark, counts[c].several,
          counts[c].too_large, counts[c].too_bright);
    return take;
  }
  int width = 0, height = 0;
  if (!arguments.size.empty()) std::tie(width, height) = picture_size("--size", arguments.size);
  read_detections(arguments.detections, width, height, take);
  if (!arguments.rig.empty() || width > 0) return take;
  throw Error(bad, "--detections needs the pictures' --size, or --rig.");
}

void use_rig(Take& take, const std::string& path, bool sizes_known) {
  const Rig rig = load_rig(path);
  if (!sizes_known)
    for (auto& camera : take.cameras)
      if (const Camera* known = rig.find(camera.name)) {
        camera.width = known->width;
        camera.height = known->height;
      }
  use_lenses(take, rig);
}

int calibrate_by(const Arguments& arguments, bool length_given) {
  if (arguments.folder.empty() == arguments.detections.empty())
    throw Error(bad, "Name a folder of pictures or --detections, one of them.");
  if (length_given && !(arguments.length > 0.0))
    throw Error(bad, "--length is {} mm; it must be above 0.", arguments.length);
  Pictures pictures;
  Take take = read_take(arguments, length_given, &pictures);
  if (!arguments.rig.empty())
    use_rig(take, arguments.rig, !arguments.folder.empty() || !arguments.size.empty());
  // Views are drawn on their pictures, of which one may show two points, or there is none.
  Pictures shown{{}, take.instants, {}};
  for (const auto& camera : take.cameras) shown.cameras.push_back(camera.name);
  shown.files.assign(take.cameras.size(), std::vector<std::string>(take.instants.size()));
  if (!arguments.folder.empty())
    for (std::size_t c = 0; c < shown.files.size(); ++c)
      for (std::size_t i = 0; i < take.instants.size(); ++i)
        shown.files[c][i] = pictures.files[c][length_given ? i / 2 : i];

  calibration::WandSettings settings;
  settings.model = static_cast<calibration::LensModel>(arguments.distortion);
  settings.field_of_view = arguments.field_of_view;
  settings.distance = distance_of(arguments, length_given, take);
  settings.progress = ProgressLine(arguments.quiet);
  Calibration calibration = calibrate_wand(std::move(take), settings);
  if (!arguments.floor_points.empty())
    move_to_floor(calibration,
                  {{}, 0.0, read_floor_points(arguments.floor_points, calibration.rig)});

  const std::vector<std::string> faults = calibration.faults(arguments.bar);
  if (!arguments.output.empty()) write_text(rig_to_json(calibration.rig), arguments.output);
  if (!arguments.report.empty())
    write_text(report_page(calibration, shown, faults), arguments.report);
  std::cout << report_table(calibration);
  if (arguments.floor_points.empty()) std::cout << no_floor_note(calibration.rig, "--floor-points");
  for (const std::string& fault : faults) std::cout << "not good: " << fault << "\n";
  std::cout << fmt::format("all points: {:.3f} px rms, a noise of {:.3f} px: {}\n",
                           calibration.adjusted.rms, calibration.adjusted.noise,
                           faults.empty() ? "good" : "not good");
  return faults.empty() ? 0 : 2;
}

}  // namespace

int run_wand(int count, char** values) {
  CommandLine command(
      "polyhull-calibrate wand",
      "Calibrates cameras by a light that is moved through the dark stage. Exits with 0 where the "
      "result is good, with 2 where it is not, with 1 where there is none.");
  Arguments arguments;
  arguments.bar.left_out = 0.3;  // reflections and mismatches are usual
  command.option("folder", &arguments.folder,
                 "A folder with a sub-folder of pictures per camera, as for boards");
  command.option("--detections", &arguments.detections,
                 "Instead of pictures: a text file, lines of POINT CAMERA U V (px)");
  command.option("--size", &arguments.size, "Of the pictures for --detections, WIDTHxHEIGHT");
  const Option length =
      command.option("--length", &arguments.length,
                     "A wand with two lights, the first brighter: their distance, mm");
  const Option between = command
                             .option("--between", &arguments.between,
                                     "Two points (instants) and their distance: NAME NAME MM")
                             .expected(3)
                             .excludes(length);
  command
      .option("--cameras-apart", &arguments.cameras_apart,
              "Two cameras and the distance of their centres: NAME NAME MM")
      .expected(3)
      .excludes(length)
      .excludes(between);
  command.option("--rig", &arguments.rig,
                 "A rig file whose lenses are kept; without it they are "
                 "found, beginning with --field-of-view");
  command.option("--field-of-view", &arguments.field_of_view, "Horizontal, degrees: a first guess")
      .range(5.0, 150.0)
      .shown();
  command.option("--distortion", &arguments.distortion, "How many coefficients: 0, 4 or 5")
      .one_of({0, 4, 5})
      .shown();
  command.option("--floor-points", &arguments.floor_points,
                 "Points on the floor, lines of POINT CAMERA U V, as for boards");
  command
      .option("--max-rms", &arguments.bar.rms,
              "Distance (root mean square, px) above which a camera is not good")
      .shown();
  command.option("-o,--output", &arguments.output, "Writes the rig file, in metres");
  command.option("--report", &arguments.report, "Writes a report, one HTML page");
  command.flag("--quiet", &arguments.quiet, "Shows no progress");
  return command.run(count, values, [&] { return calibrate_by(arguments, length.given()); });
}

}  // namespace polyhull::calibrate_tool
