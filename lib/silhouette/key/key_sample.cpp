// SPDX-License-Identifier: LGPL-2.1-or-later
// Sampling the picture for screen and foreground, and the ramps from signal to alpha.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

using std::numbers::pi;

constexpr double least_range =
    8.0;  // levels between screen and foreground; keeps the gain in 16 bit

constexpr double most_spread = 0.1;  // alpha that the subject's least solid parts may lack

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
  out.step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / 100000.0))));
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

// The most frequent saturated colour whose hue is within `nearness` of the wanted colour's (in
// radians); nothing when less than 2 % of the picture has such a hue.
std::optional<Rgb> dominant_hue(const Samples& samples, const Rgb& wanted, double nearness) {
  // Directions from grey in steps of 5 degrees, counted where the saturation is clear.
  constexpr int bins = 72;
  std::array<double, bins> count{};
  const auto angle_of = [](const Rgb& c) {
    return std::atan2((c[1] - c[2]) / std::sqrt(2.0), (2.0 * c[0] - c[1] - c[2]) / std::sqrt(6.0));
  };
  const auto bin_of = [&](const Rgb& c) {
    return static_cast<int>((angle_of(c) + pi) / (2.0 * pi) * bins) % bins;
  };
  const double middle = angle_of(wanted);
  const auto counts = [&](const Rgb& c) {
    return silhouette::saturation_of(c) >= 32 &&
           std::abs(std::remainder(angle_of(c) - middle, 2.0 * pi)) <= nearness;
  };
  for (const Rgb& c : samples.colours)
    if (counts(c)) count[bin_of(c)] += 1.0;
  int best = 0;
  double best_count = -1.0;
  for (int i = 0; i < bins; ++i) {
    const double near_count = count[(i + bins - 1) % bins] + 2.0 * count[i] + count[(i + 1) % bins];
    if (near_count > best_count) best = i, best_count = near_count;
  }
  if (best_count < 0.02 * static_cast<double>(samples.colours.size())) return std::nullopt;
  double sum[3] = {}, n = 0.0;
  for (const Rgb& c : samples.colours) {
    const int distance = std::abs(bin_of(c) - best);
    if (!counts(c) || std::min(distance, bins - distance) > 1) continue;
    for (int i = 0; i < 3; ++i) sum[i] += c[i];
    n += 1.0;
  }
  return Rgb{level(sum[0] / n), level(sum[1] / n), level(sum[2] / n)};
}

// The q-quantile of at least one number.
double quantile(std::vector<double>& v, double q) {
  assert(!v.empty());
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(v.size() - 1));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

// How much a screen's signal spreads, in levels.
struct Spread {
  double noise, unevenness;
};

// Of the signals near \p screen; \p cluster is a copy of those, in any order.
Spread spread_of(const std::vector<double>& signals, std::vector<double>& cluster, double screen) {
  // From the quartiles: the tails are shadows and edges. What neighbours differ by is noise, the
  // rest is light and folds.
  const double spread = (quantile(cluster, 0.75) - quantile(cluster, 0.25)) / 1.349;
  std::vector<double> steps;
  for (std::size_t i = 1; i < signals.size(); ++i)
    if (std::abs(signals[i] - screen) < 0.3 * screen &&
        std::abs(signals[i - 1] - screen) < 0.3 * screen)
      steps.push_back(std::abs(signals[i] - signals[i - 1]));
  // The median of |difference| of two normal numbers is 0.954 of their deviation.
  const double noise = steps.empty() ? spread : std::min(quantile(steps, 0.5) / 0.954, spread);
  return {noise, std::sqrt(spread * spread - noise * noise)};
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
  key = settings.key;
  const bool both_given = settings.screen && settings.foreground;
  if (method == KeyMethod::difference ||
      (method == KeyMethod::threshold && settings.key != KeyColour::automatic)) {
    found = true;
    return;
  }
  samples = KeyCalibration{};
  noise = unevenness = spread_inside = 0.0;
  Samples taken;
  if (!both_given || settings.key == KeyColour::automatic) taken = take_samples(frame, active);
  // The signal is turned to the screen's own hue: real green cloth is not (0, 1, 0). Green and blue
  // say where to look for it.
  if (settings.key != KeyColour::custom) {
    const bool any = settings.key == KeyColour::automatic;
    const Rgb wanted = settings.key == KeyColour::blue ? Rgb{0, 0, 255} : Rgb{0, 255, 0};
    std::optional<Rgb> screen_hue;
    if (settings.screen && silhouette::saturation_of(*settings.screen) >= 16)
      screen_hue = settings.screen;
    else
      screen_hue = dominant_hue(taken, wanted, any ? 4.0 : pi / 4.0);
    hue = screen_hue.value_or(wanted);
    if (screen_hue || any) key = KeyColour::custom;
  }
  const silhouette::KeySignal s =
      silhouette::key_signal(key, hue, settings.red_gain, settings.blue_gain);
  std::vector<double> signals;
  for (const Rgb& c : taken.colours) signals.push_back(s.of(c[0], c[1], c[2]));

  double screen = 0.0;
  bool screen_seen = false;
  std::vector<double> cluster;
  const auto near_screen = [&] {
    cluster.clear();
    for (const double d : signals)
      if (d > 0.7 * screen && d < 1.3 * screen + 8.0) cluster.push_back(d);
    return static_cast<double>(cluster.size()) >= 0.02 * static_cast<double>(signals.size());
  };
  if (settings.screen) {
    samples.screen = *settings.screen;
    screen = s.of(samples.screen[0], samples.screen[1], samples.screen[2]);
    screen_seen = true;
    if (!signals.empty() && screen >= 16.0 && near_screen()) {
      const Spread spread = spread_of(signals, cluster, screen);
      noise = spread.noise;
      unevenness = spread.unevenness;
    }
  } else if (!signals.empty()) {
    // The peak of the signals clearly on the key's side of grey.
    std::array<double, 256> histogram{};
    for (const double d : signals)
      if (d >= 0.0) histogram[static_cast<std::size_t>(std::min(d, 255.0))] += 1.0;
    double best = 0.0;
    for (int i = 16; i < 256; ++i) {
      double sum = 0.0;
      for (int k = std::max(i - 6, 0); k <= std::min(i + 6, 255); ++k) sum += histogram[k];
      if (sum > best) best = sum, screen = i;
    }
    // A tint of so little colour that its peak is not even near its own bin is no screen.
    if (best >= 0.02 * static_cast<double>(signals.size()) && near_screen()) {
      screen = quantile(cluster, 0.5);
      const Spread spread = spread_of(signals, cluster, screen);
      noise = spread.noise;
      unevenness = spread.unevenness;
      const double within = std::hypot(noise, unevenness) + 1.0;
      samples.screen = mean_colour(taken, signals, screen - within, screen + within);
      screen_seen = true;
    }
  }
  if (!screen_seen) screen = 96.0;  // a usual screen, until one is seen

  double foreground = 0.0;
  if (settings.foreground) {
    samples.foreground = *settings.foreground;
    foreground = s.of(samples.foreground[0], samples.foreground[1], samples.foreground[2]);
  } else {
    // Samples well inside the subject: all around them is foreground too, so that no mixed pixel
    // and no interpolated chroma counts.
    std::vector<double> near_edge;
    cluster.clear();
    const int apart = (4 + taken.step - 1) / taken.step;
    const auto is_foreground = [&](int i, int j) {
      return i < 0 || j < 0 || i >= taken.columns || j >= taken.rows ||
             signals[static_cast<std::size_t>(j) * taken.columns + i] < 0.25 * screen;
    };
    for (int j = 0; j < taken.rows; ++j)
      for (int i = 0; i < taken.columns; ++i) {
        if (!is_foreground(i, j)) continue;
        const double d = signals[static_cast<std::size_t>(j) * taken.columns + i];
        near_edge.push_back(d);
        if (is_foreground(i - apart, j) && is_foreground(i + apart, j) &&
            is_foreground(i, j - apart) && is_foreground(i, j + apart))
          cluster.push_back(d);
      }
    if (cluster.size() < near_edge.size() / 8) cluster = near_edge;
    if (cluster.size() > signals.size() / 500 + 8) {
      // The subject's least solid parts: high in the cluster, less the noise that this quantile
      // picks up.
      const double least = quantile(cluster, 0.9) - 1.28 * std::min(noise, 8.0);
      // What prevails along the edge is nearer to the middle of the cluster, and a foreground that
      // is not the edge's moves the contour. What those parts then lack is made up for where whole
      // blocks are silenced.
      foreground = std::max(least - most_spread * (screen - least), quantile(cluster, 0.5));
      spread_inside =
          std::clamp((least - foreground) / std::max(screen - foreground, 1.0), 0.0, most_spread);
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
  // What the screen's signal spreads beyond a camera's noise is clipped, unless it is followed.
  const bool followed = settings.uneven || settings.plate || !learned_plate.empty();
  const double clip = followed ? 0.0 : std::min(3.0 * unevenness / range, 0.25);
  const double black = std::max(settings.clip_black, clip);
  const double white = std::max(std::min(settings.clip_white, 1.0 - clip), black + 0.01);
  // Blocks of nothing but noise are silenced; edges keep their ramp, for clipping one side of a
  // mixed pixel's neighbours shifts the boundary.
  const double silence = std::clamp(2.5 * noise / (range * (white - black)), 0.03, 0.2);
  const auto low = static_cast<std::uint8_t>(std::lround(255.0 * silence));
  const auto high = static_cast<std::uint8_t>(std::lround(255.0 * (1.0 - silence - spread_inside)));
  const auto ramp_for = [&](double screen) {
    const double local_range = std::max(screen - foreground_level, least_range);
    const double from = screen - black * local_range, width_levels = local_range * (white - black);
    const auto fixed = [](double v) {
      return static_cast<std::int16_t>(std::clamp(std::lround(v), -32767l, 32767l));
    };
    return silhouette::Ramp{fixed(from * signal.unit),
                            fixed(255.0 * 32768.0 / (width_levels * signal.unit)), low, high};
  };
  ramp = ramp_for(screen_level);
  quiet = silhouette::quiet_for(low, high);

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
        if (d > foreground_level + 0.4 * (screen_level - foreground_level))
          found_in[x / tile].push_back(d);
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
  // Beyond the outermost tiles' centres the slope goes on.
  const auto row_at = [&](int i, int j) {
    const double* line = grid.data() + static_cast<std::size_t>(j) * across;
    if (across < 2) return line[0];
    if (i < 0) return 2.0 * line[0] - line[1];
    if (i >= across) return 2.0 * line[across - 1] - line[across - 2];
    return line[i];
  };
  const auto at_grid = [&](int i, int j) {
    if (down < 2) return row_at(i, 0);
    if (j < 0) return 2.0 * row_at(i, 0) - row_at(i, 1);
    if (j >= down) return 2.0 * row_at(i, down - 1) - row_at(i, down - 2);
    return row_at(i, j);
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
