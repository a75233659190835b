// SPDX-License-Identifier: LGPL-2.1-or-later
// polyhull-calibrate: from pictures of a board to a rig file and a report. Exits with 0 where the
// result is good, 2 where it was written but is not good, 1 where there is none.
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "board_target.h"
#include "calibrate/input.h"
#include "calibrate/live.h"
#include "calibrate/report.h"
#include "calibrate/videos.h"
#include "calibrate/wand.h"
#include "command_line.h"
#include "floor_points.h"
#include "progress.h"
#include "text_file.h"

namespace {

using namespace polyhull;
using namespace polyhull::calibrate_tool;
using calibration::Calibration;

struct Arguments {
  std::string folder, output, report, floor_view, floor_points, lenses, drawn_board;
  BoardArguments board{"9x6", "", 0.0, 0.0};
  double thickness = 0.0;  // mm
  std::vector<std::string> live;
  std::string show = "autovideosink";
  double every = 0.5;  // s
  int distortion = 5;
  bool quiet = false;
  calibration::Bar bar;
};

// Throws for what is wrong with the arguments but would be noticed only after minutes of work.
void check_arguments(const Arguments& arguments, const Pictures& pictures) {
  const auto& names = pictures.instants;
  if (!arguments.floor_view.empty() && std::ranges::count(names, arguments.floor_view) == 0)
    throw Error(Error::Kind::bad_input,
                "--floor-view is '{}'; there is no such instant. They are '{}' to '{}'.",
                arguments.floor_view, names.front(), names.back());
  if (!(arguments.thickness >= 0.0 && arguments.thickness <= 1000.0))
    throw Error(Error::Kind::bad_input, "--thickness is {}; 0 to 1000 mm can be used.",
                arguments.thickness);
  if (!arguments.floor_points.empty()) read_text(arguments.floor_points);
  for (const std::string& path : {arguments.output, arguments.report}) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder))
      throw Error(Error::Kind::not_found, "There is no folder '{}' to write '{}' into; make it.",
                  folder.string(), path);
  }
}

void find_floor(Calibration& calibration, const Arguments& arguments) {
  calibration::Floor floor;
  floor.thickness = 1e-3 * arguments.thickness;
  if (!arguments.floor_view.empty()) {
    const auto& names = calibration.take.instants;
    floor.view =
        static_cast<std::size_t>(std::ranges::find(names, arguments.floor_view) - names.begin());
  } else if (!arguments.floor_points.empty()) {
    floor.points = read_floor_points(arguments.floor_points, calibration.rig);
  } else {
    std::cout << no_floor_note(calibration.rig, "--floor-view or --floor-points");
    return;
  }
  move_to_floor(calibration, floor);
}

struct Calibrated {
  Calibration calibration;
  Pictures pictures;
  std::unique_ptr<ScratchFolder> scratch;  // in which they are, of videos
};

void say_notes(const std::string& text) {
  std::istringstream notes(text);
  for (std::string note; std::getline(notes, note);) std::cout << "note: " << note << "\n";
}

Calibrated calibrate_pictures(const Arguments& arguments, const calibration::Target& target,
                              const ProgressLine& progress) {
  std::optional<Rig> lenses;
  if (!arguments.lenses.empty()) lenses = load_rig(arguments.lenses);
  calibration::Settings settings;
  settings.model = static_cast<calibration::LensModel>(arguments.distortion);
  settings.progress = progress;
  const auto calibrated = [&](Calibrated found) {
    calibration::Take take =
        find_views(found.pictures, target, arguments.floor_view, settings.progress);
    if (lenses) use_lenses(take, *lenses);
    found.calibration = calibrate(std::move(take), settings);
    return found;
  };
  const auto listed = [&](const std::string& folder, std::unique_ptr<ScratchFolder> scratch) {
    Calibrated found{{}, list_pictures(folder), std::move(scratch)};
    check_arguments(arguments, found.pictures);
    return found;
  };
  if (!holds_videos(arguments.folder)) return calibrated(listed(arguments.folder, nullptr));
  const auto unpacked = [&](VideoStart start, UnpackedVideos& videos) {
    auto scratch = std::make_unique<ScratchFolder>();
    const std::string folder = scratch->path();
    videos = unpack_videos(arguments.folder, arguments.every, folder, start, progress);
    return listed(folder, std::move(scratch));
  };
  UnpackedVideos videos;
  Calibrated begun = unpacked(VideoStart::first_frames, videos);
  say_notes(videos.notes);
  if (!videos.starts_differ) return calibrated(std::move(begun));
  // How far it is from good, to compare.
  const auto badness = [&](const Calibrated& found) {
    return std::pair(found.calibration.faults(arguments.bar).size(),
                     found.calibration.adjusted.rms);
  };
  std::optional<Calibrated> untimed;
  std::exception_ptr fault;
  try {
    untimed = calibrated(std::move(begun));
  } catch (const Error&) {
    fault = std::current_exception();
  }
  const bool good = untimed && badness(*untimed).first == 0;
  if (!good) {
    // Times in files of one recorder tell which first frames are missing; of several they mean nothing.
    try {
      Calibrated timed = calibrated(unpacked(VideoStart::file_times, videos));
      if (!untimed || badness(timed) < badness(*untimed)) {
        say_notes(
            "the videos do not begin with the same frame, as the board shows: their times in the "
            "files count.");
        say_notes(videos.notes);
        return timed;
      }
    } catch (const Error&) {
    }
  }
  if (!untimed) std::rethrow_exception(fault);
  say_notes(
      fmt::format("by their times in the files the videos do not begin with the same frame. {}",
                  good ? "The board agrees with their first frames, so these count."
                       : "The board contradicts these times no less, so the first frames count."));
  return std::move(*untimed);
}

int run(const Arguments& arguments) {
  const calibration::Target target = target_of(arguments.board);
  if (!arguments.drawn_board.empty()) {
    save_picture(calibration::BoardFinder(target).draw(100), arguments.drawn_board);
    return 0;
  }
  if (arguments.folder.empty())
    throw Error(Error::Kind::bad_input,
                "Give the folder that holds the pictures, or --draw-board; --help tells more.");
  const ProgressLine progress(arguments.quiet);
  if (!arguments.live.empty()) {
    LiveTake take{{}, arguments.folder, arguments.show, arguments.every, arguments.quiet, {}};
    for (const std::string& source : arguments.live) take.sources.push_back(parse_source(source));
    take_live(take, target);
  }
  auto [calibration, pictures, scratch] = calibrate_pictures(arguments, target, progress);
  find_floor(calibration, arguments);

  const std::vector<std::string> faults = calibration.faults(arguments.bar);
  if (!arguments.output.empty()) write_text(rig_to_json(calibration.rig), arguments.output);
  if (!arguments.report.empty())
    write_text(report_page(calibration, pictures, faults), arguments.report);
  std::cout << report_table(calibration);
  for (std::size_t v = 0; v < calibration.take.views.size(); ++v)
    if (!calibration.adjusted.views[v].used)
      std::cout << fmt::format("left out: {}, {} ({:.2f} px)\n",
                               calibration.take.cameras[calibration.take.views[v].camera].name,
                               calibration.take.instants[calibration.take.views[v].instant],
                               calibration.adjusted.views[v].rms);
  for (const std::string& fault : faults) std::cout << "not good: " << fault << "\n";
  std::cout << fmt::format("all corners: {:.3f} px rms, a noise of {:.3f} px: {}\n",
                           calibration.adjusted.rms, calibration.adjusted.noise,
                           faults.empty() ? "good" : "not good");
  return faults.empty() ? 0 : 2;
}

void add_options(CommandLine& command, Arguments& arguments) {
  command.option(
      "folder", &arguments.folder,
      "A folder with a sub-folder of pictures (PNG, JPEG) per camera, which is named after "
      "it; pictures of one instant share their name, or the last number in it. Or a folder with a "
      "video per camera, begun together: an instant is named by its frame's number, as 000050");
  command
      .option("--live", &arguments.live,
              "A camera to take pictures from, NAME=ELEMENTS, as in 'cam0=v4l2src "
              "device=/dev/video0'; once for each. The pictures go into the folder, which must be "
              "new; a board that stands still is taken by itself, until there is enough or Ctrl-C")
      .type_name("NAME=ELEMENTS");
  command
      .option("--show", &arguments.show,
              "GStreamer elements that show live cameras, what is covered and where the board is "
              "wanted next; '': none")
      .shown();
  command
      .option("--every", &arguments.every,
              "Of videos and live cameras: seconds from one picture to the next")
      .range(0.0, 3600.0)
      .shown();
  command
      .option("--board", &arguments.board.size,
              "The board's inner corners, COLUMNSxROWS: of 10x7 squares it is 9x6")
      .shown();
  command.option("--square", &arguments.board.square, "Side of a square, mm; measure it")
      .required();
  command.option("--charuco", &arguments.board.charuco,
                 "The board is a ChArUco board with markers of this dictionary, such as 4X4_100");
  command.option("--marker", &arguments.board.marker,
                 "ChArUco: side of a marker, mm (default: 3/4 square)");
  command.option("-o,--output", &arguments.output, "Writes the rig file, in metres");
  command.option("--report", &arguments.report, "Writes a report, one HTML page");
  const Option view =
      command.option("--floor-view", &arguments.floor_view,
                     "The instant at which the board lies on the floor, face up: its middle "
                     "becomes the origin, y points up, x along its columns");
  command.option("--thickness", &arguments.thickness, "Of the board on the floor, mm").shown();
  command
      .option(
          "--floor-points", &arguments.floor_points,
          "A text file of points on the floor, lines of POINT CAMERA U V (px): the first is the "
          "origin, x points to the second; three or more, each in two cameras or more")
      .excludes(view);
  command.option("--lenses", &arguments.lenses,
                 "A rig file whose lenses are kept, so that only the poses are found");
  command
      .option("--distortion", &arguments.distortion,
              "How many coefficients: 0, 4 (k1 k2 p1 p2) or 5 (k3, too)")
      .one_of({0, 4, 5})
      .shown();
  command
      .option("--max-rms", &arguments.bar.rms,
              "Distance (root mean square, px) above which a camera is not good")
      .shown();
  command.option("--draw-board", &arguments.drawn_board,
                 "Only draws the board to print, a PNG file of 100 pixels a square");
  command.flag("--quiet", &arguments.quiet, "Shows no progress");
}

}  // namespace

int main(int count, char** values) {
  // The pictures are spread over the threads already.
  cv::setNumThreads(1);
  if (count > 1 && std::string(values[1]) == "wand") return run_wand(count - 1, values + 1);
  CommandLine command(
      "polyhull-calibrate",
      "Calibrates cameras by pictures of a board: lenses and places of all of them in one world. "
      "Exits with 0 where the result is good, with 2 where it is not, with 1 where there is none.");
  Arguments arguments;
  add_options(command, arguments);
  command.footer("polyhull-calibrate wand --help: by a light that is moved through the dark.");
  return command.run(count, values, [&] { return run(arguments); });
}
