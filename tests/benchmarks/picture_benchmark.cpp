// SPDX-License-Identifier: LGPL-2.1-or-later
// What a composite costs on each backend: wall time and the processor time of all threads, medians
// over recorded meshes before the built-in room, with a still and a travelling viewport, for the
// latter also with the background's planes as they come from scenesrc; how many pixels are shaded and
// how many change; what OpenGL uploads of the background after its first frame, and for how many of the
// frames after that nothing of the scene is drawn anew.

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <numbers>

#include "base/error.h"
#include "base/thread_pool.h"
#include "builtin/room.h"
#include "command_line.h"
#include "gl_context.h"
#include "measure.h"
#include "render/gl/compositor.h"
#include "render/processor/processor_renderer.h"
#include "view/background.h"
#include "view/scene_planes.h"
#include "wire/mesh_payload.h"

namespace {

using namespace polyhull;
using benchmark::median, benchmark::now;

struct Recorded {
  std::vector<std::uint8_t> bytes;
  Mesh mesh;
};

std::vector<Recorded> read(const std::vector<std::string>& files) {
  std::vector<Recorded> out(files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::ifstream file(files[i], std::ios::binary);
    out[i].bytes.assign(std::istreambuf_iterator<char>(file), {});
    out[i].mesh = read_mesh(std::span<const std::uint8_t>(out[i].bytes));
  }
  return out;
}

Camera viewport(double degrees, int width, int height) {
  const double a = degrees * std::numbers::pi / 180.0;
  return look_at({2.7 * std::sin(a), 1.5, 2.7 * std::cos(a)}, {0.0, 0.9, 0.0}, 50.0, width, height);
}

std::unique_ptr<Renderer> make_compositor(bool wait_for_passes) {
  auto made = std::make_unique<Compositor>();
  made->wait_for_passes(wait_for_passes);
  return made;
}

/// As a background's drawing has them ready.
std::shared_ptr<const ScenePlanes> planes_of(const Scene& scene, const Camera& camera) {
  const auto triangles = std::make_shared<SceneOnScreen>();
  const Mat4 pixels = pixels_from_scene(camera);
  triangles->set(scene, pixels, {}, camera.width, camera.height, 0);
  return std::make_shared<const ScenePlanes>(
      ScenePlanes{geometry_key(scene), pixels, camera.width, camera.height, triangles});
}

/// How many pixels differ.
std::size_t pixels_changed(const Picture& before, const Picture& after) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < after.pixels.size(); i += 4)
    count += std::memcmp(&before.pixels[i], &after.pixels[i], 4) != 0;
  return count;
}

/// So many lamps all over the ceiling, of some colours, as bright as \p own together.
std::vector<Light> shared(const Light& own, int count) {
  std::vector<Light> out;
  for (int i = 0; i < count; ++i) {
    Light light = own;
    if (i > 0) {
      light.centre.x = -2.2f + 4.4f * static_cast<float>(i * 7 % 10) / 9.0f;
      light.centre.z = -2.2f + 4.4f * static_cast<float>(i * 3 % 7) / 6.0f;
    }
    light.radiance *=
        Vec3f(1.0f, i % 2 ? 0.8f : 1.0f, i % 3 ? 1.0f : 0.7f) / static_cast<float>(count);
    out.push_back(light);
  }
  return out;
}

enum class Viewport { still, travels, given };

constexpr const char* name_of(Viewport viewport) {
  return viewport == Viewport::still     ? "still"
         : viewport == Viewport::travels ? "travels"
                                         : "given";
}

struct Result {
  std::vector<double> wall, processor, threads, shaded, changed;
  double background_bytes = 0.0;  // uploaded after the first frame
  int planes_kept = 0;            // frames for which nothing of the scene was drawn anew
  std::vector<std::vector<double>> passes;
};

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("picture_benchmark", "What a composite costs");
  std::vector<std::string> files;
  std::string size = "1280x720", backend = "all", output, keep, only;
  int rounds = 3, lamps = 1;
  bool detailed = false, each = false, device = false;
  command.option("meshes", &files, "recorded meshes, one per file");
  command.flag("--device", &device, "says which OpenGL there is, and ends");
  command.option("--size", &size, "WIDTHxHEIGHT");
  command.option("--backend", &backend, "processor, gl or all");
  command.option("--only", &only,
                 "one row: SHADOW-still, SHADOW-travels or SHADOW-given (travels, with planes)");
  command.option("--rounds", &rounds, "times through the meshes");
  command.option("--lamps", &lamps, "that light the room, all together as bright as its own");
  command.option("--output", &output, "folder for picture.csv");
  command.option("--keep", &keep, "folder for the last picture of each row");
  command.flag("--passes", &detailed, "prints each pass's median, too");
  command.flag("--finish", &each,
               "waits for OpenGL after each pass: the passes' times are their own");
  if (const auto status = command.parse(argc, argv)) return *status;
  polyhull::testing::HeadlessContext context(false);
  if (device || context.ready())
    std::printf("OpenGL: %s\n", context.ready()
                                    ? reinterpret_cast<const char*>(glGetString(GL_RENDERER))
                                    : context.why().c_str());
  if (device) return context.ready() ? 0 : 1;
  int width = 0, height = 0;
  if (std::sscanf(size.c_str(), "%dx%d", &width, &height) != 2 || width < 1 || height < 1) {
    std::fprintf(stderr, "--size is '%s'; it takes WIDTHxHEIGHT, such as 1280x720.\n",
                 size.c_str());
    return 1;
  }
  if (files.empty()) {
    std::fprintf(stderr, "Give recorded meshes.\n");
    return 1;
  }
  const std::vector<Recorded> meshes = read(files);
  const auto scene = std::make_shared<const Scene>(room_scene());
  Picture before{width, height, 4,
                 std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height * 4, 128)};
  if (!keep.empty()) {  // for looking at
    Background background(*scene);
    background.update(viewport(30.0, width, height), scene->lights, scene->exposure);
    background.write(before.pixels.data(), 4 * static_cast<std::size_t>(width), 0);
  }

  std::printf("%-10s %-6s %-11s %9s %9s %7s %8s %8s %6s %8s %5s\n", "backend", "shadow", "viewport",
              "wall ms", "cpu ms", "threads", "shaded", "changed", "ratio", "upload B", "kept");
  std::ofstream table;
  if (!output.empty()) {
    table.open(output + "/picture.csv");
    table << "backend,shadow,viewport,width,height,wall_ms,processor_ms\n";
  }
  const struct {
    ShadowQuality quality;
    const char* name;
  } qualities[] = {{ShadowQuality::off, "off"},
                   {ShadowQuality::hard, "hard"},
                   {ShadowQuality::fast, "fast"},
                   {ShadowQuality::good, "good"},
                   {ShadowQuality::best, "best"}};
  for (const bool processor : {true, false}) {
    if (backend == (processor ? "gl" : "processor")) continue;
    if (!processor && !context.ready()) continue;
    for (const auto& [quality, name] : qualities) {
      for (const Viewport way : {Viewport::still, Viewport::travels, Viewport::given}) {
        if (!only.empty() && only != std::string(name) + "-" + name_of(way)) continue;
        if (way == Viewport::given && !processor) continue;  // OpenGL does not take them
        const bool travels = way != Viewport::still;
        std::unique_ptr<Renderer> renderer;
        if (processor)
          renderer = std::make_unique<ProcessorRenderer>();
        else
          renderer = make_compositor(each);
        RenderSettings settings;
        settings.shadow = quality;
        RenderFrame frame;
        frame.width = width;
        frame.height = height;
        frame.scene = scene;
        frame.lights = scene->lights;
        if (lamps > 1) frame.lights = shared(scene->lights[0], lamps);
        frame.exposure = scene->exposure;
        Result result;
        Picture out = before;
        int count = 0;
        for (int round = 0; round < rounds; ++round) {
          for (const Recorded& recorded : meshes) {
            frame.viewport = viewport(travels ? 30.0 + count : 30.0, width, height);
            frame.subjects = {{&recorded.mesh, {}, 0}};
            if (way == Viewport::given) frame.planes = planes_of(*scene, frame.viewport);
            out.pixels = before.pixels;
            const double wall = now(CLOCK_MONOTONIC), busy = now(CLOCK_PROCESS_CPUTIME_ID);
            const LoopWatch loops;
            const RenderPlan plan = renderer->plan(frame, settings);
            renderer->render(frame, plan, settings, before.pixels.data(), 4 * width,
                             out.pixels.data(), 4 * width);
            if (count++ == 0) continue;  // makes what stays
            result.wall.push_back(now(CLOCK_MONOTONIC) - wall);
            result.processor.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - busy);
            result.threads.push_back(loops.threads());
            result.shaded.push_back(static_cast<double>(renderer->statistics().pixels_shaded));
            result.changed.push_back(static_cast<double>(pixels_changed(before, out)));
            result.planes_kept += renderer->statistics().scene_depth_reused;
            result.background_bytes +=
                static_cast<double>(renderer->statistics().background_bytes_uploaded);
            const auto& passes = renderer->statistics().passes;
            result.passes.resize(passes.size());
            for (std::size_t i = 0; i < passes.size(); ++i)
              result.passes[i].push_back(passes[i].cpu_milliseconds);
          }
        }
        const double shaded = median(result.shaded), changed = median(result.changed);
        std::printf("%-10s %-6s %-11s %9.2f %9.2f %7.2f %8.0f %8.0f %6.2f %8.0f %2d/%zu\n",
                    processor ? "processor" : "gl", name, name_of(way), median(result.wall),
                    median(result.processor), median(result.threads), shaded, changed,
                    shaded / changed, result.background_bytes, result.planes_kept,
                    result.wall.size());
        if (detailed)
          for (std::size_t i = 0; i < result.passes.size(); ++i)
            std::printf("    %-14s %8.2f\n", renderer->statistics().passes[i].name,
                        median(result.passes[i]));
        if (table.is_open())
          table << (processor ? "processor," : "gl,") << name << ',' << name_of(way) << ',' << width
                << ',' << height << ',' << median(result.wall) << ',' << median(result.processor)
                << '\n';
        if (!keep.empty() && !travels)
          save_picture(out, keep + "/" + (processor ? "processor-" : "gl-") + name + ".png");
      }
    }
  }
  return 0;
}
