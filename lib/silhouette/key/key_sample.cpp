// SPDX-License-Identifier: LGPL-2.1-or-later
// Sampling the picture for screen and foreground.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

using std::numbers::pi;

using silhouette::most_spread;

std::uint8_t level(double v) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(v), 0l, 255l));
}

// Pixels of the active region on a grid of about a hundred thousand.
struct Samples {
  int step = 1;
  int columns = 0, rows = 0;
  std::vector<Rgb> colours;
  std::vector<double> signals;  // of the colours
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

// How much a screen's signal spreads, in levels.
struct Spread {
  double noise, unevenness;
};

// Of the signals near \p screen; \p cluster is a copy of those, in any order.
Spread spread_of(const std::vector<double>& signals, std::vector<double>& cluster, double screen) {
  // From the quartiles: the tails are shadows and edges. What neighbours differ by is noise, the
  // rest is light and folds.
  const double spread =
      (silhouette::quantile(cluster, 0.75) - silhouette::quantile(cluster, 0.25)) / 1.349;
  std::vector<double> steps;
  for (std::size_t i = 1; i < signals.size(); ++i)
    if (std::abs(signals[i] - screen) < 0.3 * screen &&
        std::abs(signals[i - 1] - screen) < 0.3 * screen)
      steps.push_back(std::abs(signals[i] - signals[i - 1]));
  // The median of |difference| of two normal numbers is 0.954 of their deviation.
  const double noise =
      steps.empty() ? spread : std::min(silhouette::quantile(steps, 0.5) / 0.954, spread);
  return {noise, std::sqrt(spread * spread - noise * noise)};
}

// The mean colour of the samples whose signal is within [low, high].
Rgb mean_colour(const Samples& samples, double low, double high) {
  double sum[3] = {}, n = 0.0;
  for (std::size_t i = 0; i < samples.signals.size(); ++i) {
    if (samples.signals[i] < low || samples.signals[i] > high) continue;
    for (int c = 0; c < 3; ++c) sum[c] += samples.colours[i][c];
    n += 1.0;
  }
  if (n == 0.0) return {};
  return {level(sum[0] / n), level(sum[1] / n), level(sum[2] / n)};
}

// What a picture shows of the screen.
struct Screen {
  double signal;
  Rgb colour;
  Spread spread{0.0, 0.0};
};

// The signals near that of a screen; none where they are too few to be one.
std::vector<double> signals_near(const Samples& taken, double screen) {
  std::vector<double> cluster;
  for (const double d : taken.signals)
    if (d > 0.7 * screen && d < 1.3 * screen + 8.0) cluster.push_back(d);
  if (static_cast<double>(cluster.size()) < 0.02 * static_cast<double>(taken.signals.size()))
    cluster.clear();
  return cluster;
}

// The screen whose colour is known.
Screen given_screen(const Samples& taken, double signal, const Rgb& colour) {
  if (signal < 16.0) return {signal, colour};
  std::vector<double> cluster = signals_near(taken, signal);
  if (cluster.empty()) return {signal, colour};
  return {signal, colour, spread_of(taken.signals, cluster, signal)};
}

// The screen at the peak of the signals clearly on the key's side of grey.
std::optional<Screen> find_screen(const Samples& taken) {
  std::array<double, 256> histogram{};
  for (const double d : taken.signals)
    if (d >= 0.0) histogram[static_cast<std::size_t>(std::min(d, 255.0))] += 1.0;
  double best = 0.0, peak = 0.0;
  for (int i = 16; i < 256; ++i) {
    double sum = 0.0;
    for (int k = std::max(i - 6, 0); k <= std::min(i + 6, 255); ++k) sum += histogram[k];
    if (sum > best) best = sum, peak = i;
  }
  if (best < 0.02 * static_cast<double>(taken.signals.size())) return std::nullopt;
  std::vector<double> cluster = signals_near(taken, peak);
  // A tint of so little colour that its peak is not even near its own bin is no screen.
  if (cluster.empty()) return std::nullopt;
  const double signal = silhouette::quantile(cluster, 0.5);
  const Spread spread = spread_of(taken.signals, cluster, signal);
  const double within = std::hypot(spread.noise, spread.unevenness) + 1.0;
  return Screen{signal, mean_colour(taken, signal - within, signal + within), spread};
}

// What a picture shows of the subject.
struct Foreground {
  double signal = 0.0;
  Rgb colour{};
  double spread_inside = 0.0;  // as Keyer::State's
};

Foreground find_foreground(const Samples& taken, double screen, double noise) {
  // Samples well inside the subject: all around them is foreground too, so that no mixed pixel
  // and no interpolated chroma counts.
  std::vector<double> near_edge, inside;
  const int apart = (4 + taken.step - 1) / taken.step;
  const auto is_foreground = [&](int i, int j) {
    return i < 0 || j < 0 || i >= taken.columns || j >= taken.rows ||
           taken.signals[static_cast<std::size_t>(j) * taken.columns + i] < 0.25 * screen;
  };
  for (int j = 0; j < taken.rows; ++j)
    for (int i = 0; i < taken.columns; ++i) {
      if (!is_foreground(i, j)) continue;
      const double d = taken.signals[static_cast<std::size_t>(j) * taken.columns + i];
      near_edge.push_back(d);
      if (is_foreground(i - apart, j) && is_foreground(i + apart, j) &&
          is_foreground(i, j - apart) && is_foreground(i, j + apart))
        inside.push_back(d);
    }
  if (inside.size() < near_edge.size() / 8) inside = near_edge;
  if (inside.size() <= taken.signals.size() / 500 + 8) return {};
  // The subject's least solid parts: high among them, less the noise that this quantile picks up.
  const double least = silhouette::quantile(inside, 0.9) - 1.28 * std::min(noise, 8.0);
  // What prevails along the edge is nearer to their middle, and a foreground that is not the edge's
  // moves the contour. What those parts then lack is made up for where whole blocks are silenced.
  const double signal =
      std::max(least - most_spread * (screen - least), silhouette::quantile(inside, 0.5));
  return {signal, mean_colour(taken, signal - 8.0, signal + 8.0),
          std::clamp((least - signal) / std::max(screen - signal, 1.0), 0.0, most_spread)};
}

}  // namespace

double silhouette::quantile(std::vector<double>& v, double q) {
  assert(!v.empty());
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(v.size() - 1));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

Keyer::State::Light Keyer::State::light_of(const FrameView& frame) const {
  constexpr int columns = 16, rows = 9;
  Light out;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int x = active.x + (2 * i + 1) * active.width / (2 * columns);
      const int y = active.y + (2 * j + 1) * active.height / (2 * rows);
      std::uint8_t p[4];
      convert_row(frame, y, x, x + 1, p);
      const double now = sampled_signal.of(p[0], p[1], p[2]);
      out.screen += now > 0.5 * samples.screen_signal;
      out.brighter += now > 1.25 * samples.screen_signal;
    }
  return out;
}

bool Keyer::State::light_came(const FrameView& frame) {
  constexpr int lasting = 5;  // frames; a flash is shorter
  if (!dark || active.empty()) return false;
  const bool brighter = 2 * (light_of(frame).brighter - light.brighter) > std::max(light.screen, 4);
  bright_frames = brighter ? bright_frames + 1 : 0;
  return bright_frames >= lasting;
}

void Keyer::State::sample(const FrameView& frame) {
  if (found) return;
  dark = false;
  bright_frames = 0;
  hue = settings.colour;
  key = settings.key;
  const bool both_given = settings.screen && settings.foreground;
  if (method == KeyMethod::difference ||
      (method == KeyMethod::threshold && settings.key != KeyColour::automatic)) {
    found = true;
    return;
  }
  samples = KeyCalibration{};
  colours = {};
  mixing = {};
  subject_seen = false;
  noise = unevenness = unquiet = spread_inside = clip_of_subject = 0.0;
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
  const auto signal_of = [&](const Rgb& c) { return s.of(c[0], c[1], c[2]); };
  for (const Rgb& c : taken.colours) taken.signals.push_back(signal_of(c));

  std::optional<Screen> screen;
  if (settings.screen)
    screen = given_screen(taken, signal_of(*settings.screen), *settings.screen);
  else if (!taken.signals.empty())
    screen = find_screen(taken);
  if (screen) {
    samples.screen = screen->colour;
    noise = unquiet = screen->spread.noise, unevenness = screen->spread.unevenness;
  }
  samples.screen_signal = screen ? screen->signal : 96.0;  // a usual screen, until one is seen

  if (settings.foreground) {
    samples.foreground = *settings.foreground;
    samples.foreground_signal = signal_of(*settings.foreground);
  } else {
    const Foreground foreground = find_foreground(taken, samples.screen_signal, noise);
    samples.foreground = foreground.colour;
    samples.foreground_signal = foreground.signal;
    spread_inside = foreground.spread_inside;
  }
  samples.valid = found = screen.has_value();
  constexpr int well_lit = 128;  // levels of the screen's brightest channel
  dark = screen && !settings.screen && std::ranges::max(screen->colour) < well_lit;
  if (dark && !active.empty()) {
    sampled_signal = s;
    light = light_of(frame);
  }
  // Without a screen in the picture the next one is sampled again.
}

}  // namespace polyhull
