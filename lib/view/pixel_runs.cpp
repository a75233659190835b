// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/pixel_runs.h"

#include <algorithm>
#include <bit>

#include "raster/screen_triangles.h"

namespace polyhull {
namespace {

constexpr unsigned sets = 1u << packed_samples;

/// Of all sets of samples their share of a pixel, and their mean's place from its middle.
struct MeanPlaces {
  float weight[sets] = {}, right[sets] = {}, down[sets] = {};

  MeanPlaces() {
    const auto places = sample_places(packed_samples);
    for (unsigned samples = 1; samples < sets; ++samples) {
      float x = 0.0f, y = 0.0f;
      for (int s = 0; s < packed_samples; ++s)
        if (samples >> s & 1) x += places[s][0], y += places[s][1];
      const auto count = static_cast<float>(std::popcount(samples));
      weight[samples] = count / packed_samples;
      right[samples] = x / count - 0.5f;
      down[samples] = y / count - 0.5f;
    }
  }
};

const MeanPlaces mean_places;

}  // namespace

/// The run that pixel \p x goes on with, or a new one.
PixelRun& PixelRuns::run_at(std::uint32_t number, int x) {
  for (int i = 0; i < open_; ++i) {
    PixelRun& run = runs_[order_[i]];
    if (run.number == number && run.end() == x) return run;
  }
  PixelRun& run = runs_[order_[open_++]];
  run.number = number;
  run.first = x;
  run.count = 0;
  return run;
}

void PixelRuns::add(std::uint32_t number, int x, unsigned samples) {
  PixelRun& run = run_at(number, x);
  const int i = run.count++;
  run.samples[i] = static_cast<std::uint8_t>(samples);
  run.weight[i] = mean_places.weight[samples];
  run.right[i] = mean_places.right[samples];
  run.down[i] = mean_places.down[samples];
}

void PixelRuns::add_whole(std::uint32_t number, int x, int count) {
  PixelRun& run = run_at(number, x);
  std::fill_n(run.samples + run.count, count, static_cast<std::uint8_t>(sets - 1u));
  std::fill_n(run.weight + run.count, count, 1.0f);
  std::fill_n(run.right + run.count, count, 0.0f);
  std::fill_n(run.down + run.count, count, 0.0f);
  run.count += count;
}

}  // namespace polyhull
