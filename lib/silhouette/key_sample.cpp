// SPDX-License-Identifier: LGPL-2.1-or-later
// Sampling the picture for screen and foreground, and the ramps from signal to alpha.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "silhouette/key_state.h"

namespace polyhull {
namespace {

constexpr double least_range =
    8.0;  // levels between screen and foreground; keeps the gain in 16 bit

std::uint8_t level(double v) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(v), 0l, 255l));
}

// Pixels of the active region on a grid of about a hundred thousand.
struct Samples {
  int step = 1;
  int columns = 0, rows = 0;
  std::vector<Rgb> colours;
};

Samples take_samples(const FrameView& frame, const Rectangle& region) {
  Samples out;
  const double pixels = static_cast<double>(region.width) * region.height;
  out.step = std::max(1, static_cast<int>(std::sqrt(pixels / 100000.0)));
  out.columns = (region.width + out.step - 1) / out.step;
  out.rows = (region.height + out.step - 1) / out.step;
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(region.width));
  for (int j = 0; j < out.rows; ++j) {
    convert_row(frame, region.y + j * out.step, region.x, region.x + region.width, row.data());
    for (int i = 0; i < out.columns; ++i) {
      const std::uint8_t* p = row.data() + 4 * static_cast<std::ptrdiff_t>(i) * out.step;
      out.colours.push_back({p[0], p[1], p[2]});
    }
  }
  return out;
}

// The most frequent saturated colour; nothing when less than 3 % of the picture has any hue.
std::optional<Rgb> dominant_hue(const Samples& samples) {
  // Directions from grey in steps of 5 degrees, counted where the saturation is clear.
  constexpr int bins = 72;
  std::array<double, bins> count{};
  const auto bin_of = [](const Rgb& c) {
    const double angle =
        std::atan2((c[1] - c[2]) / std::sqrt(2.0), (2.0 * c[0] - c[1] - c[2]) / std::sqrt(6.0));
    return static_cast<int>((angle + M_PI) / (2.0 * M_PI) * bins) % bins;
  };
  for (const Rgb& c : samples.colours)
    if (silhouette::saturation_of(c) >= 32) count[bin_of(c)] += 1.0;
  int best = 0;
  double best_count = -1.0;
  for (int i = 0; i < bins; ++i) {
    const double near_count = count[(i + bins - 1) % bins] + 2.0 * count[i] + count[(i + 1) % bins];
    if (near_count > best_count) best = i, best_count = near_count;
  }
  if (best_count < 0.03 * static_cast<double>(samples.colours.size())) return std::nullopt;
  double sum[3] = {}, n = 0.0;
  for (const Rgb& c : samples.colours) {
    const int distance = std::abs(bin_of(c) - best);
    if (silhouette::saturation_of(c) < 32 || std::min(distance, bins - distance) > 1) continue;
    for (int i = 0; i < 3; ++i) sum[i] += c[i];
    n += 1.0;
  }
  return Rgb{level(sum[0] / n), level(sum[1] / n), level(sum[2] / n)};
}

double quantile(std::vector<double>& v, double q) {
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(v.size() - 1));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

// The mean colour of the samples whose signal is within [low, high].
Rgb mean_colour(const Samples& samples, const std::vector<double>& signals, double low,
                double high) {
  double sum[3] = {}, n = 0.0;
  for (std::size_t i = 0; i < signals.size(); ++i) {
    if (signals[i] < low || signals[i] > high) continue;
    for (int c = 0; c < 3; ++c) sum[c] += samples.colours[i][c];
    n += 1.0;
  }
  if (n == 0.0) return {};
  return {level(sum[0] / n), level(sum[1] / n), level(sum[2] / n)};
}

}  // namespace

void Keyer::State::sample(const FrameView& frame) {
  if (found) return;
  hue = settings.colour;
  const bool both_given = settings.screen && settings.foreground;
  if (method == KeyMethod::difference ||
      (method == KeyMethod::prototype && settings.key != KeyColour::automatic)) {
    found = true;
    return;
  }
  samples = KeyCalibration{};
  noise = 0.0;
  Samples taken;
  if (!both_given || settings.key == KeyColour::automatic) taken = take_samples(frame, active);
  if (settings.key == KeyColour::automatic) {
    const std::optional<Rgb> dominant = settings.screen ? settings.screen : dominant_hue(taken);
    if (dominant) hue = *dominant;
  }
  const silhouette::KeySignal s =
      silhouette::key_signal(settings.key, hue, settings.red_gain, settings.blue_gain);
  std::vector<double> signals;
  for (const Rgb& c : taken.colours) signals.push_back(s.of(c[0], c[1], c[2]));

  // The screen is the peak of the signals clearly on the key's side of grey.
  double screen = 0.0;
  bool screen_seen = false;
  if (settings.screen) {
    samples.screen = *settings.screen;
    screen = s.of(samples.screen[0], samples.screen[1], samples.screen[2]);
    screen_seen = true;
  } else if (!signals.empty()) {
    std::array<double, 256> histogram{};
    for (const double d : signals)
      if (d >= 0.0) histogram[static_cast<std::size_t>(std::min(d, 255.0))] += 1.0;
    double best = 0.0;
    int peak = 0;
    for (int i = 16; i < 256; ++i) {
      double sum = 0.0;
      for (int k = std::max(i - 6, 0); k <= std::min(i + 6, 255); ++k) sum += histogram[k];
      if (sum > best) best = sum, peak = i;
    }
    if (best >= 0.02 * static_cast<double>(signals.size())) {
      std::vector<double> cluster;
      for (const double d : signals)
        if (d > 0.7 * peak && d < 1.3 * peak + 8.0) cluster.push_back(d);
      screen = quantile(cluster, 0.5);
      // From the quartiles: the tails are shadows and edges.
      noise = (quantile(cluster, 0.75) - quantile(cluster, 0.25)) / 1.349;
      samples.screen = mean_colour(taken, signals, screen - noise - 1.0, screen + noise + 1.0);
      screen_seen = true;
    }
  }
  if (!screen_seen) screen = 96.0;  // a usual screen, until one is seen

  double foreground = 0.0;
  if (settings.foreground) {
    samples.foreground = *settings.foreground;
    foreground = s.of(samples.foreground[0], samples.foreground[1], samples.foreground[2]);
  } else {
    std::vector<double> cluster;
    for (const double d : signals)
      if (d < 0.25 * screen) cluster.push_back(d);
    if (cluster.size() > signals.size() / 500 + 8) {
      // High in the cluster, so that the subject's least colourful parts are solid too; the noise
      // that this quantile picks up is taken off again.
      foreground =
          std::max(quantile(cluster, 0.9) - 1.28 * std::min(noise, 8.0), quantile(cluster, 0.5));
      samples.foreground = mean_colour(taken, signals, foreground - 8.0, foreground + 8.0);
    }
  }
  samples.screen_signal = screen;
  samples.foreground_signal = foreground;
  samples.valid = screen_seen;
  found = screen_seen;
  // Without a screen in the picture the next one is sampled again.
}

void Keyer::State::lay_out_screen(const FrameView& frame) {
  local = false;
  if (method != KeyMethod::soft) return;
  const double range = std::max(screen_level - foreground_level, least_range);
  const double clip = std::min(3.0 * noise / range, 0.25);
  const double black = std::max(settings.clip_black, clip);
  const double white = std::max(std::min(settings.clip_white, 1.0 - clip), black + 0.01);
  const auto ramp_for = [&](double screen) {
    const double local_range = std::max(screen - foreground_level, least_range);
    const double from = screen - black * local_range, width_levels = local_range * (white - black);
    const auto fixed = [](double v) {
      return static_cast<std::int16_t>(std::clamp(std::lround(v), -32767l, 32767l));
    };
    return silhouette::Ramp{fixed(from * signal.unit),
                            fixed(255.0 * 32768.0 / (width_levels * signal.unit))};
  };
  ramp = ramp_for(screen_level);

  const bool plate_given = settings.plate != nullptr || !learned_plate.empty();
  if (!plate_given && !settings.uneven) return;
  local = true;
  const std::size_t length = row_length();
  base.assign(length * static_cast<std::size_t>(height), ramp.base);
  gain.assign(length * static_cast<std::size_t>(height), ramp.gain);
  const auto put = [&](int x, int y, double screen) {
    const silhouette::Ramp r = ramp_for(screen);
    base[length * static_cast<std::size_t>(y) + x] = r.base;
    gain[length * static_cast<std::size_t>(y) + x] = r.gain;
  };

  if (plate_given) {
    lay_out_plate();
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::uint8_t* p = plate.data() + 4 * (length * static_cast<std::size_t>(y) + x);
        const double d = signal.of(p[0], p[1], p[2]);
        // Where the plate shows no screen, only what is clearly no screen either can be told apart.
        put(x, y, std::max(d, foreground_level + 0.3 * (screen_level - foreground_level)));
      }
    return;
  }

  // The screen's signal on a coarse grid, gaps filled from their neighbours.
  constexpr int tile = 32;
  const int across = (width + tile - 1) / tile, down = (height + tile - 1) / tile;
  constexpr double nothing = -1e9;
  std::vector<double> grid(static_cast<std::size_t>(across) * down, nothing);
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(width));
  std::vector<std::vector<double>> found_in(across);
  for (int j = 0; j < down; ++j) {
    for (auto& v : found_in) v.clear();
    for (int y = j * tile; y < std::min((j + 1) * tile, height); y += 2) {
      convert_row(frame, y, 0, width, row.data());
      for (int x = 0; x < width; x += 2) {
        const double d = signal.of(row[4 * x], row[4 * x + 1], row[4 * x + 2]);
        if (d > 0.5 * (screen_level + foreground_level)) found_in[x / tile].push_back(d);
      }
    }
    for (int i = 0; i < across; ++i)
      if (found_in[i].size() >= tile * tile / 16)
        grid[static_cast<std::size_t>(j) * across + i] = quantile(found_in[i], 0.5);
  }
  const std::vector<double> seen = grid;
  for (double& g : grid)
    if (g == nothing) g = screen_level;
  for (int pass = 0; pass < 64; ++pass)
    for (int j = 0; j < down; ++j)
      for (int i = 0; i < across; ++i) {
        const std::size_t at = static_cast<std::size_t>(j) * across + i;
        if (seen[at] != nothing) continue;
        double sum = 0.0;
        sum += grid[i > 0 ? at - 1 : at] + grid[i + 1 < across ? at + 1 : at];
        sum += grid[j > 0 ? at - across : at] + grid[j + 1 < down ? at + across : at];
        grid[at] = sum / 4.0;
      }
  const auto at_grid = [&](int i, int j) {
    return grid[static_cast<std::size_t>(std::clamp(j, 0, down - 1)) * across +
                std::clamp(i, 0, across - 1)];
  };
  for (int y = 0; y < height; ++y) {
    const double v = (y + 0.5) / tile - 0.5;
    const int j = static_cast<int>(std::floor(v));
    for (int x = 0; x < width; ++x) {
      const double u = (x + 0.5) / tile - 0.5;
      const int i = static_cast<int>(std::floor(u));
      const double fu = u - i, fv = v - j;
      put(x, y,
          (at_grid(i, j) * (1 - fu) + at_grid(i + 1, j) * fu) * (1 - fv) +
              (at_grid(i, j + 1) * (1 - fu) + at_grid(i + 1, j + 1) * fu) * fv);
    }
  }
}

}  // namespace polyhull
