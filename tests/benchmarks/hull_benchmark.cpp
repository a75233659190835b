// SPDX-License-Identifier: LGPL-2.1-or-later
// Time and correctness of HullBuilder, with its peers in the same run, as CSV tables for
// hull_plots.gp:
//
//   hull_peers.csv    the scenes of data/hull_scenes: ours, CGAL's booleans (EPICK), voxels
//   hull_growth.csv   time against contour vertices and against cameras
//   hull_threads.csv  time against threads
//   hull_steady.csv   unchanged silhouettes, one camera changed, memory
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "base/error.h"
#include "base/thread_pool.h"
#include "benchmarks/measure.h"
#include "command_line.h"
#include "hull/build/hull_builder.h"
#include "support/cgal_hull.h"
#include "support/membership.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"
#include "voxel_hull.h"

namespace polyhull::test {
namespace {

struct Arguments {
  std::string data;
  std::string parts = "growth,threads,steady,peers";
  std::vector<std::string> only{""};  ///< prefixes of the scenes of the peers' table
  bool append = false;                ///< to the tables, without their heads
  std::string output = ".";
  std::size_t cgal_limit = 3200;
  std::size_t points = 1000000;
  double seconds = 1.0;
};

double timed(double seconds, const std::function<void()>& work) {
  return benchmark::median_ms(work, seconds, 3, 1000);
}

/// The time of CGAL's booleans; NaN where it refuses the cones. In a process of its own, because
/// without its checks CGAL crashes on some that it should refuse.
double cgal_ms(std::span<const Silhouette> views, double near, double far) {
  int ends[2];
  if (pipe(ends) != 0) throw Error(Error::Kind::io, "No pipe for CGAL's time.");
  const pid_t child = fork();
  if (child == 0) {
    const CgalHull hull = cgal_hull_inexact(views, std::nullopt, near, far);
    if (hull.done && write(ends[1], &hull.seconds, sizeof hull.seconds) < 0) _exit(1);
    _exit(0);
  }
  close(ends[1]);
  double seconds = NAN;
  if (child < 0 || read(ends[0], &seconds, sizeof seconds) != sizeof seconds) seconds = NAN;
  close(ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  return seconds * 1e3;
}

double time_of(const HullScene& scene, int threads, double seconds) {
  HullBuilder builder;
  HullOptions options;
  options.threads = threads;
  options.reuse = false;
  const auto views = scene.views();
  return timed(seconds, [&] { builder.build(views, options); });
}

void compare_peers(const Arguments& arguments) {
  benchmark::Table table(
      arguments.output + "/hull_peers.csv",
      "scene,cameras,contour_vertices,ms_1_thread,ms_2_threads,cgal_ms,cgal_times,voxel128_ms,"
      "voxel128_wrong,triangles,closed,manifold,wrong_points,points,volume,volume_error,"
      "sliver_percent,exact_percent",
      arguments.append);
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(arguments.data + "/hull_scenes")) {
    const std::string name = entry.path().stem().string();
    const bool wanted =
        std::any_of(arguments.only.begin(), arguments.only.end(),
                    [&](const std::string& prefix) { return name.rfind(prefix, 0) == 0; });
    if (entry.path().extension() == ".json" && wanted) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  for (const std::string& path : files) {
    const HullScene scene = load_hull_scene(path);
    const auto views = scene.views();
    HullBuilder builder;
    const Hull hull = builder.build(views);
    const HullStatistics statistics = builder.statistics();
    const MeshReport mesh = check_mesh(hull);
    Bounds box = box_of(hull, 0.02);
    if (scene.rig.bounds) box = join(box, *scene.rig.bounds);
    const auto wrong = compare_membership(hull, views, {}, box, arguments.points, 12345);
    const double one = time_of(scene, 1, arguments.seconds),
                 two = time_of(scene, 2, arguments.seconds);

    double cgal = NAN;
    if (scene.contour_vertices() <= arguments.cgal_limit) {
      const Vec3 centre = (box.min + box.max) * 0.5;
      const double depth = scene.rig.cameras[0].to_camera(centre).z;
      cgal = cgal_ms(views, depth * 2.6 / 4.2, depth * 5.8 / 4.2);
    }
    VoxelHull voxels(box, 128);
    const double voxel_ms = timed(arguments.seconds / 4, [&] { voxels.build(views); });
    const auto voxel_wrong = compare_membership(voxels.build(views), views, {}, box, 200000, 12345);

    table.row("%s,%zu,%zu,%.3f,%.3f,%.1f,%.0f,%.2f,%.4f,%zu,%d,%d,%zu,%zu,%.9g,%.1e,%.2f,%.5f",
              scene.name.c_str(), views.size(), scene.contour_vertices(), one, two, cgal,
              cgal / one, voxel_ms, double(voxel_wrong.wrong()) / 200000.0, mesh.triangles,
              int(mesh.closed()), int(mesh.manifold()), wrong.wrong(), wrong.points, mesh.volume,
              scene.reference_volume ? mesh.volume / *scene.reference_volume - 1 : NAN,
              100 * mesh.sliver_share(),
              100.0 * double(statistics.exact_predicates) /
                  double(std::max<std::uint64_t>(statistics.predicates, 1)));
  }
}

void measure_growth(const Arguments& arguments) {
  benchmark::Table table(arguments.output + "/hull_growth.csv",
                         "what,cameras,contour_vertices,ms,triangles", arguments.append);
  const auto measure = [&](const char* what, const HullScene& scene) {
    HullBuilder builder;
    const std::size_t triangles = builder.build(scene.views()).triangles.size() / 3;
    table.row("%s,%zu,%zu,%.3f,%zu", what, scene.rig.cameras.size(), scene.contour_vertices(),
              time_of(scene, 1, arguments.seconds / 2), triangles);
  };
  for (double step : {32.0, 24.0, 16.0, 12.0, 8.0, 6.0, 4.0, 3.0, 2.0})
    measure("vertices", figure_scene(8, step));
  for (int cameras : {2, 3, 4, 6, 8, 12, 16, 24, 32}) measure("cameras", figure_scene(cameras, 8));
}

void measure_threads(const Arguments& arguments) {
  benchmark::Table table(arguments.output + "/hull_threads.csv", "scene,threads,ms,times_faster",
                         arguments.append);
  for (const HullScene& scene :
       {figure_scene(4, 8), figure_scene(8, 8), figure_scene(8, 2), figure_scene(16, 8)}) {
    double one = 0.0;
    for (int threads : {1, 2, 4}) {
      const double ms = time_of(scene, threads, arguments.seconds / 2);
      if (threads == 1) one = ms;
      table.row("%s with %zu vertices,%d,%.3f,%.2f", scene.name.c_str(), scene.contour_vertices(),
                threads, ms, one / ms);
    }
  }
}

double resident_megabytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0, resident = 0;
  statm >> total >> resident;
  return resident * 4096 / 1e6;
}

void measure_steady_state(const Arguments& arguments) {
  benchmark::Table table(arguments.output + "/hull_steady.csv",
                         "scene,new_ms,unchanged_ms,unchanged_percent,one_changed_ms,"
                         "one_changed_percent,resident_mb_before,resident_mb_after",
                         arguments.append);
  for (int cameras : {4, 8, 16}) {
    // All cameras move from frame to frame; or none; or one.
    std::vector<HullScene> frames;
    for (int i = 0; i < 4; ++i) frames.push_back(figure_scene(cameras, 6, 0.1 * i));
    HullBuilder builder;
    int frame = 0;
    const auto all = [&] { builder.build(frames[std::size_t(++frame % 4)].views()); };
    const double fresh = timed(arguments.seconds, all);
    const double before = resident_megabytes();
    for (int i = 0; i < 200; ++i) all();
    const double after = resident_megabytes();
    const double unchanged =
        timed(arguments.seconds / 4, [&] { builder.build(frames[0].views()); });
    auto views = frames[0].views();
    const double one = timed(arguments.seconds, [&] {
      views[1].rings = &frames[std::size_t(++frame % 2)].silhouettes[1];
      builder.build(views);
    });
    table.row("%s with %zu vertices,%.3f,%.4f,%.2f,%.3f,%.1f,%.1f,%.1f", frames[0].name.c_str(),
              frames[0].contour_vertices(), fresh, unchanged, 100 * unchanged / fresh, one,
              100 * one / fresh, before, after);
  }
}

}  // namespace
}  // namespace polyhull::test

int main(int argc, char** argv) {
  polyhull::CommandLine command("hull_benchmark",
                                "Times HullBuilder and its peers and writes CSV tables.");
  polyhull::test::Arguments arguments;
  const char* data = std::getenv("POLYHULL_DATA");
  arguments.data = data ? data : "";
  command.option("--data", &arguments.data, "Folder that holds hull_scenes/ ($POLYHULL_DATA)");
  command.option("--output", &arguments.output, "Folder for the tables").existing_folder();
  command.option("--cgal-limit", &arguments.cgal_limit,
                 "Contour vertices up to which CGAL runs, too");
  command.option("--parts", &arguments.parts, "Which tables: growth,threads,steady,peers");
  command.option("--only", &arguments.only, "Peers: scenes whose names begin with one of these")
      .separated_by(',');
  command.flag("--append", &arguments.append, "Add rows to the tables instead of new ones");
  command.option("--points", &arguments.points, "Random points per scene");
  command.option("--seconds", &arguments.seconds, "About how long each time is measured");
  return command.run(argc, argv, [&] {
    const auto wanted = [&](const char* part) {
      return arguments.parts.find(part) != std::string::npos;
    };
    if (wanted("growth")) polyhull::test::measure_growth(arguments);
    if (wanted("threads")) polyhull::test::measure_threads(arguments);
    if (wanted("steady")) polyhull::test::measure_steady_state(arguments);
    if (wanted("peers")) polyhull::test::compare_peers(arguments);
    return 0;
  });
}
