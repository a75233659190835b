// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/blur/blur_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace polyhull::silhouette {
namespace {

using std::numbers::pi;

// Columns are filtered side by side in lanes; rows are turned into columns by transposing tiles.
constexpr int lanes = 16;

// One running mean with fractional ends: out[i] = (Σ_{|k|<=r} x[i+k] + f (x[i-r-1] + x[i+r+1])) /
// width, for `lanes` columns at once. `x` has r+1 lines of room on both sides.
void box_lines(const float* x, float* out, int count, int r, float f, float width) {
  std::array<double, lanes> sum{};
  for (int k = -r; k <= r; ++k)
    for (int l = 0; l < lanes; ++l) sum[l] += x[k * lanes + l];
  const double scale = 1.0 / width, part = f / width;
  for (int i = 0; i < count; ++i) {
    const float* before = x + (i - r - 1) * lanes;
    const float* after = x + (i + r + 1) * lanes;
    const float* leaves = x + (i - r) * lanes;
    for (int l = 0; l < lanes; ++l) {
      out[i * lanes + l] =
          static_cast<float>(sum[l] * scale + part * (static_cast<double>(before[l]) + after[l]));
      sum[l] += static_cast<double>(after[l]) - leaves[l];
    }
  }
}

struct BoxShape {
  int radius;
  float fraction, width;
};

// Width 2r+1+2f with variance sigma² / passes (Gwosdek et al. 2011, eq. 10).
BoxShape box_shape(double sigma, int passes) {
  const double variance = sigma * sigma / passes;
  const int r = static_cast<int>(std::floor(0.5 * std::sqrt(12.0 * variance + 1.0) - 0.5));
  const double whole = 2.0 * r + 1.0;
  const double f =
      whole * (r * (r + 1.0) - 3.0 * variance) / (6.0 * (variance - (r + 1.0) * (r + 1.0)));
  return {r, static_cast<float>(f), static_cast<float>(whole + 2.0 * f)};
}

// Charalampidis 2016: the Gaussian as a few cosines over [-N, N], each from a second-order
// recursion y[i] = n_k (x[i+N-1] + x[i-N-1]) + 2 cos(w_k) y[i-1] - y[i-2].
constexpr int terms = 4;
struct Cosines {
  int reach;
  std::array<double, terms> feed, turn;
};

Cosines cosines(double sigma) {
  // Section 2.2 of the paper: N and the frequencies pi (2k-1) / (2N); amplitudes by least squares
  // against the Gaussian with the DC gain fixed to 1. The first cosine left out weighs
  // exp(-(pi (2 terms + 1) sigma / (2N))^2 / 2), what is cut off beyond N exp(-(N / sigma)^2 / 2):
  // equal at N = 3.76 sigma, both 0.085 %.
  const int n = static_cast<int>(std::lround(std::sqrt(pi * (2 * terms + 1) / 2.0) * sigma + 0.25));
  std::array<double, terms> w;
  for (int k = 0; k < terms; ++k) w[k] = pi * (2 * k + 1) / (2.0 * n);
  // The cosines are orthogonal over (-N, N), so each amplitude is a projection.
  std::array<double, terms> amplitude{};
  double norm = 0.0;
  for (int i = -n + 1; i < n; ++i) norm += std::cos(w[0] * i) * std::cos(w[0] * i);
  double total = 0.0;
  for (int i = -4 * n; i <= 4 * n; ++i) total += std::exp(-0.5 * i * i / (sigma * sigma));
  for (int k = 0; k < terms; ++k) {
    for (int i = -n + 1; i < n; ++i)
      amplitude[k] += std::cos(w[k] * i) * std::exp(-0.5 * i * i / (sigma * sigma)) / total;
    amplitude[k] /= norm;
  }
  double gain = 0.0;
  for (int i = -n + 1; i < n; ++i)
    for (int k = 0; k < terms; ++k) gain += amplitude[k] * std::cos(w[k] * i);
  Cosines out{n, {}, {}};
  for (int k = 0; k < terms; ++k) {
    // h[i] = A cos(w i) on |i| < N has zeros at +-N, so (1 - 2 cos w z^-1 + z^-2) leaves of it only
    // A cos(w (N-1)) at i = -(N-1) and at i = N+1.
    out.feed[k] = amplitude[k] / gain * std::cos(w[k] * (n - 1));
    out.turn[k] = 2.0 * std::cos(w[k]);
  }
  return out;
}

void cosine_lines(const float* x, float* out, int count, const Cosines& c) {
  // From rest at line -N-1 of the border values: line 0 then has its whole kernel behind it, and a
  // value's way out of the recursion, 2N lines after its way in, is due from line 0 on.
  const int n = c.reach;
  std::array<std::array<double, lanes>, terms> last{}, before{};
  for (int i = -2 * n; i < count; ++i) {
    const float* ahead = x + (i + n - 1) * lanes;
    const float* behind = x + (i - n - 1) * lanes;
    std::array<double, lanes> sum{};
    for (int k = 0; k < terms; ++k) {
      const double feed = c.feed[k], turn = c.turn[k];
      for (int l = 0; l < lanes; ++l) {
        const double in = static_cast<double>(ahead[l]) + (i >= 0 ? behind[l] : 0.0);
        const double y = feed * in + turn * last[k][l] - before[k][l];
        before[k][l] = last[k][l];
        last[k][l] = y;
        sum[l] += y;
      }
    }
    if (i >= 0)
      for (int l = 0; l < lanes; ++l) out[i * lanes + l] = static_cast<float>(sum[l]);
  }
}

constexpr int direct_taps = 7;

/// A filter along lines, `lanes` of them at a time.
struct LineFilter {
  explicit LineFilter(const BlurSettings& blur);

  /// Filters \p count values per line, which lie in \p padded behind room for `reach`; what it
  /// returns lies in \p result. Both may change places.
  const float* run(std::vector<float>& padded, std::vector<float>& result, int count) const;

  BlurSettings settings;
  BoxShape shape;
  bool boxes, recursive;
  Cosines c;
  int reach;
  std::array<double, direct_taps> direct{};  // of narrow kernels, which few cosines do not resolve
};

LineFilter::LineFilter(const BlurSettings& blur)
    : settings(blur),
      shape(box_shape(blur.sigma, blur.passes)),
      boxes(blur.method == BlurMethod::box),
      recursive(!boxes && blur.sigma >= 1.5),
      c(recursive ? cosines(blur.sigma) : Cosines{}),
      reach(boxes       ? (shape.radius + 1) * blur.passes
            : recursive ? c.reach + 2
                        : direct_taps) {
  double total = 0.0;
  for (int k = 0; k < direct_taps && !boxes && !recursive; ++k) {
    direct[k] = blur.sigma > 0.0 ? std::exp(-0.5 * k * k / (blur.sigma * blur.sigma)) : k == 0;
    total += k == 0 ? direct[k] : 2.0 * direct[k];
  }
  for (double& d : direct) d /= total;
}

const float* LineFilter::run(std::vector<float>& padded, std::vector<float>& result,
                             int count) const {
  float* x = padded.data() + static_cast<std::ptrdiff_t>(reach) * lanes;
  for (int i = 1; i <= reach; ++i) {
    std::copy_n(x, lanes, x - i * lanes);
    std::copy_n(x + (count - 1) * lanes, lanes, x + (count - 1 + i) * lanes);
  }
  float* out = result.data() + static_cast<std::ptrdiff_t>(reach) * lanes;
  if (recursive) {
    cosine_lines(x, out, count, c);
  } else if (!boxes) {
    for (int i = 0; i < count * lanes; ++i) {
      double sum = direct[0] * x[i];
      for (int k = 1; k < direct_taps; ++k)
        sum += direct[k] * (static_cast<double>(x[i - k * lanes]) + x[i + k * lanes]);
      out[i] = static_cast<float>(sum);
    }
  }
  for (int pass = 0; boxes && pass < settings.passes; ++pass) {
    if (pass > 0) {
      std::swap(padded, result);
      std::swap(x, out);
    }
    // The room shrinks with every pass; border values stay right because the room is filtered too.
    const int room = reach - (shape.radius + 1) * (pass + 1);
    box_lines(x - room * lanes, out - room * lanes, count + 2 * room, shape.radius, shape.fraction,
              shape.width);
  }
  return out;
}

}  // namespace

void PlaneBlur::apply(const Matte& matte, const BlurSettings& settings, Field& field) {
  const int w = matte.width, h = matte.height;
  const LineFilter filter(settings);
  const int reach = filter.reach;
  const std::size_t longest = static_cast<std::size_t>(std::max(w, h) + 2 * reach + 2) * lanes;
  padded_.resize(longest);
  result_.resize(longest);
  plane_.resize(static_cast<std::size_t>(w) * h);

  for (int x0 = 0; x0 < w; x0 += lanes) {
    const int n = std::min(lanes, w - x0);
    float* x = padded_.data() + static_cast<std::ptrdiff_t>(reach) * lanes;
    for (int y = 0; y < h; ++y)
      for (int l = 0; l < n; ++l) x[y * lanes + l] = matte.row(y)[x0 + l];
    const float* out = filter.run(padded_, result_, h);
    for (int y = 0; y < h; ++y)
      for (int l = 0; l < n; ++l)
        plane_[static_cast<std::size_t>(y) * w + x0 + l] = out[y * lanes + l];
  }
  for (int y0 = 0; y0 < h; y0 += lanes) {
    const int n = std::min(lanes, h - y0);
    float* x = padded_.data() + static_cast<std::ptrdiff_t>(reach) * lanes;
    for (int i = 0; i < w; ++i)
      for (int l = 0; l < n; ++l)
        x[i * lanes + l] = plane_[static_cast<std::size_t>(y0 + l) * w + i];
    const float* out = filter.run(padded_, result_, w);
    for (int l = 0; l < n; ++l) {
      std::int16_t* to = field.row(y0 + l);
      for (int i = 0; i < w; ++i)
        to[i] = static_cast<std::int16_t>(
            std::clamp(out[i * lanes + l], 0.0f, 255.0f) * field_scale + 0.5f);
      BlockState* states = field.state_row(y0 + l);
      for (int b = 0; b < blocks_across(w); ++b) {
        BlockState state = 0;
        for (int i = b * matte_block; i < std::min((b + 1) * matte_block, w); ++i)
          state |= to[i] == 0 ? block_empty : to[i] == field_full ? block_full : block_mixed;
        states[b] = state;
      }
    }
  }
}

}  // namespace polyhull::silhouette
