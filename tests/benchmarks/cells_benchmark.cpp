// SPDX-License-Identifier: LGPL-2.1-or-later
// From contours and pictures to a drawn frame over the size of cells: the refined surface, and the hull
// by voxels; beside them the exact hull and the image-based one, which have no cells. Processor time
// on one thread of the surface and of a textured frame of 1280x720, distance to the body, and error
// half way between cameras; cells.csv.
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "base/thread_pool.h"
#include "body_frames.h"
#include "command_line.h"
#include "hull/build/stage.h"
#include "imagehull/image_subject.h"
#include "measure.h"
#include "refine/refine.h"
#include "support/camera_contours.h"
#include "voxel_hull.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::behind_bodies, benchmark::BetweenError, benchmark::drawn, benchmark::median,
    benchmark::now, benchmark::Table, benchmark::Take, benchmark::textured_subject;

constexpr int width = 1280, height = 720;
constexpr double tolerance = 0.5;  // px, of contours

/// A way to a surface; none for the image-based hull.
struct Method {
  const char* name;
  double cell = 0.0;  // mm
  std::function<Hull(const Take&)> surface;
};

Hull exact_hull(const Take& take) {
  HullStage stage;
  return stage.build(camera_contours(take.scene.cameras, take.scene.contours), {}, 0.0);
}

Hull refined(const Take& take, RefineQuality quality, double cell) {
  HullRefiner refiner;
  return refiner.refine(exact_hull(take), camera_contours(take.scene.cameras, take.scene.contours),
                        1.0, {.quality = quality, .cell = cell, .threads = 1, .reuse = false});
}

/// By voxels of \p cell metres in a box around a person.
Hull by_voxels(const Take& take, double cell) {
  const Bounds bounds{Vec3(-1.0, -0.05, -1.0), Vec3(1.0, 2.05, 1.0)};
  VoxelHull voxels(bounds, static_cast<int>(2.1 / cell + 0.5));
  std::vector<Silhouette> silhouettes;
  for (std::size_t k = 0; k < take.scene.cameras.size(); ++k)
    silhouettes.push_back({&take.scene.cameras[k], &take.scene.contours[k]});
  Hull hull = voxels.build(silhouettes);
  hull.faces = {{-1, HullFace::no_edge, 0, static_cast<std::uint32_t>(hull.triangles.size() / 3)}};
  return hull;
}

std::vector<Method> methods() {
  std::vector<Method> all{{"hull", 0.0, exact_hull}, {"image-based", 0.0, nullptr}};
  for (const double mm : {40.0, 30.0, 24.0, 20.0, 16.0, 12.0, 8.0}) {
    const double cell = 1e-3 * mm;
    all.push_back(
        {"fast", mm, [=](const Take& take) { return refined(take, RefineQuality::fast, cell); }});
    all.push_back(
        {"good", mm, [=](const Take& take) { return refined(take, RefineQuality::good, cell); }});
  }
  for (const double mm : {40.0, 30.0, 20.0, 15.0, 10.0, 7.0, 5.0})
    all.push_back({"voxels", mm, [=](const Take& take) { return by_voxels(take, 1e-3 * mm); }});
  return all;
}

struct Row {
  std::vector<double> surface, frame;  // ms
  double distance = 0.0, triangles = 0.0;
  BetweenError error;
};

void measure_on(const Take& take, const Method& method, int runs, Row& row) {
  for (int run = -1; run < runs; ++run) {  // the first is not counted
    Mesh mesh = take.views;
    ProcessorRenderer renderer;
    const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
    if (method.surface) mesh.hull = method.surface(take);
    const double made = now(CLOCK_PROCESS_CPUTIME_ID);
    const RenderSubject subject =
        method.surface
            ? textured_subject(mesh)
            : RenderSubject{
                  &mesh, {}, 0, std::make_shared<const ImageSubject>(image_subject(mesh))};
    drawn(renderer, subject, take.scene.between[0], width, height, 4, behind_bodies);
    const double end = now(CLOCK_PROCESS_CPUTIME_ID);
    if (run >= 0) {
      row.surface.push_back(made - begin);
      row.frame.push_back(end - begin);
      continue;
    }
    add_error(take, subject, row.error);
    if (method.surface) row.distance += measure(mesh.hull, take.scene, false).mean;
    row.triangles += static_cast<double>(mesh.hull.triangles.size()) / 3.0;
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command(
      "cells_benchmark",
      "Refined surface and voxels over the size of cells, hull and image-based hull.");
  std::string output = ".";
  int runs = 3;
  std::vector<std::string> rigs{"4", "8"};
  command.option("--output", &output, "Folder for the table").existing_folder();
  command.option("--runs", &runs, "Runs that are timed").range(1, 1000);
  command.option("--rig", &rigs, "Rings of that many cameras");
  return command.run(argc, argv, [&] {
    const char* data = std::getenv("POLYHULL_DATA");
    const std::vector<Body> bodies = study_bodies(data ? data : "");
    Table table(output + "/cells.csv",
                "cameras,method,cell_mm,triangles,surface_ms,frame_ms,mean_mm,iou,psnr");
    set_pool_threads(1);
    for (const std::string& rig : rigs) {
      std::vector<Take> takes;
      for (const Body& body : bodies)
        takes.emplace_back(body_scene(body_rig(rig), body), tolerance);
      for (const Method& method : methods()) {
        Row row;
        for (const Take& take : takes) measure_on(take, method, runs, row);
        const auto count = static_cast<double>(takes.size());
        table.row("%s,%s,%.0f,%.0f,%.2f,%.2f,%.3f,%.4f,%.2f", rig.c_str(), method.name, method.cell,
                  row.triangles / count, median(row.surface), median(row.frame),
                  row.distance / count, row.error.overlap / row.error.views,
                  row.error.psnr / row.error.views);
      }
    }
    return 0;
  });
}
