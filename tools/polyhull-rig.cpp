// SPDX-License-Identifier: LGPL-2.1-or-later
// polyhull-rig: where to put cameras, calibrations of other programs as rig files, what is wrong
// with a rig and what to expect of it, and the built-in rig as a file.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "board_target.h"
#include "builtin/default_rig.h"
#include "camera_files.h"
#include "colours/match_colours.h"
#include "colours/overlap_colours.h"
#include "command_line.h"
#include "floor_points.h"
#include "mask_contours.h"
#include "picture_size.h"
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

int run_import(ImportArguments& arguments) {
  if (!arguments.size.empty())
    std::tie(arguments.options.width, arguments.options.height) =
        picture_size("--size", arguments.size);
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
  const Rig rig = open_rig(file);
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
  const Rig rig = open_rig(arguments.file);
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

struct CheckArguments {
  std::string file;
  std::vector<std::string> pictures;
  MaskSettings mask;
  bool no_forecast = false;
};

struct RefineFiles {
  std::string file, output;
  RefineArguments refine;
};

struct ColourFiles {
  std::string file, output;
  bool overlaps = false;
  ColourArguments colours;
};

struct ExportArguments {
  std::string file, output, format = "rig";
};

int run_colours(const ColourFiles& arguments) {
  const ColourArguments& colours = arguments.colours;
  Rig rig = open_rig(arguments.file);
  if (arguments.overlaps && !(colours.corners.empty() && colours.grey.empty()))
    throw Error(Error::Kind::bad_input, "--overlaps goes without --corners and --grey.");
  std::cout << (arguments.overlaps ? match_overlaps(rig, colours.pictures)
                                   : match_colours(rig, colours));
  if (!arguments.output.empty()) write(rig, arguments.output);
  return 0;
}

// A subcommand's options, and what runs once they are parsed.
struct Subcommand {
  CommandLine line;
  std::function<int()> run;
};

Subcommand import_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<ImportArguments>();
  CommandLine line = command.subcommand(
      "import", "Turns a calibration into a rig file on standard output, or into --output.");
  line.option("format", &arguments->format,
              "middlebury (*_par.txt), pmatrices (3x4 matrices), text (name K distortion R t per "
              "line), opencv (XML or YAML per camera, or intrinsics and extrinsics of a stereo "
              "pair), bouguet (Calib_Results.m per camera), colmap (folder with cameras.txt and "
              "images.txt), kalibr (camchain.yaml), opentrackio (a JSON sample per camera)")
      .required()
      .one_of({"middlebury", "pmatrices", "text", "opencv", "bouguet", "colmap", "kalibr",
               "opentrackio"});
  line.option("files", &arguments->files, "Files or folders to read").required();
  line.option("--size", &arguments->size, "Size of the pictures, WIDTHxHEIGHT px");
  line.option("--bounds", &arguments->bounds,
              "Working volume: least x y z, greatest x y z, in the calibration's unit")
      .expected(6);
  line.option("--up", &arguments->up, "Direction that points up: x y z (default 0 1 0)")
      .expected(3);
  line.option("--unit", &arguments->unit,
              "Unit of the calibration: m, cm, mm, in, ft or a number of metres");
  line.option("--names", &arguments->options.name, "Names for cameras without one (default cam%d)");
  line.option("--first", &arguments->options.first, "Number of the first such camera (default 0)");
  line.option("--board", &arguments->options.board,
              "bouguet: number of the board picture that is the world (default 1)");
  line.flag("--prototype-axes", &arguments->options.prototype_axes,
            "bouguet: the world's x, y, z are y, -x, z of the board, as in the 2005 "
            "prototype");
  line.option("-o,--output", &arguments->output, "File to write");
  return {line, [arguments] { return run_import(*arguments); }};
}

Subcommand check_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<CheckArguments>();
  CommandLine line =
      command.subcommand("check",
                         "Prints what is wrong with a rig file, a table of its cameras, how near a "
                         "person's hull will be "
                         "to the person, and where one camera more would bring most.");
  line.option("file", &arguments->file, "The rig file; without one, the built-in rig");
  line.option(
      "--pictures", &arguments->pictures,
      "CAMERA=FILE ...: pictures (PNG, JPEG) of one subject at one instant, to find cameras that "
      "contradict each other: masks (grey, or alpha) or pictures before a coloured screen; a FILE "
      "alone goes to the camera with whose name it begins, else to the next one without a picture");
  line.option("--keep-largest", &arguments->mask.keep_largest,
              "Looks at this many pieces of each picture's matte only, the largest; 0: all")
      .range(0, 1000)
      .shown();
  line.option("--sigma", &arguments->mask.sigma, "Blur of the pictures' mattes, px")
      .range(0.0, 100.0)
      .shown();
  line.flag("--no-forecast", &arguments->no_forecast,
            "Leaves out the simulation, which takes seconds; so do --pictures");
  return {line, [arguments] {
            return run_check(arguments->file, arguments->pictures, arguments->mask,
                             !arguments->no_forecast);
          }};
}

Subcommand plan_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<PlanArguments>();
  CommandLine line = command.subcommand(
      "plan",
      "Finds places for cameras around a stage, simulates a person there, prints what to "
      "expect.");
  PlanRequest& request = arguments->request;
  line.option("--cameras", &request.cameras, "How many cameras, 2 to 64").shown();
  line.option("--stage", &arguments->stage,
              "Where the person moves: WIDTHxDEPTHxHEIGHT (x, z, y), metres")
      .shown();
  line.option("--picture", &arguments->picture,
              "A camera's picture, WIDTHxHEIGHT px; 1080x1920 for cameras on their side")
      .shown();
  line.option("--fov", &request.fov, "Degrees from the left to the right edge of the picture")
      .shown();
  line.option("--distance", &arguments->distance,
              "Metres from the stage's axis to each camera, where a person in the middle "
              "must fit into the picture (default: as near as the whole stage fits)");
  line.option("--room", &arguments->room,
              "WIDTHxDEPTH (x, z) of the room around the stage, metres: cameras stand .3 m off its "
              "walls, nearer than --distance where these are nearer");
  line.option("--heights", &request.heights,
              "Heights at which cameras may stand, metres above the floor (default: 0.35, "
              "0.65 and 1 times the stage's height)");
  line.option("--drawing", &arguments->drawing, "Draws the plan from above, an SVG file");
  line.option("-o,--output", &arguments->output, "Writes a rig file to start from");
  return {line, [arguments] {
            const Rig rig = run_plan(*arguments);
            if (!arguments->output.empty()) write(rig, arguments->output);
            return 0;
          }};
}

Subcommand refine_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<RefineFiles>();
  CommandLine line = command.subcommand(
      "refine",
      "Finds where cameras really stand, from pictures of somebody who walked between them, all "
      "cameras at the same instants.");
  line.option("file", &arguments->file, "The rig file").required();
  line.option("--pictures", &arguments->refine.folders,
              "CAMERA=FOLDER ...: each camera's pictures (PNG, JPEG; masks or before a "
              "coloured screen), whose names end in the number of their instant; 20 instants "
              "and more, all over the stage")
      .required();
  line.option("--only", &arguments->refine.only,
              "CAMERA ...: only these move, as one that was bumped");
  line.option("--keep-largest", &arguments->refine.mask.keep_largest, "As of check")
      .range(0, 1000)
      .shown();
  line.option("-o,--output", &arguments->output, "The new rig file").required();
  return {line, [arguments] {
            write(refine_rig(open_rig(arguments->file), arguments->refine), arguments->output);
            return 0;
          }};
}

Subcommand level_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<LevelArguments>();
  CommandLine line = command.subcommand(
      "level", "Makes the world stand on the floor, y up, with bounds that begin there.");
  line.option("file", &arguments->file, "The rig file").required();
  line.option("--floor-points", &arguments->floor_points,
              "A text file of three points on the floor or more, lines of POINT CAMERA U V (px), "
              "each point in two cameras or more: the first becomes the origin, x points to the "
              "second");
  line.option("--points", &arguments->points,
              "X Y Z X Y Z X Y Z ...: the same points by their places in the rig's world");
  line.option("--floor", &arguments->height, "The floor's height along up, in the rig's world");
  line.option(
      "--pictures", &arguments->pictures,
      "CAMERA=FILE ...: somebody who stands on the floor, as for check; up must be right. With "
      "--board one or more pictures of the board");
  const Option board = line.option(
      "--board", &arguments->board.size,
      "The pictures show a board that lies on the floor, face up, with COLUMNSxROWS inner "
      "corners: its middle becomes the origin, x points along its columns");
  line.option("--square", &arguments->board.square, "Side of a square of the board, mm")
      .needs(board);
  line.option("--charuco", &arguments->board.charuco,
              "The board is a ChArUco board with markers of this dictionary, such as 4X4_100")
      .needs(board);
  line.option("--marker", &arguments->board.marker,
              "ChArUco: side of a marker, mm (default: 3/4 square)")
      .needs(board);
  line.option("--thickness", &arguments->thickness, "Of the board, mm").shown().needs(board);
  line.option("--keep-largest", &arguments->mask.keep_largest, "As of check")
      .range(0, 1000)
      .shown();
  line.option("--up", &arguments->up,
              "Direction that points up in the rig's world: x y z (default: as the rig says; of "
              "points, where the cameras are)")
      .expected(3);
  line.option("--origin", &arguments->origin,
              "x y z in the rig's world: the new origin is the floor's point below (default: the "
              "first point, or below the middle of the stage)")
      .expected(3);
  line.option("--unit", &arguments->request.unit,
              "Unit of the rig's lengths, which stay as they are: m, cm, mm, in, ft or a number "
              "of metres (default: as the rig says)");
  line.option("--stage", &arguments->request.stage,
              "The bounds, around the origin from the floor up: WIDTHxDEPTHxHEIGHT (x, z, y), "
              "metres (default: .7 of the cameras' distance to each side)");
  line.option("-o,--output", &arguments->output, "The new rig file").required();
  return {line, [arguments] { return run_level(*arguments); }};
}

Subcommand colours_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<ColourFiles>();
  CommandLine line = command.subcommand(
      "colours",
      "Prints how far the cameras' colours lie apart (CIEDE2000) on a colour checker of 24 "
      "patches or a grey card, and the 3x3 matrix for linear light that brings each to the "
      "reference; writes the rig file with these matrices, which hulltexture and composite apply.");
  line.option("file", &arguments->file, "The rig file").required();
  line.option("--pictures", &arguments->colours.pictures,
              "CAMERA=FILE ...: pictures (PNG, JPEG) with the chart, card or subject")
      .required();
  line.option("--corners", &arguments->colours.corners,
              "CAMERA=X,Y,X,Y,X,Y,X,Y ...: the outer corners of the patches dark skin, bluish "
              "green, black and white in the camera's picture, px");
  line.option("--grey", &arguments->colours.grey,
              "CAMERA=LEFT,TOP,RIGHT,BOTTOM ...: instead of --corners a rectangle "
              "within a grey card, px; a gain for each channel comes of it");
  line.option(
          "--reference", &arguments->colours.reference,
          "mean of the cameras, chart (its published values; of a card: grey) or a camera's name")
      .shown();
  line.flag("--overlaps", &arguments->overlaps,
            "Instead of --corners: by what cameras see of the same places of a "
            "subject. The pictures are of one instant, with its matte in their alpha "
            "(PNG); a gain for each channel is added to the rig's matrices");
  line.option("-o,--output", &arguments->output,
              "The rig file to write, with the matrices (`colour` of each camera)");
  return {line, [arguments] { return run_colours(*arguments); }};
}

Subcommand export_subcommand(CommandLine& command) {
  auto arguments = std::make_shared<ExportArguments>();
  CommandLine line = command.subcommand(
      "export",
      "Writes the built-in rig, or a normalised copy of a rig file (K, R and t instead of P, true "
      "rotations, up and unit written out), to standard output or into --output; or the cameras "
      "for "
      "other programs.");
  line.option("file", &arguments->file, "The rig file; without one, the built-in rig");
  line.option("--format", &arguments->format,
              "rig, opencv (a YAML file per camera), colmap (cameras.txt, images.txt), kalibr "
              "(camchain.yaml)")
      .one_of({"rig", "opencv", "colmap", "kalibr"})
      .shown();
  line.option("-o,--output", &arguments->output,
              "File to write; of opencv and colmap the folder, which is made");
  return {line, [arguments] {
            run_export(open_rig(arguments->file), arguments->format, arguments->output);
            return 0;
          }};
}

}  // namespace

int main(int count, char** values) {
  CommandLine command("polyhull-rig",
                      "Rig files: plan cameras, import other programs' calibrations, check them.");
  const Subcommand subcommands[] = {import_subcommand(command), check_subcommand(command),
                                    plan_subcommand(command),   refine_subcommand(command),
                                    level_subcommand(command),  colours_subcommand(command),
                                    export_subcommand(command)};
  return command.run(count, values, [&] {
    return std::ranges::find_if(subcommands, [](const auto& s) { return s.line.given(); })->run();
  });
}
