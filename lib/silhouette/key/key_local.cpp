// SPDX-License-Identifier: LGPL-2.1-or-later
// Keying by local colours: a span of tiles each has its own forms and ramp.
#include <algorithm>
#include <cmath>

#include "base/srgb.h"
#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

using silhouette::most_clipped;
using silhouette::most_spread;

constexpr double hair_lacks = 0.14;         // of solid parts: as much as fur of one colour
constexpr double most_nearly_solid = 0.15;  // of the subject; pictures with less have up to 0.01
constexpr double most_shift =
    0.1;  // of the range from screen to subject: more makes outlines too large

// By how much less than the subject's mean colour counts as solid, in alpha. \p usual: what a tenth
// of it lacks. Outlines grow with it, so it is little until a few of its \p parts, whose order
// changes, lack so much that they would be seen through; sooner before a \p strong colour, 0..1, to
// which nothing is alike.
double solid_end(double usual, double strong, std::vector<double>& parts) {
  const double beyond = std::clamp(usual - most_spread, 0.0, most_shift);
  constexpr double few = 1.0;
  const double least = 0.25 - 0.1 * strong;
  // As nearly everywhere.
  if (std::none_of(parts.begin(), parts.end(), [&](double part) { return part > least; }))
    return beyond;
  const double most = silhouette::quantile(
      parts, std::clamp(1.0 - few / static_cast<double>(parts.size()), 0.5, 0.95));
  const double share = std::clamp((most - least) / (0.15 - 0.05 * strong), 0.0, 1.0);
  return beyond + share * std::max(most - beyond, 0.0);
}

// Exact at alpha 0.2 and 0.5. levels(alpha): what the ramp finds of pixels that mix light with this alpha.
template <class Levels>
silhouette::Bend bend_for(const Levels& levels) {
  constexpr float low = 0.2f, half = 0.5f;
  const double a = std::clamp(levels(low), 0.02, 0.98), b = std::clamp(levels(half), 0.02, 0.98);
  const double at_a = (low - a) / (a * (1.0 - a)), at_b = (half - b) / (b * (1.0 - b));
  const double slope = std::abs(b - a) > 0.05 ? (at_b - at_a) / (b - a) : 0.0;
  const auto fixed = [](double v) {
    return static_cast<std::int32_t>(std::lround(std::clamp(v, -6.0, 6.0) * 4096.0));
  };
  return {fixed(at_b - slope * b), fixed(slope)};
}

}  // namespace

Keyer::State::RowKey Keyer::State::forms_for(const FrameView& frame,
                                             const silhouette::KeySignal& of) const {
  RowKey key;
  key.forms = silhouette::pixel_forms(of, path == Path::pixels ? format : FrameFormat::rgba);
  if (path == Path::chroma) key.chroma = silhouette::chroma_forms(of, frame);
  return key;
}

// How much screen and subject vary within their tiles, which no mixture explains, and the subject's
// colour where the frame that was sampled showed none: once for each, until sampled anew.
void Keyer::State::learn_from_colours(const FrameView& frame, bool first_screen) {
  if (first_screen && colours.has_screen())
    // Interpolated chroma's noise is more than what neighbours differ by, and silenced as that.
    unquiet = std::max(noise, colours.screen_spread() / plain.unit - noise);
  const std::optional<Vec3f> mean = subject_seen ? std::nullopt : colours.mean_subject();
  if (mean) {
    subject_seen = true;
    if (!settings.foreground && samples.foreground == Rgb{}) {
      for (int c = 0; c < 3; ++c)
        samples.foreground[static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>(std::lround((*mean)[c]));
      samples.foreground_signal = plain.of(*mean);
    }
    const double range = std::max(samples.screen_signal - samples.foreground_signal, 8.0);
    const double inside = colours.subject_spread() / plain.unit;
    // 1.28 deviations: a tenth lies beyond.
    const double lacks =
        1.28 * std::sqrt(std::max(inside * inside - unquiet * unquiet, 0.0)) / range;
    clip_of_subject = std::clamp(2.0 * (lacks - hair_lacks), 0.0, most_clipped);
    spread_inside = std::clamp(lacks, spread_inside, most_spread);
  }
  if (!first_screen && !mean) return;
  calibrate();
  whole = forms_for(frame, signal);
  lay_out_screen();
}

void Keyer::State::sample_rows(const FrameView& frame) {
  const int x0 = active.x / 2 * 2, x1 = active.x + active.width;
  colours.begin_frame(x0, x1, static_cast<int>(samples.screen_signal * plain.unit),
                      noise * plain.unit);
  const RowKey plain_key = forms_for(frame, plain);
  for (int y = active.y; y < active.y + active.height; ++y)
    if (colours.is_sampled(y)) colours.add_row(y, signal_row(frame, y, x0, x1, plain_key));
  static thread_local std::vector<std::uint8_t> pixels;
  pixels.resize(4 * row_length());
  // One reference fits into a function without memory of its own.
  colours.finish_frame([&frame](int y, int a, int b) {
    convert_row(frame, y, a, b, pixels.data());
    return pixels.data();
  });
}

void Keyer::State::sample_colours(const FrameView& frame) {
  if (!colours.begun()) {
    colours.begin(width, height);
    spans.reserve(static_cast<std::size_t>(colours.across()) *
                  static_cast<std::size_t>(colours.down()));
  }
  if (settings.screen && settings.foreground) {
    colours.assume_screen(silhouette::vector_of(samples.screen));
    colours.assume_subject(silhouette::vector_of(samples.foreground));
    return;
  }
  const bool first = !colours.has_screen();
  sample_rows(frame);
  // A face before a yellow screen: all of it looks like a mixture.
  if (!subject_seen && colours.nearly_solid() > most_nearly_solid) {
    colours.begin(width, height);
    colours.take_nearly_solid();
    sample_rows(frame);
  }
  if (!colours.has_screen()) colours.assume_screen(silhouette::vector_of(samples.screen));
  if (settings.foreground) colours.assume_subject(silhouette::vector_of(samples.foreground));
  learn_from_colours(frame, first);
  if (mixing.is_sure()) return;
  // Chroma of half the width is off the edge that luma shows.
  const double blurred = halved_across(frame) ? 3.0 : 0.0;
  for (const auto& pixel : colours.mixed())
    if (const auto& tile = colours.tile(pixel.tile); tile.has_subject)
      mixing.add(tile.screen, tile.subject, pixel.colour, noise + blurred);
  mixing.finish_frame();
}

// Where edges mix light: the bend of the whole picture's colours, for tiles without their own.
void Keyer::State::bend_whole() {
  whole.bend = {};
  const double range = screen_level - foreground_level;
  if (!mixing.in_light() || !subject_seen || range <= 0.0) return;
  const Vec3f screen = silhouette::vector_of(samples.screen);
  const Vec3f subject = silhouette::vector_of(samples.foreground);
  whole.bend = bend_for([&](float alpha) {
    return (screen_level - signal.of(silhouette::mixed_in_light(screen, subject, alpha))) / range;
  });
}

Keyer::State::RowKey Keyer::State::key_of(const FrameView& frame, int column, int row) const {
  const silhouette::LocalColours::Tile& tile = colours.tile(column, row);
  if (!tile.has_subject || tile.plain) {
    // Tiles whose screens differ by less are one span.
    const double step = std::max((screen_level - foreground_level) / 32.0, 0.1);
    RowKey key = whole;
    key.ramp = silhouette::with_sure_signals(
        ramp_for(std::round(signal.of(tile.screen) / step) * step, foreground_level, signal.unit,
                 tile.spread / plain.unit));
    return key;
  }
  const silhouette::KeySignal own = silhouette::calibrated(plain, tile.screen, tile.subject, noise);
  RowKey key = forms_for(frame, own);
  const double from = own.of(tile.screen), to = own.of(tile.subject), range = from - to;
  double to_solid = 0.0;
  if (range > 0.0 && !settings.foreground) {
    static thread_local std::vector<Vec3f> solids;
    static thread_local std::vector<double> parts;
    solids.clear(), parts.clear();
    colours.solid_colours(column, row, solids);
    for (const Vec3f& colour : solids) parts.push_back((own.of(colour) - to) / range);
    const double strong =
        std::clamp(-2.0 * plain.of(tile.subject) / std::max(plain.of(tile.screen), 1.0), 0.0, 1.0);
    to_solid = solid_end(1.28 * tile.subject_spread / plain.unit / range, strong, parts) * range;
  }
  key.ramp = silhouette::with_sure_signals(
      ramp_for(from, to + to_solid, own.unit, tile.spread / plain.unit));
  if (mixing.in_light() && range > 0.0)
    key.bend = bend_for([&](float alpha) {
      return (from - own.of(silhouette::mixed_in_light(tile.screen, tile.subject, alpha))) / range;
    });
  return key;
}

void Keyer::State::follow_colours(const FrameView& frame) {
  spans.clear();
  first_spans.clear();
  if (method != KeyMethod::soft || local || !samples.valid || active.empty()) return;
  sample_colours(frame);
  bend_whole();
  for (int row = 0; row < colours.down(); ++row) {
    first_spans.push_back(spans.size());
    for (int column = 0; column < colours.across(); ++column) {
      const int begin = column * colours.size(), end = begin + colours.size();
      const RowKey key = key_of(frame, column, row);
      if (column > 0 && spans.back().key == key)
        spans.back().end = end;
      else
        spans.push_back({begin, end, key});
    }
    for (std::size_t beyond = spans.size(), i = beyond; i-- > first_spans.back();) {
      if (i + 1 < spans.size() && !(spans[i].key.chroma == spans[i + 1].key.chroma)) beyond = i + 1;
      spans[i].beyond = beyond;
    }
  }
  first_spans.push_back(spans.size());
  if (!straightens()) return;
  const bool in_light = mixing.in_light();
  const auto mixed = [&](const Vec3f& c) {
    return in_light ? 255.0f * srgb_decoded(c / 255.0f) : c;
  };
  mixtures.clear();
  for (int row = 0; row < colours.down(); ++row)
    for (int column = 0; column < colours.across(); ++column) {
      const auto& tile = colours.tile(column, row);
      mixtures.push_back({mixed(tile.screen), mixed(tile.subject)});
    }
}

}  // namespace polyhull
