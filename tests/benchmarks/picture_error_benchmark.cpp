// SPDX-License-Identifier: LGPL-2.1-or-later
// What a composite's time buys: the shadow's error against 1,024 rays, the mirror image's and the
// whole picture's against a plain ray tracer, for each backend. picture_plots.gp draws the tables.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <tuple>

#include "base/srgb.h"
#include "command_line.h"
#include "figure_stage.h"
#include "flip.h"
#include "gl_context.h"
#include "measure.h"
#include "render/gl/compositor.h"
#include "render/processor/processor_renderer.h"
#include "simple_trace.h"

namespace {

using namespace polyhull;
using benchmark::median, benchmark::now, benchmark::Table;
using synthetic::FigureStage, synthetic::ShadowTruth;

constexpr std::tuple<ShadowQuality, const char*> qualities[] = {{ShadowQuality::off, "off"},
                                                                {ShadowQuality::hard, "hard"},
                                                                {ShadowQuality::fast, "fast"},
                                                                {ShadowQuality::good, "good"},
                                                                {ShadowQuality::best, "best"}};

std::unique_ptr<Renderer> renderer_of(bool processor) {
  if (processor) return std::make_unique<ProcessorRenderer>();
  return std::make_unique<Compositor>();
}

/// Processor time of a frame whose mesh is new, milliseconds: the median of nine.
double milliseconds(FigureStage& stage, Renderer& renderer, const RenderSettings& settings) {
  std::vector<double> times;
  for (int i = 0; i < 10; ++i) {
    stage.frame.subjects[0].content = 0;
    const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
    stage.composite(renderer, settings);
    if (i > 0) times.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - begin);
  }
  return median(times);
}

struct ShadowError {
  double rms = 0.0, bias = 0.0, p99 = 0.0;
};

/// What the lamps alone give at \p place, all channels together, as a picture value.
double lit(const FigureStage& stage, const ShadowTruth::Place& place) {
  const Material& material = stage.scene->materials[static_cast<std::size_t>(place.material)];
  return glm::dot(material.base_colour, place.light) * std::numbers::inv_pi * stage.frame.exposure;
}

/// Of the share of the lamps' light, over the pixels that the truth or \p renderer shades and that
/// the lamps light well. Read from even backgrounds of many values: together their steps are fine.
ShadowError shadow_error(FigureStage& stage, Renderer& renderer, const RenderSettings& settings,
                         const ShadowTruth& truth) {
  std::vector<double> taken(truth.places.size(), 0.0);
  constexpr int first = 176, values = 24;
  for (int value = first; value < first + values; ++value) {
    stage.fill_background(static_cast<std::uint8_t>(value));
    const Picture out = stage.composite(renderer, settings);
    for (std::size_t i = 0; i < truth.places.size(); ++i) {
      const auto& place = truth.places[i];
      const std::uint8_t* p = out.row(place.y) + 4 * place.x;
      double lost = 0.0;
      for (int c = 0; c < 3; ++c)
        lost += srgb_to_linear(static_cast<std::uint8_t>(value)) - srgb_to_linear(p[c]);
      taken[i] += lost / lit(stage, place) / static_cast<double>(values);
    }
  }
  ShadowError out;
  std::vector<double> all;
  for (std::size_t i = 0; i < truth.places.size(); ++i) {
    if (lit(stage, truth.places[i]) < 0.3) continue;
    if (truth.places[i].taken == 0.0f && taken[i] == 0.0) continue;
    const double error = taken[i] - truth.places[i].taken;
    all.push_back(std::abs(error));
    out.rms += error * error;
    out.bias += error;
  }
  std::sort(all.begin(), all.end());
  out.rms = std::sqrt(out.rms / static_cast<double>(all.size()));
  out.bias /= static_cast<double>(all.size());
  out.p99 = all[all.size() * 99 / 100];
  return out;
}

void shadows(const std::string& folder, const std::vector<bool>& backends) {
  Table table(folder + "/picture_shadow.csv", "backend,shadow,processor_ms,rms,p99,bias,lamps");
  for (const int lamps : {1, 4, 40}) {
    FigureStage stage(1280, 720, false);
    stage.frame.lights = synthetic::ceiling_lamps(stage.frame.lights[0], lamps);
    const ShadowTruth truth(stage, 32, lamps == 1 ? 5 : lamps == 4 ? 9 : 27);
    // As bright as can be while no place loses more than the backgrounds have.
    double most = 0.0;
    for (const auto& place : truth.places) most = std::max(most, lit(stage, place));
    stage.frame.exposure *= static_cast<float>(0.9 / most);
    for (const bool processor : backends) {
      const auto renderer = renderer_of(processor);
      for (const auto& [quality, name] : qualities) {
        if (quality == ShadowQuality::off) continue;
        RenderSettings settings;
        settings.shadow = quality;
        const ShadowError error = shadow_error(stage, *renderer, settings, truth);
        table.row("%s,%s,%.2f,%.4f,%.4f,%+.4f,%d", processor ? "processor" : "gl", name,
                  milliseconds(stage, *renderer, settings), error.rms, error.p99, error.bias,
                  lamps);
      }
    }
  }
}

void mirrors(const std::string& folder, const std::vector<bool>& backends) {
  FigureStage stage(960, 540);
  stage.trace_background(8, 3);
  const Picture truth = stage.truth(8, 3);
  Table table(folder + "/picture_mirror.csv",
              "backend,shadow,edge_samples,processor_ms,mirror_db,whole_db,flip");
  for (const bool processor : backends) {
    const auto renderer = renderer_of(processor);
    for (const auto& [quality, name] : qualities) {
      for (const int samples : {1, 2, 4, 8}) {
        // Edges cost the same whatever the shadow.
        if (samples != 4 && quality != ShadowQuality::good) continue;
        RenderSettings settings, none;
        settings.shadow = none.shadow = quality;
        settings.edge_samples = none.edge_samples = samples;
        none.mirror = MirrorMode::off;
        const Picture with = stage.composite(*renderer, settings);
        const Picture without = stage.composite(*renderer, none);
        const auto mirrored = [&](int x, int y) {
          const std::uint8_t *a = with.row(y) + 4 * x, *b = without.row(y) + 4 * x;
          return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) > 2;
        };
        table.row("%s,%s,%d,%.2f,%.2f,%.2f,%.4f", processor ? "processor" : "gl", name, samples,
                  milliseconds(stage, *renderer, settings), synthetic::psnr(with, truth, mirrored),
                  synthetic::psnr(with, truth), synthetic::mean_flip(truth, with));
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("picture_error_benchmark", "What a composite's time buys");
  std::string folder = ".", backend = "all";
  command.option("--output", &folder, "folder for picture_shadow.csv and picture_mirror.csv");
  command.option("--backend", &backend, "processor, gl or all");
  if (const auto status = command.parse(argc, argv)) return *status;
  polyhull::testing::HeadlessContext context(false);
  std::vector<bool> backends;
  if (backend != "gl") backends.push_back(true);
  if (backend != "processor" && context.ready()) backends.push_back(false);
  shadows(folder, backends);
  mirrors(folder, backends);
  return 0;
}
