// SPDX-License-Identifier: LGPL-2.1-or-later
// What simplification does to the scenes of data/hull_scenes, for several values of max-deviation:
// hull_slivers.csv holds the share of slivers, turned triangles, triangles that cross each other,
// the change of the volume and the random points on the wrong side. Deviations are given relative
// to the diagonal of the hull's box.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "benchmarks/measure.h"
#include "command_line.h"
#include "hull/build/hull_builder.h"
#include "support/cgal_self_intersections.h"
#include "support/membership.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

void measure(benchmark::Table& table, const HullScene& scene, const std::vector<double>& deviations,
             std::size_t points, std::size_t crossing_limit) {
  const auto views = scene.views();
  HullBuilder builder;
  const Hull exact = builder.build(views);
  const Bounds box = box_of(exact, 0.02), tight = box_of(exact, 0.0);
  const double diagonal = glm::length(tight.max - tight.min);
  const double volume = check_mesh(exact).volume;
  for (const double relative : deviations) {
    HullOptions options;
    options.max_deviation = relative * diagonal;
    options.reuse = false;
    const Hull& hull = builder.build(views, options);
    const double ms = 1e3 * builder.statistics().seconds_triangulate;
    const MeshReport mesh = check_mesh(hull);
    const PlaneReport planes = check_planes(hull, views, options);
    const auto wrong = compare_membership(hull, views, {}, box, points, 12345);
    const double crossings = mesh.triangles <= crossing_limit
                                 ? static_cast<double>(count_self_intersections(hull))
                                 : NAN;
    table.row("%s,%g,%.4g,%zu,%.3f,%zu,%zu,%g,%d,%.2e,%zu,%zu,%.2e,%.2f", scene.name.c_str(),
              relative, options.max_deviation, mesh.triangles, 100 * mesh.sliver_share(),
              planes.flipped, mesh.flat_triangles, crossings, int(mesh.sound()),
              mesh.volume / volume - 1, wrong.wrong(), wrong.points,
              wrong.worst_distance / diagonal, ms);
  }
}

}  // namespace
}  // namespace polyhull::test

int main(int argc, char** argv) {
  using namespace polyhull;
  CommandLine command("hull_sliver_benchmark",
                      "Measures what simplification does to the hull and writes hull_slivers.csv.");
  const char* environment = std::getenv("POLYHULL_DATA");
  std::string data = environment ? environment : "", output = ".", only;
  std::size_t points = 200000, crossing_limit = 100000;
  std::vector<double> deviations{0, 1e-6, 1e-5, 3e-5, 1e-4, 2e-4, 5e-4, 1e-3};
  command.option("--data", &data, "Folder that holds hull_scenes/ ($POLYHULL_DATA)");
  command.option("--output", &output, "Folder for the table").existing_folder();
  command.option("--only", &only, "Scenes whose names contain this");
  command.option("--points", &points, "Random points per hull");
  command.option("--crossings", &crossing_limit,
                 "Triangles up to which crossing triangles are counted");
  command.option("--deviations", &deviations, "Relative to the diagonal of the hull's box");
  return command.run(argc, argv, [&] {
    benchmark::Table table(
        output + "/hull_slivers.csv",
        "scene,relative_deviation,deviation,triangles,sliver_percent,flipped,flat,crossing_pairs,"
        "sound,volume_change,wrong_points,points,worst_relative,triangulate_ms");
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(data + "/hull_scenes"))
      if (entry.path().extension() == ".json") files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    for (const std::string& path : files)
      if (path.find(only) != std::string::npos)
        test::measure(table, load_hull_scene(path), deviations, points, crossing_limit);
    return 0;
  });
}
