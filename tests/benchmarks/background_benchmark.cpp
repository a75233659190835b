// SPDX-License-Identifier: LGPL-2.1-or-later
// What a new view of the built-in room costs, rasterised and by rays: wall time and the processor
// time of all threads, medians over an orbit; and how far each is from the path tracer's picture. With
// --tables, what the light costs and how far from the path tracer's its pictures are, into
// scenesrc_light.tsv there.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include "base/thread_pool.h"
#include "builtin/room.h"
#include "command_line.h"
#include "measure.h"
#include "support/picture_error.h"
#include "view/background.h"
#include "view/gradual_light.h"
#include "view/raster_view.h"

namespace {

using namespace polyhull;
using benchmark::median, benchmark::now;
using synthetic::psnr;

/// The demo's viewport.
Camera viewport(double degrees, int width, int height) {
  const double a = degrees * std::numbers::pi / 180.0;
  return look_at({2.7 * std::sin(a), 1.5, 2.7 * std::cos(a)}, {0.0, 0.98, 0.0}, 52.0, width,
                 height);
}

Picture picture_of(const Background& background) {
  Picture out{background.width(), background.height(), 4, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height * 4);
  background.write(out.pixels.data(), 4 * static_cast<std::size_t>(out.width), 0);
  return out;
}

struct Row {
  ViewMethod method;
  const char* name;
  std::vector<double> wall{}, processor{}, write{}, write_processor{}, rays{}, smoothed{};
};

constexpr double truth_angles[] = {30.0, 150.0, 270.0};

std::vector<Picture> truth_pictures(const TracedScene& scene, int samples) {
  PathOptions paths;
  paths.light_samples = paths.bounce_samples = 4;
  std::vector<Picture> out;
  for (const double angle : truth_angles)
    out.push_back(trace_picture(scene, viewport(angle, 640, 360),
                                static_cast<std::uint32_t>(samples), paths));
  return out;
}

/// A row for each light: the first of a live stream, then by the distance between points.
void write_light_table(const std::string& folder, const TracedScene& scene,
                       const std::vector<Picture>& truth) {
  std::FILE* file = std::fopen((folder + "/scenesrc_light.tsv").c_str(), "w");
  if (file == nullptr) {
    std::fprintf(stderr, "%s/scenesrc_light.tsv cannot be written.\n", folder.c_str());
    std::exit(1);
  }
  std::fprintf(file, "light\tspacing_m\trays\tprocessor_s\twall_s\tpsnr_db\n");
  const auto row = [&](const char* name, const LightCacheOptions& options, auto&& make) {
    const double wall = now(CLOCK_MONOTONIC), busy = now(CLOCK_PROCESS_CPUTIME_ID);
    const std::unique_ptr<LightCache> light = make(options);
    const double wall_s = 1e-3 * (now(CLOCK_MONOTONIC) - wall);
    const double busy_s = 1e-3 * (now(CLOCK_PROCESS_CPUTIME_ID) - busy);
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      std::vector<Vec3f> picture(640 * 360);
      RasterView(scene, *light).draw(viewport(truth_angles[i], 640, 360), {}, picture);
      sum += psnr(develop(picture, 1.0f, 640, 360), truth[i]);
    }
    std::fprintf(file, "%s\t%.4f\t%llu\t%.3f\t%.3f\t%.2f\n", name, options.spacing,
                 static_cast<unsigned long long>(light->rays()), busy_s, wall_s,
                 sum / static_cast<double>(truth.size()));
  };
  row("first of a live stream", {},
      [&](const LightCacheOptions& options) { return GradualLight::first(scene, options); });
  for (const float spacing : {0.2f, 0.1f, 0.05f, 0.025f}) {
    LightCacheOptions options;
    options.spacing = spacing;
    options.bounce_spacing = 5.6f * spacing;  // as scenesrc has it
    row("exact", options,
        [&](const LightCacheOptions& with) { return std::make_unique<LightCache>(scene, with); });
  }
  std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("background_benchmark", "What a new view of a background costs");
  std::string size = "1280x720", keep, only, tables;
  int views = 30, truth = 0;
  double step = 12.0;
  command.option("--size", &size, "WIDTHxHEIGHT");
  command.option("--views", &views, "views of the orbit");
  command.option("--step", &step, "degrees between them");
  command.option("--only", &only, "raster or rays");
  command.option("--truth", &truth,
                 "path-traced samples per pixel that three views are held against");
  command.option("--keep", &keep, "folder for the views");
  command.option("--tables", &tables, "folder for the table of lights; with --truth");
  if (const auto status = command.parse(argc, argv)) return *status;
  int width = 0, height = 0;
  if (std::sscanf(size.c_str(), "%dx%d", &width, &height) != 2 || width < 1 || height < 1) {
    std::fprintf(stderr, "--size is '%s'; it takes WIDTHxHEIGHT, such as 1280x720.\n",
                 size.c_str());
    return 1;
  }
  Background background(room_scene());
  const std::vector<Light> lights = background.scene().lights;
  const float exposure = background.scene().exposure;
  Row rows[] = {{ViewMethod::raster, "raster"}, {ViewMethod::rays, "rays"}};
  background.update(viewport(-step, width, height), lights, exposure);
  for (int i = 0; i < views; ++i) {
    for (Row& row : rows) {
      if (!only.empty() && only != row.name) continue;
      background.set_method(row.method);
      const double wall = now(CLOCK_MONOTONIC), busy = now(CLOCK_PROCESS_CPUTIME_ID);
      background.update(viewport(step * i, width, height), lights, exposure);
      const double drawn = now(CLOCK_MONOTONIC), drawn_busy = now(CLOCK_PROCESS_CPUTIME_ID);
      const Picture picture = picture_of(background);
      row.wall.push_back(drawn - wall);
      row.processor.push_back(drawn_busy - busy);
      row.write.push_back(now(CLOCK_MONOTONIC) - drawn);
      row.write_processor.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - drawn_busy);
      row.rays.push_back(static_cast<double>(background.view_statistics().rays));
      row.smoothed.push_back(static_cast<double>(background.view_statistics().smoothed));
      if (!keep.empty()) {
        char name[64];
        std::snprintf(name, sizeof name, "/%s-%03d.png", row.name, i);
        save_picture(picture, keep + name);
      }
    }
  }
  std::printf("%-7s %9s %9s %10s %10s %9s %9s\n", "method", "wall ms", "cpu ms", "write wall",
              "write cpu", "rays", "smoothed");
  for (const Row& row : rows)
    std::printf("%-7s %9.2f %9.2f %10.2f %10.2f %9.0f %9.0f\n", row.name, median(row.wall),
                median(row.processor), median(row.write), median(row.write_processor),
                median(row.rays), median(row.smoothed));
  if (truth <= 0) return 0;
  const TracedScene scene(background.scene());
  const std::vector<Picture> references = truth_pictures(scene, truth);
  for (std::size_t i = 0; i < references.size(); ++i) {
    for (const Row& row : rows) {
      background.set_method(row.method);
      background.update(viewport(truth_angles[i], 640, 360), lights, exposure);
      std::printf("%3.0f degrees: %-7s PSNR %.2f dB\n", truth_angles[i], row.name,
                  psnr(picture_of(background), references[i]));
    }
  }
  if (!tables.empty()) write_light_table(tables, scene, references);
  return 0;
}
