// SPDX-License-Identifier: LGPL-2.1-or-later
// polyhull-rig: where to put cameras, calibrations of other programs as rig files, what is wrong
// with a rig and what to expect of it, and the built-in rig as a file.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

#include "base/error.h"
#include "board_target.h"
#include "builtin/default_rig.h"
#include "camera_files.h"
#include "colours/match_colours.h"
#include "colours/overlap_colours.h"
#include "command_line.h"
#include "floor_points.h"
#include "mask_contours.h"
#include "rig/check.h"
#include "rig/check_pictures.h"
#include "rig/export.h"
#include "rig/import.h"
#include "rig/lens.h"
#include "rig/level.h"
#include "rig/level_board.h"
#include "rig/plan.h"
#include "rig/refine.h"
#include "text_file.h"

namespace {

using namespace polyhull;

struct ImportArguments {
  std::string format;
  std::vector<std::string> files;
  std::vector<double> bounds, up;
  std::string size, unit = "m", output;
  import::Options options;
};

const std::string& only_file(const ImportArguments& arguments) {
  if (arguments.files.size() != 1)
    throw Error(Error::Kind::bad_input, "{} takes one file or folder, {} were given.",
                arguments.format, arguments.files.size());
  return arguments.files.front();
}

Rig import_rig(const ImportArguments& arguments) {
  if (arguments.format == "middlebury")
    return import::middlebury(only_file(arguments), arguments.options);
  if (arguments.format == "pmatrices")
    return import::projection_matrices(arguments.files, arguments.options);
  if (arguments.format == "text") return import::text(only_file(arguments), arguments.options);
  if (arguments.format == "opencv") return import::opencv(arguments.files, arguments.options);
  if (arguments.format == "bouguet") return import::bouguet(arguments.files, arguments.options);
  if (arguments.format == "kalibr") return import::kalibr(only_file(arguments), arguments.options);
  if (arguments.format == "opentrackio")
    return import::opentrackio(arguments.files, arguments.options);
  return import::colmap(only_file(arguments), arguments.options);
}

// To a file, or to standard output where \p path is empty.
void write(const std::string& text, const std::string& path) {
  if (path.empty()) {
    std::cout << text;
    return;
  }
  write_text(text, path);
}

void write(const Rig& rig, const std::string& path) {
  write(rig_to_json(rig), path);
}

void run_export(const Rig& rig, const std::string& format, const std::string& path) {
  if (format == "rig") return write(rig, path);
  if (format == "kalibr") return write(exported::kalibr(rig), path);
  if (path.empty())
    throw Error(Error::Kind::bad_input,
                "--format {} writes several files: name a folder with --output.", format);
  format == "opencv" ? exported::opencv(rig, path) : exported::colmap(rig, path);
}

// The built-in rig where \p file is empty.
Rig rig_of(const std::string& file) {
  return open_rig(file);
}

int run_import(ImportArguments& arguments) {
  if (!arguments.size.empty()) {
    char rest = 0;
    if (std::sscanf(arguments.size.c_str(), "%dx%d%c", &arguments.options.width,
                    &arguments.options.height, &rest) != 2 ||
        arguments.options.width < 1 || arguments.options.height < 1)
      throw Error(Error::Kind::bad_input, "--size is '{}'; expected WIDTHxHEIGHT, such as 720x576.",
                  arguments.size);
  }
  const auto note = [](const std::string& text) {
    std::cerr << "polyhull-rig: note: " << text << "\n";
  };
  arguments.options.note = note;
  Rig rig = import_rig(arguments);
  rig.unit = arguments.unit;
  if (!arguments.up.empty()) rig.up = Vec3(arguments.up[0], arguments.up[1], arguments.up[2]);
  if (!arguments.bounds.empty()) {
    const std::vector<double>& b = arguments.bounds;
    rig.bounds = Bounds{Vec3(b[0], b[1], b[2]), Vec3(b[3], b[4], b[5])};
  }
  validate_rig(rig, arguments.files.front());
  write(rig, arguments.output);
  for (const std::string& warning : examine_rig(rig).warnings) note(warning);
  return 0;
}

// \p forecast: whether to simulate the figure, where no pictures are given.
int run_check(const std::string& file, const std::vector<std::string>& files,
              const MaskSettings& settings, bool forecast) {
  const Rig rig = rig_of(file);
  RigReport report = examine_rig(rig);
  if (!files.empty()) {
    std::vector<CameraPictureRings> pictures;
    for (const auto& [camera, path] : assign_files(files, rig, "--pictures", "polyhull-rig"))
      pictures.push_back({camera, contours_of_picture(path, rig.cameras[camera], settings)});
    RigReport pictured = examine_pictures(rig, pictures);
    report.table += pictured.table;
    for (std::string& warning : pictured.warnings) report.warnings.push_back(std::move(warning));
  }
  std::cout << report.table;
  for (const std::string& warning : report.warnings) std::cout << "note: " << warning << "\n";
  if (report.warnings.empty()) std::cout << "nothing found wrong\n";
  const bool lenses = std::ranges::none_of(
      rig.cameras, [](const Camera& camera) { return lost_share(camera) > most_lost; });
  if (forecast && files.empty())
    std::cout << std::flush
              << (lenses ? forecast_text(rig) : "no forecast for lenses that cannot be inverted\n");
  return 0;
}

struct LevelArguments {
  std::string file, floor_points, output;
  std::vector<double> points, up, origin;
  std::vector<std::string> pictures;
  double height = NAN, thickness = 0.0;  // mm the latter
  BoardArguments board;
  MaskSettings mask;
  LevelRequest request;
};

// Fills the request by the pictures: of a board on the floor, or of somebody who stands there.
void read_level_pictures(const LevelArguments& arguments, Rig rig, LevelRequest& request,
                         std::string& text) {
  const auto pictures = assign_files(arguments.pictures, rig, "--pictures", "polyhull-rig");
  if (arguments.board.size.empty()) {
    for (const auto& [camera, path] : pictures)
      request.standing.push_back(
          {camera, contours_of_picture(path, rig.cameras[camera], arguments.mask)});
    return;
  }
  if (pictures.empty() || !(arguments.board.square > 0.0))
    throw Error(
        Error::Kind::bad_input,
        "--board needs --square, the side of a square in mm, and --pictures of the board on "
        "the floor.");
  if (!(arguments.thickness >= 0.0 && arguments.thickness <= 1000.0))
    throw Error(Error::Kind::bad_input, "--thickness is {}; 0 to 1000 mm can be used.",
                arguments.thickness);
  if (!request.unit.empty()) rig.unit = request.unit;
  const BoardFloor floor =
      floor_by_board(rig, target_of(arguments.board), 1e-3 * arguments.thickness, pictures);
  request.board = floor.frame;
  text = floor.text;
}

int run_level(LevelArguments& arguments) {
  const Rig rig = rig_of(arguments.file);
  LevelRequest& request = arguments.request;
  if (!arguments.floor_points.empty())
    request.points = read_floor_points(arguments.floor_points, rig);
  if (arguments.points.size() % 3 != 0)
    throw Error(Error::Kind::bad_input,
                "--points takes x y z of each point; {} numbers were given.",
                arguments.points.size());
  for (std::size_t i = 0; i < arguments.points.size(); i += 3)
    request.points.emplace_back(arguments.points[i], arguments.points[i + 1],
                                arguments.points[i + 2]);
  if (!std::isnan(arguments.height)) request.height = arguments.height;
  std::string found;
  read_level_pictures(arguments, rig, request, found);
  const auto vector = [](const std::vector<double>& v) {
    return v.empty() ? std::nullopt : std::optional(Vec3(v[0], v[1], v[2]));
  };
  request.up = vector(arguments.up);
  request.origin = vector(arguments.origin);
  const LevelledRig levelled = level_rig(rig, request);
  std::cout << found << levelled.text;
  for (const std::string& warning : examine_rig(levelled.rig).warnings)
    std::cout << "note: " << warning << "\n";
  write(levelled.rig, arguments.output);
  return 0;
}

void add_level_options(CommandLine& command, LevelArguments& arguments) {
  command.option("file", &arguments.file, "The rig file").required();
  command.option(
      "--floor-points", &arguments.floor_points,
      "A text file of three points on the floor or more, lines of POINT CAMERA U V (px), "
      "each point in two cameras or more: the first becomes the origin, x points to the "
      "second");
  command.option("--points", &arguments.points,
                 "X Y Z X Y Z X Y Z ...: the same points by their places in the rig's world");
  command.option("--floor", &arguments.height, "The floor's height along up, in the rig's world");
  command.option(
      "--pictures", &arguments.pictures,
      "CAMERA=FILE ...: somebody who stands on the floor, as for check; up must be right. With "
      "--board one or more pictures of the board");
  const Option board = command.option(
      "--board", &arguments.board.size,
      "The pictures show a board that lies on the floor, face up, with COLUMNSxROWS inner "
      "corners: its middle becomes the origin, x points along its columns");
  command.option("--square", &arguments.board.square, "Side of a square of the board, mm")
      .needs(board);
  command
      .option("--charuco", &arguments.board.charuco,
              "The board is a ChArUco board with markers of this dictionary, such as 4X4_100")
      .needs(board);
  command
      .option("--marker", &arguments.board.marker,
              "ChArUco: side of a marker, mm (default: 3/4 square)")
      .needs(board);
  command.option("--thickness", &arguments.thickness, "Of the board, mm").shown().needs(board);
  command.option("--keep-largest", &arguments.mask.keep_largest, "As of check")
      .range(0, 1000)
      .shown();
  command
      .option("--up", &arguments.up,
              "Direction that points up in the rig's world: x y z (default: as the rig says; of "
              "points, where the cameras are)")
      .expected(3);
  command
      .option("--origin", &arguments.origin,
              "x y z in the rig's world: the new origin is the floor's point below (default: the "
              "first point, or below the middle of the stage)")
      .expected(3);
  command.option("--unit", &arguments.request.unit,
                 "Unit of the rig's lengths, which stay as they are: m, cm, mm, in, ft or a number "
                 "of metres (default: as the rig says)");
  command.option("--stage", &arguments.request.stage,
                 "The bounds, around the origin from the floor up: WIDTHxDEPTHxHEIGHT (x, z, y), "
                 "metres (default: .7 of the cameras' distance to each side)");
  command.option("-o,--output", &arguments.output, "The new rig file").required();
}

void add_plan_options(CommandLine& command, PlanArguments& arguments) {
  PlanRequest& request = arguments.request;
  command.option("--cameras", &request.cameras, "How many cameras, 2 to 64").shown();
  command
      .option("--stage", &arguments.stage,
              "Where the person moves: WIDTHxDEPTHxHEIGHT (x, z, y), metres")
      .shown();
  command
      .option("--picture", &arguments.picture,
              "A camera's picture, WIDTHxHEIGHT px; 1080x1920 for cameras on their side")
      .shown();
  command.option("--fov", &request.fov, "Degrees from the left to the right edge of the picture")
      .shown();
  command.option("--distance", &arguments.distance,
                 "Metres from the stage's axis to each camera, where a person in the middle "
                 "must fit into the picture (default: as near as the whole stage fits)");
  command.option(
      "--room", &arguments.room,
      "WIDTHxDEPTH (x, z) of the room around the stage, metres: cameras stand .3 m off its "
      "walls, nearer than --distance where these are nearer");
  command.option("--heights", &request.heights,
                 "Heights at which cameras may stand, metres above the floor (default: 0.35, "
                 "0.65 and 1 times the stage's height)");
  command.option("--drawing", &arguments.drawing, "Draws the plan from above, an SVG file");
  command.option("-o,--output", &arguments.output, "Writes a rig file to start from");
}

}  // namespace

int main(int count, char** values) {
  CommandLine command("polyhull-rig",
                      "Rig files: plan cameras, import other programs' calibrations, check them.");

  ImportArguments arguments;
  CommandLine import_command = command.subcommand(
      "import", "Turns a calibration into a rig file on standard output, or into --output.");
  import_command
      .option("format", &arguments.format,
              "middlebury (*_par.txt), pmatrices (3x4 matrices), text (name K distortion R t per "
              "line), opencv (XML or YAML per camera, or intrinsics and extrinsics of a stereo "
              "pair), bouguet (Calib_Results.m per camera), colmap (folder with cameras.txt and "
              "images.txt), kalibr (camchain.yaml), opentrackio (a JSON sample per camera)")
      .required()
      .one_of({"middlebury", "pmatrices", "text", "opencv", "bouguet", "colmap", "kalibr",
               "opentrackio"});
  import_command.option("files", &arguments.files, "Files or folders to read").required();
  import_command.option("--size", &arguments.size, "Size of the pictures, WIDTHxHEIGHT px");
  import_command
      .option("--bounds", &arguments.bounds,
              "Working volume: least x y z, greatest x y z, in the calibration's unit")
      .expected(6);
  import_command.option("--up", &arguments.up, "Direction that points up: x y z (default 0 1 0)")
      .expected(3);
  import_command.option("--unit", &arguments.unit,
                        "Unit of the calibration: m, cm, mm, in, ft or a number of metres");
  import_command.option("--names", &arguments.options.name,
                        "Names for cameras without one (default cam%d)");
  import_command.option("--first", &arguments.options.first,
                        "Number of the first such camera (default 0)");
  import_command.option("--board", &arguments.options.board,
                        "bouguet: number of the board picture that is the world (default 1)");
  import_command.flag("--prototype-axes", &arguments.options.prototype_axes,
                      "bouguet: the world's x, y, z are y, -x, z of the board, as in the 2005 "
                      "prototype");
  import_command.option("-o,--output", &arguments.output, "File to write");

  std::string file;
  CommandLine check_command =
      command.subcommand("check",
                         "Prints what is wrong with a rig file, a table of its cameras, how near a "
                         "person's hull will be "
                         "to the person, and where one camera more would bring most.");
  check_command.option("file", &file, "The rig file; without one, the built-in rig");
  std::vector<std::string> pictures;
  MaskSettings mask;
  check_command.option(
      "--pictures", &pictures,
      "CAMERA=FILE ...: pictures (PNG, JPEG) of one subject at one instant, to find cameras that "
      "contradict each other: masks (grey, or alpha) or pictures before a coloured screen; a FILE "
      "alone goes to the camera with whose name it begins, else to the next one without a picture");
  check_command
      .option("--keep-largest", &mask.keep_largest,
              "Looks at this many pieces of each picture's matte only, the largest; 0: all")
      .range(0, 1000)
      .shown();
  check_command.option("--sigma", &mask.sigma, "Blur of the pictures' mattes, px")
      .range(0.0, 100.0)
      .shown();

  bool no_forecast = false;
  check_command.flag("--no-forecast", &no_forecast,
                     "Leaves out the simulation, which takes seconds; so do --pictures");

  PlanArguments plan;
  CommandLine plan_command = command.subcommand(
      "plan",
      "Finds places for cameras around a stage, simulates a person there, prints what to "
      "expect.");
  add_plan_options(plan_command, plan);

  std::string refined, refine_output;
  RefineArguments refine;
  CommandLine refine_command = command.subcommand(
      "refine",
      "Finds where cameras really stand, from pictures of somebody who walked between them, all "
      "cameras at the same instants.");
  refine_command.option("file", &refined, "The rig file").required();
  refine_command
      .option("--pictures", &refine.folders,
              "CAMERA=FOLDER ...: each camera's pictures (PNG, JPEG; masks or before a "
              "coloured screen), whose names end in the number of their instant; 20 instants "
              "and more, all over the stage")
      .required();
  refine_command.option("--only", &refine.only,
                        "CAMERA ...: only these move, as one that was bumped");
  refine_command.option("--keep-largest", &refine.mask.keep_largest, "As of check")
      .range(0, 1000)
      .shown();
  refine_command.option("-o,--output", &refine_output, "The new rig file").required();

  LevelArguments level;
  CommandLine level_command = command.subcommand(
      "level", "Makes the world stand on the floor, y up, with bounds that begin there.");
  add_level_options(level_command, level);

  std::string coloured, colours_output;
  bool overlaps = false;
  ColourArguments colours;
  CommandLine colours_command = command.subcommand(
      "colours",
      "Prints how far the cameras' colours lie apart (CIEDE2000) on a colour checker of 24 "
      "patches or a grey card, and the 3x3 matrix for linear light that brings each to the "
      "reference; writes the rig file with these matrices, which hulltexture and composite apply.");
  colours_command.option("file", &coloured, "The rig file").required();
  colours_command
      .option("--pictures", &colours.pictures,
              "CAMERA=FILE ...: pictures (PNG, JPEG) with the chart, card or subject")
      .required();
  colours_command.option(
      "--corners", &colours.corners,
      "CAMERA=X,Y,X,Y,X,Y,X,Y ...: the outer corners of the patches dark skin, bluish "
      "green, black and white in the camera's picture, px");
  colours_command.option("--grey", &colours.grey,
                         "CAMERA=LEFT,TOP,RIGHT,BOTTOM ...: instead of --corners a rectangle "
                         "within a grey card, px; a gain for each channel comes of it");
  colours_command
      .option(
          "--reference", &colours.reference,
          "mean of the cameras, chart (its published values; of a card: grey) or a camera's name")
      .shown();
  colours_command.flag("--overlaps", &overlaps,
                       "Instead of --corners: by what cameras see of the same places of a "
                       "subject. The pictures are of one instant, with its matte in their alpha "
                       "(PNG); a gain for each channel is added to the rig's matrices");
  colours_command.option("-o,--output", &colours_output,
                         "The rig file to write, with the matrices (`colour` of each camera)");

  std::string exported, export_output, export_format = "rig";
  CommandLine export_command = command.subcommand(
      "export",
      "Writes the built-in rig, or a normalised copy of a rig file (K, R and t instead of P, true "
      "rotations, up and unit written out), to standard output or into --output; or the cameras "
      "for "
      "other programs.");
  export_command.option("file", &exported, "The rig file; without one, the built-in rig");
  export_command
      .option("--format", &export_format,
              "rig, opencv (a YAML file per camera), colmap (cameras.txt, images.txt), kalibr "
              "(camchain.yaml)")
      .one_of({"rig", "opencv", "colmap", "kalibr"})
      .shown();
  export_command.option("-o,--output", &export_output,
                        "File to write; of opencv and colmap the folder, which is made");

  return command.run(count, values, [&] {
    if (import_command.given()) return run_import(arguments);
    if (check_command.given()) return run_check(file, pictures, mask, !no_forecast);
    if (plan_command.given()) {
      const Rig rig = run_plan(plan);
      if (!plan.output.empty()) write(rig, plan.output);
      return 0;
    }
    if (level_command.given()) return run_level(level);
    if (refine_command.given()) {
      write(refine_rig(rig_of(refined), refine), refine_output);
      return 0;
    }
    if (colours_command.given()) {
      Rig rig = rig_of(coloured);
      if (overlaps && !(colours.corners.empty() && colours.grey.empty()))
        throw Error(Error::Kind::bad_input, "--overlaps goes without --corners and --grey.");
      std::cout << (overlaps ? match_overlaps(rig, colours.pictures) : match_colours(rig, colours));
      if (!colours_output.empty()) write(rig, colours_output);
      return 0;
    }
    run_export(rig_of(exported), export_format, export_output);
    return 0;
  });
}
