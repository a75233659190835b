// SPDX-License-Identifier: LGPL-2.1-or-later
// The ramps from signal to alpha, one for all pixels or one for each.
#include <algorithm>
#include <cmath>

#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

constexpr double least_range =
    8.0;  // levels between screen and foreground; keeps the gain in 16 bit

// The screen's signal over the picture, on a coarse grid.
class ScreenMap {
 public:
  ScreenMap(int width, int height)
      : across_((width + tile - 1) / tile),
        down_((height + tile - 1) / tile),
        grid_(static_cast<std::size_t>(across_) * down_, nothing) {}

  // Takes what is above \p least of the picture for screen.
  void sample(const FrameView& frame, const silhouette::KeySignal& signal, double least) {
    std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(frame.width));
    std::vector<std::vector<double>> found_in(across_);
    for (int j = 0; j < down_; ++j) {
      for (auto& v : found_in) v.clear();
      for (int y = j * tile; y < std::min((j + 1) * tile, frame.height); y += 2) {
        convert_row(frame, y, 0, frame.width, row.data());
        for (int x = 0; x < frame.width; x += 2) {
          const double d = signal.of(row[4 * x], row[4 * x + 1], row[4 * x + 2]);
          if (d > least) found_in[x / tile].push_back(d);
        }
      }
      for (int i = 0; i < across_; ++i)
        if (found_in[i].size() >= tile * tile / 16)
          grid_[static_cast<std::size_t>(j) * across_ + i] = silhouette::quantile(found_in[i], 0.5);
    }
  }

  // Gives tiles without screen what their neighbours have, beginning with \p usual.
  void fill_gaps(double usual) {
    const std::vector<double> seen = grid_;
    std::replace(grid_.begin(), grid_.end(), nothing, usual);
    for (int pass = 0; pass < 64; ++pass)
      for (int j = 0; j < down_; ++j)
        for (int i = 0; i < across_; ++i) {
          const std::size_t at = static_cast<std::size_t>(j) * across_ + i;
          if (seen[at] != nothing) continue;
          double sum = 0.0;
          sum += grid_[i > 0 ? at - 1 : at] + grid_[i + 1 < across_ ? at + 1 : at];
          sum += grid_[j > 0 ? at - across_ : at] + grid_[j + 1 < down_ ? at + across_ : at];
          grid_[at] = sum / 4.0;
        }
  }

  // The signal at a pixel.
  double operator()(int x, int y) const {
    const double u = (x + 0.5) / tile - 0.5, v = (y + 0.5) / tile - 0.5;
    const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
    const double fu = u - i, fv = v - j;
    return (at(i, j) * (1 - fu) + at(i + 1, j) * fu) * (1 - fv) +
           (at(i, j + 1) * (1 - fu) + at(i + 1, j + 1) * fu) * fv;
  }

 private:
  static constexpr int tile = 32;  // px
  static constexpr double nothing = -1e9;

  // Beyond the outermost tiles' centres the slope goes on.
  double in_row(int i, int j) const {
    const double* line = grid_.data() + static_cast<std::size_t>(j) * across_;
    if (across_ < 2) return line[0];
    if (i < 0) return 2.0 * line[0] - line[1];
    if (i >= across_) return 2.0 * line[across_ - 1] - line[across_ - 2];
    return line[i];
  }
  double at(int i, int j) const {
    if (down_ < 2) return in_row(i, 0);
    if (j < 0) return 2.0 * in_row(i, 0) - in_row(i, 1);
    if (j >= down_) return 2.0 * in_row(i, down_ - 1) - in_row(i, down_ - 2);
    return in_row(i, j);
  }

  int across_, down_;
  std::vector<double> grid_;
};

}  // namespace

void Keyer::State::lay_out_screen(const FrameView& frame) {
  local = false;
  if (method != KeyMethod::soft) return;
  const double range = std::max(screen_level - foreground_level, least_range);
  // What the screen's signal spreads beyond a camera's noise is clipped, unless it is followed.
  const bool plate_given = settings.plate || !learned_plate.empty();
  const double clip =
      settings.uneven || plate_given ? 0.0 : std::min(3.0 * unevenness / range, 0.25);
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
  if (!plate_given && !settings.uneven) return;

  local = true;
  const std::size_t length = row_length();
  base.assign(length * static_cast<std::size_t>(height), ramp.base);
  gain.assign(length * static_cast<std::size_t>(height), ramp.gain);
  const auto put_all = [&](const auto& screen_at) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const silhouette::Ramp r = ramp_for(screen_at(x, y));
        base[length * static_cast<std::size_t>(y) + x] = r.base;
        gain[length * static_cast<std::size_t>(y) + x] = r.gain;
      }
  };
  const double step = screen_level - foreground_level;
  if (plate_given) {
    lay_out_plate();
    put_all([&](int x, int y) {
      const std::uint8_t* p = plate.data() + 4 * (length * static_cast<std::size_t>(y) + x);
      // Where the plate shows no screen, only what is clearly no screen either can be told apart.
      return std::max(signal.of(p[0], p[1], p[2]), foreground_level + 0.3 * step);
    });
  } else {
    ScreenMap map(width, height);
    map.sample(frame, signal, foreground_level + 0.4 * step);
    map.fill_gaps(screen_level);
    put_all(map);
  }
}

}  // namespace polyhull
