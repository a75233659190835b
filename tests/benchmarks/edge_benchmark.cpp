// SPDX-License-Identifier: LGPL-2.1-or-later
// What the subject's outline costs and how far it is from the truth: a sharp and a hairy figure, mattes
// as keyed and blurred, seen from a camera, near one and between two.

#include <cstdio>
#include <fstream>
#include <memory>
#include <numbers>

#include "command_line.h"
#include "gl_context.h"
#include "measure.h"
#include "render/gl/compositor.h"
#include "render/processor/processor_renderer.h"
#include "scene/scene.h"
#include "studio_mesh.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::median, benchmark::now;

constexpr std::array<std::uint8_t, 3> behind{70, 105, 150};

struct Drawn {
  Picture picture;
  double processor = 0.0;  // ms, median
};

Drawn draw(Renderer& renderer, const StudioMesh& studio, const Camera& viewport,
           const RenderSettings& settings, int rounds) {
  RenderFrame frame;
  frame.width = viewport.width;
  frame.height = viewport.height;
  frame.viewport = viewport;
  frame.subjects = {{&studio.mesh, {}, 0}};
  Picture before{viewport.width, viewport.height, 4, {}};
  for (int i = 0; i < viewport.width * viewport.height; ++i)
    before.pixels.insert(before.pixels.end(), {behind[0], behind[1], behind[2], 255});
  Drawn out;
  std::vector<double> times;
  for (int round = 0; round < rounds; ++round) {
    out.picture = before;
    const double start = now(CLOCK_PROCESS_CPUTIME_ID);
    renderer.render(frame, renderer.plan(frame, settings), settings, before.pixels.data(),
                    4 * viewport.width, out.picture.pixels.data(), 4 * viewport.width);
    times.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - start);
  }
  out.processor = median(times);
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("edge_benchmark", "What outlines cost and how far they are from the truth");
  std::string output = ".", keep;
  int cameras = 8, rounds = 9;
  bool gl = false;
  command.option("output", &output, "folder for edges.tsv");
  command.option("--cameras", &cameras, "of the ring");
  command.option("--rounds", &rounds, "times that each picture is drawn");
  command.option("--keep", &keep, "folder for the pictures");
  command.flag("--gl", &gl, "by OpenGL");
  if (const auto status = command.parse(argc, argv)) return *status;
  polyhull::testing::HeadlessContext context(false);
  std::unique_ptr<Renderer> renderer;
  if (gl)
    renderer = std::make_unique<Compositor>();
  else
    renderer = std::make_unique<ProcessorRenderer>();
  const Rig rig = ring_rig(cameras);
  std::ofstream table(output + "/edges.tsv");
  const std::string head =
      "subject\tsigma\tdegrees\tsoft\tsamples\tprocessor_ms\tmean_error\trms_error\n";
  table << head;
  std::fputs(head.c_str(), stdout);
  for (const char* subject : {"figure", "hairy"}) {
    for (const double sigma : {0.0, 1.5}) {
      SilhouetteSettings silhouette;
      silhouette.blur.sigma = sigma;
      silhouette.approximate.tolerance = 0.5;
      silhouette.approximate.min_area = 100;
      const StudioMesh studio = studio_mesh(rig, subject, 3.0, silhouette);
      for (const double share : {0.0, 0.1, 0.25, 0.5}) {  // of the way to the next camera
        const double degrees = 360.0 / cameras * share;
        const double a = degrees * std::numbers::pi / 180.0;
        Camera viewport =
            look_at({3.0 * std::sin(a), 1.2, 3.0 * std::cos(a)}, {0.0, 0.95, 0.0}, 60.0, 1024, 768);
        viewport.K = rig.cameras[0].K;
        const Picture truth = studio_truth(viewport, subject, 3.0, behind);
        for (const bool soft : {false, true}) {
          for (const int samples : {1, 2, 4, 8}) {
            RenderSettings settings;
            settings.edge_samples = samples;
            settings.soft_edges = soft;
            const Drawn drawn = draw(*renderer, studio, viewport, settings, rounds);
            const EdgeError error = edge_error(drawn.picture, truth);
            char row[200];
            std::snprintf(row, sizeof row, "%s\t%.1f\t%.1f\t%d\t%d\t%.2f\t%.2f\t%.2f\n", subject,
                          sigma, degrees, soft, samples, drawn.processor, error.mean, error.rms);
            table << row;
            std::fputs(row, stdout);
            std::fflush(stdout);
            if (!keep.empty() && samples == 4) {
              std::snprintf(row, sizeof row, "/%s-%.1f-%.1f-%s.png", subject, sigma, degrees,
                            soft ? "soft" : "hard");
              save_picture(drawn.picture, keep + row);
            }
          }
        }
        if (!keep.empty()) {
          char name[100];
          std::snprintf(name, sizeof name, "/%s-%.1f-truth.png", subject, degrees);
          Picture opaque = truth;
          for (std::size_t i = 3; i < opaque.pixels.size(); i += 4) opaque.pixels[i] = 255;
          save_picture(opaque, keep + name);
        }
      }
    }
  }
  return 0;
}
