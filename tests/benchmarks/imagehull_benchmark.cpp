// SPDX-License-Identifier: LGPL-2.1-or-later
// From contours and pictures to a drawn frame, three ways: the image-based hull, the polyhedral hull and
// the refined surface, both textured; time on one thread, and error half way between cameras. One of
// cameras, contour tolerance and output size changes at a time; imagehull.csv.
#include <cmath>
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
#include "support/body_scenes.h"
#include "support/camera_contours.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::behind_bodies, benchmark::BetweenError, benchmark::drawn, benchmark::median,
    benchmark::now, benchmark::Table, benchmark::Take, benchmark::textured_subject;

/// What is changed.
struct Case {
  std::string rig = "5";
  double tolerance = 0.5;  // px
  int width = 1280, height = 720;
};

/// A way to a subject that can be drawn; its mesh is kept.
struct Method {
  const char* name;
  std::function<RenderSubject(const Take&, Mesh&)> make;
};

std::vector<Method> methods() {
  const auto hull = [](const Take& take) {
    HullStage stage;
    return stage.build(camera_contours(take.scene.cameras, take.scene.contours), {}, 0.0);
  };
  return {{"image-based",
           [](const Take& take, Mesh& mesh) {
             mesh = take.views;
             return RenderSubject{
                 &mesh, {}, 0, std::make_shared<const ImageSubject>(image_subject(mesh))};
           }},
          {"hull",
           [=](const Take& take, Mesh& mesh) {
             mesh = take.views;
             mesh.hull = hull(take);
             return textured_subject(mesh);
           }},
          {"refined", [=](const Take& take, Mesh& mesh) {
             mesh = take.views;
             HullRefiner refiner;
             mesh.hull = refiner.refine(
                 hull(take), camera_contours(take.scene.cameras, take.scene.contours), 1.0,
                 {.quality = RefineQuality::fast, .threads = 1, .reuse = false});
             return textured_subject(mesh);
           }}};
}

struct Row {
  std::vector<double> make, draw;  // ms
  BetweenError error;
};

void measure(const Case& now_is, const char* changed, const std::vector<Body>& bodies, int runs,
             Table& table) {
  const std::vector<Method> ways = methods();
  std::vector<Row> rows(ways.size());
  double vertices = 0.0;
  for (const Body& body : bodies) {
    const Take take(body_scene(body_rig(now_is.rig), body), now_is.tolerance);
    vertices += static_cast<double>(take.vertices) / static_cast<double>(bodies.size());
    set_pool_threads(1);
    for (int run = -1; run < runs; ++run)  // the first is not counted
      for (std::size_t m = 0; m < ways.size(); ++m) {
        Mesh mesh;
        ProcessorRenderer renderer;
        const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
        const RenderSubject subject = ways[m].make(take, mesh);
        const double made = now(CLOCK_PROCESS_CPUTIME_ID);
        drawn(renderer, subject, take.scene.between[0], now_is.width, now_is.height, 4,
              behind_bodies);
        const double end = now(CLOCK_PROCESS_CPUTIME_ID);
        if (run >= 0) {
          rows[m].make.push_back(made - begin);
          rows[m].draw.push_back(end - made);
        } else {
          add_error(take, subject, rows[m].error);
        }
      }
    set_pool_threads(0);
  }
  for (std::size_t m = 0; m < ways.size(); ++m)
    table.row("%s,%s,%s,%.2f,%.0f,%d,%.2f,%.2f,%.4f,%.2f", changed, ways[m].name,
              now_is.rig.c_str(), now_is.tolerance, vertices, now_is.height, median(rows[m].make),
              median(rows[m].draw), rows[m].error.overlap / rows[m].error.views,
              rows[m].error.psnr / rows[m].error.views);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("imagehull_benchmark",
                      "Image-based hull, polyhedral hull and refined surface: time and error.");
  std::string output = ".";
  int runs = 5;
  command.option("--output", &output, "Folder for the table").existing_folder();
  command.option("--runs", &runs, "Runs that are timed").range(1, 1000);
  return command.run(argc, argv, [&] {
    const char* data = std::getenv("POLYHULL_DATA");
    const std::vector<Body> bodies = study_bodies(data ? data : "");
    Table table(output + "/imagehull.csv",
                "changed,method,cameras,tolerance_px,vertices,height,make_ms,draw_ms,iou,psnr");
    for (const char* rig : {"4", "5", "8", "12"})
      measure({.rig = rig}, "cameras", bodies, runs, table);
    for (const double tolerance : {0.25, 0.5, 1.0, 2.0})
      measure({.tolerance = tolerance}, "tolerance", bodies, runs, table);
    for (const int height : {360, 720, 1080})
      measure({.width = height * 16 / 9, .height = height}, "size", bodies, runs, table);
    return 0;
  });
}
