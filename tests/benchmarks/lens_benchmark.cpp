// SPDX-License-Identifier: LGPL-2.1-or-later
// What the viewport's lens costs beside the composite that goes through it: wall time and the
// processor time of all threads, medians over frames of a figure in the built-in room, drawn by the
// processor. The background is that of the pinhole in all rows: the time does not hang on it. Where it
// moves, each frame has another one.

#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "builtin/room.h"
#include "command_line.h"
#include "measure.h"
#include "render/lens/lens_picture.h"
#include "render/processor/processor_renderer.h"
#include "synthetic.h"
#include "texture/texture_hull.h"
#include "view/background.h"

namespace {

using namespace polyhull;
using benchmark::median, benchmark::now;

Camera viewport(double degrees, double field_of_view, int width, int height) {
  const double a = degrees * std::numbers::pi / 180.0;
  return look_at({2.7 * std::sin(a), 1.5, 2.7 * std::cos(a)}, {0.0, 0.9, 0.0}, field_of_view, width,
                 height);
}

struct Row {
  const char* name;
  double turn;  // of the viewport from frame to frame, degrees
  std::function<void(ViewportLens&, Camera&)> set;
  double zoom = 0.0;         // from frame to frame, degrees
  bool moves = turn != 0.0;  // the background
};

const std::vector<Row>& rows() {
  const auto distort = [](ViewportLens&, Camera& camera) {
    camera.distortion = {-0.2, 0.05, 0.001, -0.001, 0.0};
  };
  const auto falloff = [](ViewportLens& lens, Camera&) { lens.falloff = {-1.84, 1.81, -0.73}; };
  const auto grain = [](ViewportLens& lens, Camera&) { lens.grain = 0.02; };
  const auto focus = [](double aperture, bool subject) {
    return [aperture, subject](ViewportLens& lens, Camera&) {
      lens.aperture = aperture;
      lens.focus_distance = 1.5;
      lens.subject_only = subject;
    };
  };
  const auto open = [](bool subject) {
    return [subject](ViewportLens& lens, Camera&) {
      lens.shutter = 0.5;
      lens.still_background = subject;
    };
  };
  static const std::vector<Row> made{
      {"none", 0.0, [](ViewportLens&, Camera&) {}},
      {"distortion", 0.0, distort},
      {"none, background moves", 0.0, [](ViewportLens&, Camera&) {}, 0.0, true},
      {"distortion, background moves", 0.0, distort, 0.0, true},
      {"distortion, travels", 1.0, distort},
      {"none, zooms", 0.0, [](ViewportLens&, Camera&) {}, 0.1, true},
      {"distortion, zooms", 0.0, distort, 0.1, true},
      {"fall-off", 0.0, falloff},
      {"grain", 0.0, grain},
      {"depth of field, 18 mm", 0.0, focus(0.018, false)},
      {"depth of field, 50 mm", 0.0, focus(0.05, false)},
      {"depth of field, 18 mm, subject", 0.0, focus(0.018, true)},
      {"none, travels", 1.0, [](ViewportLens&, Camera&) {}},
      {"depth of field, 18 mm, travels", 1.0, focus(0.018, false)},
      {"motion blur, 180 degrees", 1.0, open(false)},
      {"motion blur, 180 degrees, subject", 1.0, open(true)},
      {"all", 1.0,
       [=](ViewportLens& lens, Camera& camera) {
         for (const auto& set : {std::function<void(ViewportLens&, Camera&)>(distort),
                                 std::function<void(ViewportLens&, Camera&)>(falloff),
                                 std::function<void(ViewportLens&, Camera&)>(grain),
                                 std::function<void(ViewportLens&, Camera&)>(focus(0.018, false)),
                                 std::function<void(ViewportLens&, Camera&)>(open(false))})
           set(lens, camera);
       }},
  };
  return made;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("lens_benchmark", "What the viewport's lens costs");
  std::string size = "1280x720", output = ".", keep, only;
  int frames = 9;
  command.option("--size", &size, "WIDTHxHEIGHT");
  command.option("--frames", &frames, "frames of each row, and one before them");
  command.option("--only", &only, "rows with this in their names");
  command.option("--output", &output, "folder for lens.csv");
  command.option("--keep", &keep, "folder for the last picture of each row");
  if (const auto status = command.parse(argc, argv)) return *status;
  int width = 0, height = 0;
  if (std::sscanf(size.c_str(), "%dx%d", &width, &height) != 2 || width < 1 || height < 1) {
    std::fprintf(stderr, "--size is '%s'; it takes WIDTHxHEIGHT, such as 1280x720.\n",
                 size.c_str());
    return 1;
  }
  synthetic::Photographed figure = synthetic::photographed(
      synthetic::figure(24), synthetic::ring(4, 3.2, 1.5, {0, 1, 0}, 512, 512, 60.0));
  std::vector<Camera> cameras;
  for (const MeshView& view : figure.mesh.views) cameras.push_back(view.calibration);
  figure.mesh.texturing =
      texture_hull(figure.mesh.hull, cameras, {.metric = TextureMetric::camera_normal});
  const auto scene = std::make_shared<const Scene>(room_scene());
  Picture before{width, height, 4,
                 std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height * 4)};
  Background background(*scene);
  background.update(viewport(30.0, 50.0, width, height), scene->lights, scene->exposure);
  background.write(before.pixels.data(), 4 * static_cast<std::size_t>(width), 0);
  Picture other = before;
  for (std::uint8_t& code : other.pixels) code ^= code < 255 ? 1 : 0;

  benchmark::Table table(output + "/lens.csv", "lens,width,height,wall_ms,processor_ms");
  const RenderSettings settings;
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (std::string(row.name).find(only) == std::string::npos) continue;
    ProcessorRenderer renderer;
    LensPicture picture;
    std::vector<double> wall, processor;
    Picture out = before;
    for (int frame_number = 0; frame_number <= frames; ++frame_number) {
      const auto camera_at = [&](int frame_at) {
        return viewport(30.0 + row.turn * (frame_at - frames),
                        50.0 + row.zoom * (frame_at - frames), width, height);
      };
      RenderFrame frame;
      frame.width = width;
      frame.height = height;
      frame.scene = scene;
      frame.lights = scene->lights;
      frame.exposure = scene->exposure;
      frame.viewport = camera_at(frame_number);
      frame.subjects = {{&figure.mesh, {}, 0}};
      ViewportLens lens;
      row.set(lens, frame.viewport);
      Camera last = camera_at(frame_number - 1);
      last.distortion = frame.viewport.distortion;
      const Picture& shown = row.moves && frame_number % 2 == 0 ? other : before;
      out.pixels = shown.pixels;
      const double begin = now(CLOCK_MONOTONIC), busy = now(CLOCK_PROCESS_CPUTIME_ID);
      picture.set(frame, lens, &last);
      const RenderPlan plan = renderer.plan(frame, settings);
      picture.draw(frame, plan, static_cast<std::uint64_t>(frame_number), shown.pixels.data(),
                   4 * width, out.pixels.data(), 4 * width,
                   [&](const RenderPlan& part, const std::uint8_t* from, int from_stride,
                       std::uint8_t* to, int to_stride) {
                     renderer.render(frame, part, settings, from, from_stride, to, to_stride);
                   });
      if (frame_number == 0) continue;  // makes what stays
      wall.push_back(now(CLOCK_MONOTONIC) - begin);
      processor.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - busy);
    }
    table.row("%s,%d,%d,%.1f,%.1f", row.name, width, height, median(wall), median(processor));
    if (!keep.empty()) save_picture(out, keep + "/lens-" + std::to_string(i) + ".png");
  }
  return 0;
}
