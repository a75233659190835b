// SPDX-License-Identifier: LGPL-2.1-or-later
// What the keyer shows: despilled picture with matte, or one of the operator's views.
#include <algorithm>
#include <cmath>

#include "silhouette/key_state.h"

namespace polyhull {
namespace {

struct Despill {
  int a[3], b[3];
  int take[3];  // 2^16 per signal unit
  int limit = 0;

  Despill(const silhouette::KeySignal& signal, double amount) {
    for (int c = 0; c < 3; ++c) {
      a[c] = signal.a[c];
      b[c] = signal.b[c];
      take[c] = static_cast<int>(std::lround(amount * signal.direction[c] / signal.unit * 65536.0));
    }
  }
  void apply(std::uint8_t* p) const {
    const int d =
        std::min(a[0] * p[0] + a[1] * p[1] + a[2] * p[2], b[0] * p[0] + b[1] * p[1] + b[2] * p[2]);
    if (d <= 0) return;
    for (int c = 0; c < 3; ++c)
      p[c] = static_cast<std::uint8_t>(std::clamp(p[c] - ((d * take[c] + 32768) >> 16), 0, 255));
  }
};

}  // namespace

void Keyer::write_rgba(const FrameView& frame, const Matte& matte, const Rectangle& region,
                       KeyView view, std::uint8_t* rgba, std::ptrdiff_t stride) const {
  const State& s = *state_;
  const bool despills = s.settings.spill > 0.0 && s.method != KeyMethod::difference;
  // Gains belong to the decision, not to the colour.
  const Despill despill(silhouette::key_signal(s.settings.key, s.hue, 1.0, 1.0), s.settings.spill);
  for (int j = 0; j < region.height; ++j) {
    const int y = region.y + j;
    std::uint8_t* out = rgba + stride * j;
    const std::uint8_t* alpha = matte.row(y) + region.x;
    if (view == KeyView::composite || view == KeyView::spill)
      convert_row(frame, y, region.x, region.x + region.width, out);
    switch (view) {
      case KeyView::composite:
        for (int x = 0; x < region.width; ++x) {
          if (despills) despill.apply(out + 4 * x);
          out[4 * x + 3] = alpha[x];
        }
        break;
      case KeyView::spill:
        for (int x = 0; x < region.width; ++x) {
          std::uint8_t* p = out + 4 * x;
          const std::uint8_t before[3] = {p[0], p[1], p[2]};
          if (despills) despill.apply(p);
          for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>(std::abs(before[c] - p[c]));
        }
        break;
      case KeyView::matte:
        for (int x = 0; x < region.width; ++x) {
          out[4 * x] = out[4 * x + 1] = out[4 * x + 2] = alpha[x];
          out[4 * x + 3] = 255;
        }
        break;
      case KeyView::status:
        for (int x = 0; x < region.width; ++x) {
          std::uint8_t* p = out + 4 * x;
          const std::uint8_t v = alpha[x];
          // Black, white, and between them blue (nearly background) to red (nearly foreground).
          const bool between = v != 0 && v != 255;
          p[0] = v;
          p[1] = between ? 64 : v;
          p[2] = between ? static_cast<std::uint8_t>(255 - v) : v;
          p[3] = 255;
        }
        break;
    }
  }
}

}  // namespace polyhull
