// SPDX-License-Identifier: LGPL-2.1-or-later
// From contours and pictures to a drawn frame, three ways: the image-based hull, the polyhedral hull and
// the refined surface, both textured; time on one thread, and error half way between cameras. One of
// cameras, contour tolerance and output size changes at a time; imagehull.csv.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "base/thread_pool.h"
#include "imagehull/image_subject.h"
#include "measure.h"
#include "mesh/texture_mesh.h"
#include "refine/refine.h"
#include "render/processor/processor_renderer.h"
#include "silhouette/contour/contourer.h"
#include "silhouette/silhouette.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::median, benchmark::now, benchmark::Table;

constexpr std::uint8_t grey = 24;  // behind the bodies of body_scenes.h

/// What is changed.
struct Case {
  std::string rig = "5";
  double tolerance = 0.5;  // px
  int width = 1280, height = 720;
};

/// A body and its views, with contours of a case's tolerance, and pixels of their boxes alone.
struct Take {
  BodyScene scene;
  Mesh views;
  std::size_t vertices = 0;

  Take(BodyScene from, double tolerance) : scene(std::move(from)) {
    for (std::size_t k = 0; k < scene.cameras.size(); ++k) {
      const Picture& picture = scene.pictures[k];
      Matte matte;
      load_matte(picture.pixels.data() + 3, 4 * picture.width, 4, picture.width, picture.height,
                 matte);
      ContourSettings settings;
      settings.approximate.tolerance = tolerance;
      MeshView& out = views.views.emplace_back();
      out.calibration = scene.cameras[k];
      out.view.camera = out.calibration.name;
      out.view.width = picture.width;
      out.view.height = picture.height;
      scene.contours[k] = out.view.contours = Contourer().find(matte, settings);
      out.view.roi = bounding_rectangle(out.view.contours, picture.width, picture.height);
      out.view.format = PixelFormat::rgba;
      out.view.stride = 4 * picture.width;
      const std::size_t first =
          4 * (static_cast<std::size_t>(out.view.roi.y) * picture.width + out.view.roi.x);
      out.view.pixels = std::span(picture.pixels).subspan(first);
      vertices += out.view.contours.points.size();
    }
  }
};

/// A way to a subject that can be drawn; its mesh is kept.
struct Method {
  const char* name;
  std::function<RenderSubject(const Take&, Mesh&)> make;
};

std::vector<Method> methods() {
  const auto textured = [](Mesh& mesh) {
    TextureSettings settings;
    settings.metric = TextureMetric::viewing_angle;
    texture_mesh(mesh, settings);
    return RenderSubject{&mesh, {}, 0, nullptr};
  };
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
             return textured(mesh);
           }},
          {"refined", [=](const Take& take, Mesh& mesh) {
             mesh = take.views;
             HullRefiner refiner;
             mesh.hull = refiner.refine(
                 hull(take), camera_contours(take.scene.cameras, take.scene.contours), 1.0,
                 {.quality = RefineQuality::fast, .threads = 1, .reuse = false});
             return textured(mesh);
           }}};
}

Picture drawn(ProcessorRenderer& renderer, const RenderSubject& subject, const Camera& viewport,
              int width, int height, int samples, std::uint8_t before) {
  RenderFrame frame;
  frame.width = width;
  frame.height = height;
  frame.viewport = viewport;
  frame.subjects = {subject};
  RenderSettings settings;
  settings.edge_samples = samples;
  Picture out{width, height, 4, {}};
  out.pixels.assign(static_cast<std::size_t>(width) * height * 4, before);
  const Picture background = out;
  const RenderPlan plan = renderer.plan(frame, settings);
  renderer.render(frame, plan, settings, background.pixels.data(), 4 * width, out.pixels.data(),
                  4 * width);
  return out;
}

struct Row {
  std::vector<double> make, draw;  // ms
  double overlap = 0.0, psnr = 0.0, views = 0.0;
};

/// IoU of half coverage and PSNR where either is, half way between cameras.
void add_error(const Take& take, const RenderSubject& subject, Row& row) {
  ProcessorRenderer renderer;
  for (std::size_t k = 0; k < take.scene.between.size(); ++k) {
    const Camera& camera = take.scene.between[k];
    const Picture& truth = take.scene.seen[k];
    const auto picture = [&](std::uint8_t before) {
      return drawn(renderer, subject, camera, camera.width, camera.height, 8, before);
    };
    const Picture seen = picture(grey), black = picture(0), white = picture(255);
    double both = 0.0, either = 0.0, sum = 0.0, count = 0.0;
    for (std::size_t p = 0; p < seen.pixels.size(); p += 4) {
      const int through = white.pixels[p] - black.pixels[p];
      const bool ours = through < 128, theirs = truth.pixels[p + 3] >= 128;
      both += ours && theirs;
      either += ours || theirs;
      if (through == 255 && truth.pixels[p + 3] == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = seen.pixels[p + c] - truth.pixels[p + c];
        sum += off * off;
      }
      count += 3.0;
    }
    row.overlap += both / either;
    row.psnr += 10.0 * std::log10(255.0 * 255.0 * count / sum);
    row.views += 1.0;
  }
}

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
        drawn(renderer, subject, take.scene.between[0], now_is.width, now_is.height, 4, grey);
        const double end = now(CLOCK_PROCESS_CPUTIME_ID);
        if (run >= 0) {
          rows[m].make.push_back(made - begin);
          rows[m].draw.push_back(end - made);
        } else {
          add_error(take, subject, rows[m]);
        }
      }
    set_pool_threads(0);
  }
  for (std::size_t m = 0; m < ways.size(); ++m)
    table.row("%s,%s,%s,%.2f,%.0f,%d,%.2f,%.2f,%.4f,%.2f", changed, ways[m].name,
              now_is.rig.c_str(), now_is.tolerance, vertices, now_is.height, median(rows[m].make),
              median(rows[m].draw), rows[m].overlap / rows[m].views, rows[m].psnr / rows[m].views);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Image-based hull, polyhedral hull and refined surface: time and error."};
  std::string output = ".";
  int runs = 5;
  app.add_option("--output", output, "Folder for the table")->check(CLI::ExistingDirectory);
  app.add_option("--runs", runs, "Runs that are timed")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  try {
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
  } catch (const std::exception& error) {
    std::fprintf(stderr, "imagehull_benchmark: %s\n", error.what());
    return 1;
  }
  return 0;
}
