// SPDX-License-Identifier: LGPL-2.1-or-later
// How far surfaces made from silhouettes are from the body that cast them: five bodies, rings of
// cameras, one row for each rig and method, means over the bodies, in body.csv; and in
// body_motion.csv how they move when the body does not, and when it walks.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "body_methods.h"
#include "body_motion.h"
#include "body_sheet.h"
#include "command_line.h"
#include "hull/build/stage.h"
#include "measure.h"
#include "support/body_scenes.h"
#include "support/hollow_bodies.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::body_methods, benchmark::Method, benchmark::BodySheet;
using benchmark::median, benchmark::now, benchmark::Table;

/// What one method costs, and how wrong it is.
struct Row {
  BodyError error;
  double wall = 0.0, processor = 0.0;  ///< ms, medians of the runs
  double triangles = 0.0;
  double worst_outside = 0.0;  ///< of the bodies, BodyError::outside
};

Hull run(const Method& method, const BodyScene& scene, const Hull& hull, int runs, Row& row) {
  Hull surface;
  std::vector<double> wall, processor;
  for (int i = 0; i <= runs; ++i) {  // the first is not counted
    const double began = now(CLOCK_MONOTONIC), used = now(CLOCK_PROCESS_CPUTIME_ID);
    surface = method.surface(scene, hull);
    if (i == 0) continue;
    wall.push_back(now(CLOCK_MONOTONIC) - began);
    processor.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - used);
  }
  row.wall = median(wall);
  row.processor = median(processor);
  row.triangles = static_cast<double>(surface.triangles.size()) / 3.0;
  return surface;
}

void add(Row& mean, const Row& row, double share) {
  const auto more = [share](double& sum, double value) { sum += share * value; };
  more(mean.error.unsound, row.error.unsound);
  more(mean.error.volume, row.error.volume);
  more(mean.error.mean, row.error.mean);
  more(mean.error.hausdorff, row.error.hausdorff);
  more(mean.error.overlap, row.error.overlap);
  more(mean.error.missing, row.error.missing);
  more(mean.error.outside, row.error.outside);
  more(mean.error.psnr, row.error.psnr);
  more(mean.wall, row.wall);
  more(mean.processor, row.processor);
  more(mean.triangles, row.triangles);
  mean.worst_outside = std::max(mean.worst_outside, row.worst_outside);
}

void print(Table& table, const std::string& rig, const std::string& scene, const char* method,
           const Row& row) {
  table.row("%s,%s,%s,%.3f,%.2f,%.1f,%.4f,%.2f,%.3f,%.3f,%.3f,%.1f,%.2f,%.2f,%.0f", rig.c_str(),
            scene.c_str(), method, row.error.volume, row.error.mean, row.error.hausdorff,
            row.error.overlap, row.error.psnr, 100.0 * row.error.missing, 100.0 * row.error.outside,
            100.0 * row.worst_outside, row.error.unsound, row.wall, row.processor, row.triangles);
}

struct Options {
  std::vector<std::string> rigs{"4", "4far", "5", "6", "7", "8", "12"}, scenes, methods;
  std::string output = ".", pictures;
  bool hollows = false, no_psnr = false, each = false, motion = true;
  int runs = 5, threads = 2;
};

bool wanted(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<Method> methods_of(const Options& options) {
  std::vector<Method> methods = body_methods(options.threads);
  std::erase_if(methods, [&](const Method& m) {
    return options.methods.empty() ? !m.always : !wanted(options.methods, m.name);
  });
  if (methods.empty()) throw std::runtime_error("no method of that name");
  return methods;
}

void measure_rig(const std::string& name, const std::vector<Body>& bodies, const Options& options,
                 Table& table) {
  const Rig rig = body_rig(name);
  const std::vector<Method> used = methods_of(options);
  std::vector<Row> means(used.size());
  for (const Body& body : bodies) {
    const BodyScene scene = body_scene(rig, body);
    HullStage stage;
    const Hull& hull = hull_of(scene, stage, options.threads);
    BodySheet sheet(scene, hull);
    for (std::size_t m = 0; m < used.size(); ++m) {
      Row row;
      const Hull surface = run(used[m], scene, hull, options.runs, row);
      row.error = measure(surface, scene, !options.no_psnr);
      row.worst_outside = row.error.outside;
      add(means[m], row, 1.0 / static_cast<double>(bodies.size()));
      if (options.each) print(table, name, body.name, used[m].name, row);
      if (!options.pictures.empty()) sheet.add(surface);
    }
    if (!options.pictures.empty())
      sheet.save(options.pictures + "/" + name + "-" + body.name + ".png");
  }
  for (std::size_t m = 0; m < used.size(); ++m) print(table, name, "mean", used[m].name, means[m]);
}

void run_all(const Options& options) {
  const char* data = std::getenv("POLYHULL_DATA");
  std::vector<Body> bodies = options.hollows ? hollow_bodies() : study_bodies(data ? data : "");
  if (!options.hollows && bodies.size() < 5) {
    std::printf("No MakeHuman body in POLYHULL_DATA: only the synthetic figure is measured.\n");
  }
  std::erase_if(bodies, [&](const Body& body) { return !wanted(options.scenes, body.name); });
  if (bodies.empty()) throw std::runtime_error("no scene of that name");
  Table table(options.output + "/body.csv",
              "rig,scene,method,volume,mean_mm,hausdorff95_mm,iou_between,psnr_between,missing_pct,"
              "outside_pct,worst_outside_pct,unsound,wall_ms,processor_ms,triangles");
  for (const std::string& rig : options.rigs) measure_rig(rig, bodies, options, table);
  if (!options.motion) return;
  Table motion(options.output + "/body_motion.csv", benchmark::motion_header());
  for (const std::string& rig : options.rigs) {
    benchmark::measure_motion(rig, bodies, methods_of(options), motion);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command(
      "body_benchmark",
      "Measures surfaces made from silhouettes against the true body; writes body.csv.");
  Options options;
  command.option("--rig", &options.rigs,
                 "Rings of that many cameras, or 4far: 0, 90, 225, 315 degrees");
  command.option("--scene", &options.scenes, "Only these bodies");
  command.option("--method", &options.methods, "Only these methods");
  command.option("--runs", &options.runs, "Runs that are timed").range(1, 1000);
  command.option("--threads", &options.threads, "Threads of the methods").range(1, 64);
  command.flag("--hollows", &options.hollows,
               "Two bodies with hollows that no silhouette shows, instead of the five");
  command.flag("--no-psnr", &options.no_psnr, "Leave out the textured pictures' error");
  command.flag("--motion,!--no-motion", &options.motion,
               "Whether to measure the surfaces' motion, too");
  command.flag("--each", &options.each, "A row for each body, too");
  command
      .option("--pictures", &options.pictures, "Folder for sheets: methods and truth side by side")
      .existing_folder();
  command.option("--output", &options.output, "Folder for the table").existing_folder();
  return command.run(argc, argv, [&] {
    run_all(options);
    return 0;
  });
}
