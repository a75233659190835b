// SPDX-License-Identifier: LGPL-2.1-or-later
// What the keyer shows: despilled picture with matte, or one of the operator's views.
#include <algorithm>
#include <cmath>
#include <vector>

#include "silhouette/key/key_state.h"
#include "silhouette/pixels/colour_kernels.h"

namespace polyhull {
namespace {

// Of the screen's signal: what a solid subject may have of it and lose it as spill. More is its own
// colour, as a face's before a yellow screen.
constexpr double spill_inside = 0.1;

/// \p inside: signal in levels up to which it is spill everywhere.
silhouette::DespillForms despill_forms(const silhouette::KeySignal& signal, double amount,
                                       double inside) {
  silhouette::DespillForms forms;
  forms.everywhere =
      static_cast<std::int16_t>(std::clamp(std::lround(inside * signal.unit), 0l, 32767l));
  for (int c = 0; c < 3; ++c) {
    forms.a[c] = static_cast<std::int16_t>(signal.a[c]);
    forms.b[c] = static_cast<std::int16_t>(signal.b[c]);
    forms.take[c] = static_cast<std::int16_t>(
        std::lround(amount * signal.direction[c] / signal.unit * 32768.0));
  }
  return forms;
}

struct OutputMemory {
  std::vector<std::int16_t> weights;
  std::vector<std::uint8_t> before;
};

/// RGBA of one row's stretch, despilled, with \p alpha.
void composite_row(const FrameView& frame, int y, int x0, int x1,
                   const silhouette::DespillForms& despill, const std::int16_t* weights,
                   const std::uint8_t* alpha, std::uint8_t* out) {
  const auto& kernels = silhouette::ColourKernels::best();
  if (is_yuv(frame)) return kernels.composite_yuv(frame, y, x0, x1, despill, weights, alpha, out);
  const bool swap = frame.format == FrameFormat::bgrx || frame.format == FrameFormat::bgra;
  if (swap || frame.format == FrameFormat::rgbx || frame.format == FrameFormat::rgba) {
    kernels.composite(frame.row(0, y) + 4 * static_cast<std::ptrdiff_t>(x0), x1 - x0, swap, despill,
                      weights, alpha, out);
    return;
  }
  convert_row(frame, y, x0, x1, out);
  kernels.composite(out, x1 - x0, false, despill, weights, alpha, out);
}

/// Whether \p pixel has the colour of \p plate, where that is a colour: a person is seldom as green as
/// a green floor, but often as white as a wall, and what closing brings back of him is to stay.
bool shows_coloured(const std::uint8_t* pixel, const std::uint8_t* plate) {
  constexpr int coloured = 24;  // levels
  // Three times the differences from the mean.
  int from_plate[3], along = 0, square = 0;
  const int mean = plate[0] + plate[1] + plate[2], own = pixel[0] + pixel[1] + pixel[2];
  for (int c = 0; c < 3; ++c) {
    from_plate[c] = 3 * plate[c] - mean;
    along += from_plate[c] * (3 * pixel[c] - own);
    square += from_plate[c] * from_plate[c];
  }
  return square > 9 * coloured * coloured && 2 * along > square;
}

/// The colours around a pixel of a gap, the nearer the more.
void take_around(const silhouette::ClosedGaps& gaps, const FrameView& frame, int x, int y,
                 const silhouette::DespillForms& despill, std::uint8_t* pixel) {
  float sum[3] = {}, weight = 0.0f;
  for (const auto& other : gaps.around(x, y)) {
    if (other.distance == 0) continue;
    std::uint8_t colour[4];
    constexpr std::int16_t none = 0;
    constexpr std::uint8_t whole = 255;
    composite_row(frame, other.y, other.x, other.x + 1, despill, &none, &whole, colour);
    const float share = 1.0f / static_cast<float>(other.distance);
    for (int c = 0; c < 3; ++c) sum[c] += share * static_cast<float>(colour[c]);
    weight += share;
  }
  for (int c = 0; c < 3 && weight > 0.0f; ++c)
    pixel[c] = static_cast<std::uint8_t>(sum[c] / weight + 0.5f);
}

void write_matte(const std::uint8_t* alpha, int width, std::uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    out[4 * x] = out[4 * x + 1] = out[4 * x + 2] = alpha[x];
    out[4 * x + 3] = 255;
  }
}

/// Black, white, and between them blue (nearly background) to red (nearly foreground).
void write_status(const std::uint8_t* alpha, int width, std::uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    std::uint8_t* p = out + 4 * x;
    const std::uint8_t v = alpha[x];
    const bool between = v != 0 && v != 255;
    p[0] = v;
    p[1] = between ? 64 : v;
    p[2] = between ? static_cast<std::uint8_t>(255 - v) : v;
    p[3] = 255;
  }
}

}  // namespace

silhouette::DespillForms Keyer::State::despill() const {
  if (!despills()) return {};
  // Gains belong to the decision, not to the colour.
  const silhouette::KeySignal signal = silhouette::key_signal(settings.key, hue, 1.0, 1.0);
  const Rgb& screen = samples.screen;
  const double inside =
      samples.valid ? spill_inside * signal.of(screen[0], screen[1], screen[2]) : 512.0;
  return despill_forms(signal, settings.spill, inside);
}

void Keyer::State::fill_gaps(const FrameView& frame, int y, const Rectangle& region,
                             const silhouette::DespillForms& despill, std::uint8_t* out) const {
  if (method != KeyMethod::difference || plate.empty() || !gaps.in_row(y)) return;
  const std::uint8_t* row = &plate[4 * row_length() * static_cast<std::size_t>(y)];
  for (int x = region.x; x < region.x + region.width; ++x) {
    std::uint8_t* pixel = out + 4 * static_cast<std::ptrdiff_t>(x - region.x);
    if (gaps.at(x, y) && shows_coloured(pixel, row + 4 * static_cast<std::ptrdiff_t>(x)))
      take_around(gaps, frame, x, y, despill, pixel);
  }
}

int Keyer::rows_below() const {
  return state_->despills() ? state_->edges.rows_below() : 0;
}

void Keyer::write_rgba(const FrameView& frame, const Matte& matte, const Rectangle& region,
                       KeyView view, std::uint8_t* rgba, std::ptrdiff_t stride) const {
  const State& s = *state_;
  if (view == KeyView::split) return write_split(frame, matte, rgba, stride);
  auto& [weights, before] = silhouette::kept_by_thread<OutputMemory>();
  weights.resize(static_cast<std::size_t>(frame.width));
  const silhouette::DespillForms despill = s.despill();
  for (int j = 0; j < region.height; ++j) {
    const int y = region.y + j, end = region.x + region.width;
    std::uint8_t* out = rgba + stride * j;
    const std::uint8_t* alpha = matte.row(y) + region.x;
    const auto composite = [&] {
      if (s.despills()) s.edges.weigh_row(y, region.x, end, weights.data());
      if (!s.straightens())
        return composite_row(frame, y, region.x, end, despill, weights.data(), alpha, out);
      convert_row(frame, y, region.x, end, out);
      s.unmix_row(y, region.x, end, out);
      silhouette::ColourKernels::best().composite(out, region.width, false, despill, weights.data(),
                                                  alpha, out);
    };
    switch (view) {
      case KeyView::composite:
        composite();
        s.fill_gaps(frame, y, region, despill, out);
        break;
      case KeyView::spill:
        before.resize(static_cast<std::size_t>(region.width) * 4);
        convert_row(frame, y, region.x, end, before.data());
        s.unmix_row(y, region.x, end, before.data());
        composite();
        for (int x = 0; x < region.width; ++x) {
          std::uint8_t* p = out + 4 * x;
          for (int c = 0; c < 3; ++c)
            p[c] = static_cast<std::uint8_t>(std::abs(before[4 * x + c] - p[c]));
          p[3] = 255;
        }
        break;
      case KeyView::matte:
        write_matte(alpha, region.width, out);
        break;
      case KeyView::status:
        write_status(alpha, region.width, out);
        break;
      case KeyView::split:
        break;  // above
    }
  }
}

}  // namespace polyhull
