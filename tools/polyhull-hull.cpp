// SPDX-License-Identifier: LGPL-2.1-or-later
// Hulls without a pipeline: from a scene file (rig and silhouettes), or from a rig and mask
// pictures, to a mesh file; prints what was made and how long each phase took.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/median.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "camera_files.h"
#include "command_line.h"
#include "files/mesh_files.h"
#include "hull/build/hull_builder.h"
#include "hull/hull.h"
#include "hull/measure.h"
#include "hull_scene.h"
#include "mask_contours.h"

namespace polyhull {
namespace {

struct Arguments {
  std::string scene;
  std::string rig;
  std::vector<std::string> masks;
  MaskSettings mask;
  std::string output;
  std::string bounds = "rig";
  HullOptions hull;
  int repeat = 1;
  bool json = false;
};

HullScene read_input(const Arguments& arguments) {
  if (!arguments.scene.empty()) return load_hull_scene(arguments.scene);
  HullScene scene;
  Rig rig = load_rig(arguments.rig);
  scene.name = std::filesystem::path(arguments.rig).stem().string();
  scene.rig.bounds = rig.bounds;
  scene.rig.up = rig.up;
  scene.rig.unit = rig.unit;
  // Cameras without a mask say nothing: they are left out.
  for (const auto& [index, path] : assign_files(arguments.masks, rig, "--mask", "polyhull-hull")) {
    scene.rig.cameras.push_back(rig.cameras[index]);
    scene.silhouettes.push_back(contours_of_mask(path, rig.cameras[index], arguments.mask));
  }
  return scene;
}

/// "rig", "none" or six numbers.
std::optional<Bounds> read_bounds(const std::string& text, const Rig& rig) {
  if (text == "rig") return rig.bounds;
  if (text == "none") return std::nullopt;
  double v[6];
  int end = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf%n", v, v + 1, v + 2, v + 3, v + 4, v + 5,
                  &end) != 6 ||
      static_cast<std::size_t>(end) != text.size() ||
      !(v[0] < v[3] && v[1] < v[4] && v[2] < v[5])) {
    throw Error(
        Error::Kind::bad_input,
        "--bounds {}: expected rig, none, or min and max as x,y,z,x,y,z with min below max.", text);
  }
  return Bounds{Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5])};
}

struct Phase {
  const char* name;
  double HullStatistics::*seconds;
  std::vector<double> samples{};

  double median_ms() const { return median(samples) * 1e3; }
};

// A scene's hull and how long it took, each time.
struct Measured {
  HullBuilder builder;
  const Hull* hull = nullptr;
  std::vector<double> totals;
  std::array<Phase, 5> phases{{{"prepare", &HullStatistics::seconds_prepare},
                               {"scene", &HullStatistics::seconds_scene},
                               {"faces", &HullStatistics::seconds_faces},
                               {"assemble", &HullStatistics::seconds_assemble},
                               {"triangulate", &HullStatistics::seconds_triangulate}}};

  double median_ms() const { return median(totals) * 1e3; }
  double exact_share() const {
    const HullStatistics& statistics = builder.statistics();
    return statistics.predicates
               ? double(statistics.exact_predicates) / double(statistics.predicates)
               : 0.0;
  }
};

void build(const HullScene& scene, const HullOptions& options, int repeat, Measured& out) {
  const std::vector<Silhouette> views = scene.views();
  for (int i = 0; i < repeat; ++i) {
    const Stopwatch watch;
    out.hull = &out.builder.build(views, options);
    out.totals.push_back(watch.seconds());
    for (Phase& phase : out.phases)
      phase.samples.push_back(out.builder.statistics().*phase.seconds);
  }
}

void write_hull(const HullScene& scene, const Hull& hull, const std::string& path) {
  Mesh mesh;
  mesh.up = scene.rig.up;
  mesh.metres_per_unit = scene.rig.metres_per_unit();
  mesh.hull = hull;
  write_mesh_file(mesh, path);
}

void print_json(const HullScene& scene, const Measured& measured, const HullOptions& options) {
  const Hull& hull = *measured.hull;
  nlohmann::ordered_json report{{"name", scene.name},
                                {"cameras", scene.rig.cameras.size()},
                                {"contour_vertices", scene.contour_vertices()},
                                {"threads", options.threads},
                                {"repeat", measured.totals.size()},
                                {"median_ms", measured.median_ms()}};
  for (const Phase& phase : measured.phases) report["phases_ms"][phase.name] = phase.median_ms();
  report["vertices"] = hull.vertices.size();
  report["triangles"] = hull.triangles.size() / 3;
  report["faces"] = hull.faces.size();
  report["closed"] = is_closed(hull);
  report["volume"] = enclosed_volume(hull);
  report["sliver_share"] = sliver_share(hull);
  report["predicates"] = measured.builder.statistics().predicates;
  report["exact_predicate_share"] = measured.exact_share();
  if (scene.reference_volume) report["reference_volume"] = *scene.reference_volume;
  std::printf("%s\n", report.dump(2).c_str());
}

void print(const HullScene& scene, const Measured& measured, const HullOptions& options) {
  const Hull& hull = *measured.hull;
  std::printf("%s: %zu cameras, %zu contour vertices\n", scene.name.c_str(),
              scene.rig.cameras.size(), scene.contour_vertices());
  std::printf("%zu vertices, %zu triangles, %zu faces, %s, volume %.9g %s^3, %.2f %% slivers\n",
              hull.vertices.size(), hull.triangles.size() / 3, hull.faces.size(),
              is_closed(hull) ? "closed" : "NOT CLOSED", enclosed_volume(hull),
              scene.rig.unit.c_str(), 100 * sliver_share(hull));
  std::printf("%.3f ms (median of %zu, %d threads):", measured.median_ms(), measured.totals.size(),
              options.threads);
  for (const Phase& phase : measured.phases) std::printf(" %s %.3f", phase.name, phase.median_ms());
  std::printf("\n%.4f %% of %llu predicates needed exact arithmetic\n",
              measured.exact_share() * 100,
              static_cast<unsigned long long>(measured.builder.statistics().predicates));
}

int run(const Arguments& arguments) {
  if (arguments.scene.empty() && arguments.rig.empty())
    throw Error(Error::Kind::bad_input, "give a scene file, or --rig with --mask; see --help");
  if (!arguments.output.empty() && !is_mesh_file_name(arguments.output)) {
    throw Error(Error::Kind::bad_input, "--output {}: expected a name that ends in {}.",
                arguments.output, mesh_file_endings());
  }
  const HullScene scene = read_input(arguments);
  HullOptions options = arguments.hull;
  options.bounds = read_bounds(arguments.bounds, scene.rig);
  options.reuse = false;  // each repetition is to be a whole hull
  set_pool_threads(options.threads);
  Measured measured;
  build(scene, options, arguments.repeat, measured);
  if (!arguments.output.empty()) write_hull(scene, *measured.hull, arguments.output);
  (arguments.json ? print_json : print)(scene, measured, options);
  return 0;
}

}  // namespace
}  // namespace polyhull

int main(int argc, char** argv) {
  using namespace polyhull;
  CommandLine command(
      "polyhull-hull",
      "Builds the exact visual hull of silhouettes, without a pipeline.\n\n"
      "  polyhull-hull SCENE.json -o hull.ply\n"
      "  polyhull-hull --rig rig.json --mask cam0=a.png --mask cam1=b.png -o hull.glb\n\n"
      "A scene file holds {\"rig\": {...}, \"silhouettes\": [camera][ring][vertex][u, v]} in "
      "undistorted pixels.");
  Arguments arguments;
  Option scene = command.option("scene", &arguments.scene, "Scene file (JSON)").existing_file();
  Option rig =
      command.option("--rig", &arguments.rig, "Rig file, used with --mask").existing_file();
  Option masks = command.option(
      "--mask", &arguments.masks,
      "CAMERA=FILE: mask of one camera, foreground bright; a FILE alone goes to the camera "
      "with whose name it, or its folder, begins, else to the next one without a mask");
  rig.excludes(scene).needs(masks);
  masks.needs(rig);
  command.option("--sigma", &arguments.mask.sigma, "Blur of masks before tracing, px")
      .range(0.0, 100.0)
      .shown();
  command
      .option("--tolerance", &arguments.mask.tolerance,
              "How far polygons may leave a mask's contour, px")
      .range(0.0, 100.0)
      .shown();
  command.option("-o,--output", &arguments.output,
                 "Mesh file, its format by its ending: " + mesh_file_endings());
  command
      .option("--bounds", &arguments.bounds,
              "rig, none, or x,y,z,x,y,z: the box the hull is limited to")
      .shown();
  command
      .choice("--unseen", &arguments.hull.unseen,
              "Space that a camera does not see: carve or keep (needs bounds)",
              {{"carve", Unseen::carve}, {"keep", Unseen::keep}})
      .shown();
  command
      .option("--max-deviation", &arguments.hull.max_deviation,
              "How far simplification may move the surface, world units; 0: none")
      .not_negative()
      .shown();
  command.option("--threads", &arguments.hull.threads, "Threads that build the hull")
      .range(1, 1024)
      .shown();
  command
      .option("--repeat", &arguments.repeat, "Builds the hull this often and prints median times")
      .range(1, 1000000)
      .shown();
  command.flag("--json", &arguments.json, "Prints one JSON object");
  return command.run(argc, argv, [&] { return run(arguments); });
}
