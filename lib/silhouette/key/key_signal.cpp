// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/key_signal.h"

#include <algorithm>
#include <cmath>

namespace polyhull::silhouette {
namespace {

using Triple = std::array<double, 3>;

// Hue angle, in radians, in the plane normal to the grey axis; red lies at 0, and only differences
// matter.
double hue_angle(double red, double green, double blue) {
  return std::atan2((green - blue) / std::sqrt(2.0), (2.0 * red - green - blue) / std::sqrt(6.0));
}

// Rodrigues' rotation about (1, 1, 1)/sqrt(3).
Triple turn(const Triple& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), axis = 1.0 / std::sqrt(3.0);
  const double along = (v[0] + v[1] + v[2]) / 3.0 * (1.0 - c);
  return {v[0] * c + axis * s * (v[2] - v[1]) + along, v[1] * c + axis * s * (v[0] - v[2]) + along,
          v[2] * c + axis * s * (v[1] - v[0]) + along};
}

// Rounds to whole weights with a sum of zero; the weight rounded worst takes the remainder.
std::array<int, 3> whole_weights(const Triple& v, double unit) {
  std::array<int, 3> w;
  double error[3];
  int sum = 0;
  for (int i = 0; i < 3; ++i) {
    w[i] = static_cast<int>(std::lround(v[i] * unit));
    error[i] = v[i] * unit - w[i];
    sum += w[i];
  }
  while (sum != 0) {
    const int step = sum > 0 ? -1 : 1;
    int worst = 0;
    for (int i = 1; i < 3; ++i)
      if (error[i] * step > error[worst] * step) worst = i;
    w[worst] += step;
    error[worst] -= step;
    sum += step;
  }
  return w;
}

}  // namespace

double KeySignal::of(double red, double green, double blue) const {
  return std::min(a[0] * red + a[1] * green + a[2] * blue + offset[0],
                  b[0] * red + b[1] * green + b[2] * blue + offset[1]) /
         unit;
}

int saturation_of(const Rgb& colour) {
  return std::max({colour[0], colour[1], colour[2]}) - std::min({colour[0], colour[1], colour[2]});
}

KeySignal key_signal(KeyColour key, const Rgb& hue, double red_gain, double blue_gain) {
  KeySignal signal;
  if (key == KeyColour::green) {
    signal.a = {-signal_scale, signal_scale, 0};
    signal.b = {0, signal_scale, -signal_scale};
    signal.direction = {0.0, 1.0, 0.0};
  } else if (key == KeyColour::blue) {
    signal.a = {-signal_scale, 0, signal_scale};
    signal.b = {0, -signal_scale, signal_scale};
    signal.direction = {0.0, 0.0, 1.0};
  } else {
    const double angle = hue_angle(hue[0], hue[1], hue[2]) - hue_angle(0.0, 1.0, 0.0);
    signal.a = whole_weights(turn({-1.0, 1.0, 0.0}, angle), signal_scale);
    signal.b = whole_weights(turn({0.0, 1.0, -1.0}, angle), signal_scale);
    signal.direction = turn({0.0, 1.0, 0.0}, angle);
  }
  if (red_gain == 1.0 && blue_gain == 1.0) return signal;

  signal.chroma_only = false;
  const double gains[3] = {red_gain, 1.0, blue_gain};
  Triple a, b;
  double largest = 0.0;
  for (int i = 0; i < 3; ++i) {
    a[i] = signal.a[i] * gains[i];
    b[i] = signal.b[i] * gains[i];
  }
  // Weights of any two channels must fit the 16-bit sums of the kernels, whatever the byte order.
  for (const Triple& v : {a, b})
    for (int i = 0; i < 3; ++i)
      largest = std::max(largest, std::abs(v[i]) + std::abs(v[(i + 1) % 3]));
  const double scale = largest > 126.0 ? 126.0 / largest : 1.0;
  for (int i = 0; i < 3; ++i) {
    signal.a[i] = static_cast<int>(std::lround(a[i] * scale));
    signal.b[i] = static_cast<int>(std::lround(b[i] * scale));
  }
  signal.unit *= scale;
  return signal;
}

KeySignal calibrated(const KeySignal& signal, const Vec3f& screen, const Vec3f& foreground,
                     double noise) {
  constexpr double most = 3.0;    // how much more a form's noise may weigh than the other's
  constexpr double behind = 0.7;  // how far the weaker form stays behind at most
  const auto value = [](const std::array<int, 3>& w, const Vec3f& c) {
    return double{w[0] * c[0] + w[1] * c[1] + w[2] * c[2]};
  };
  KeySignal out = signal;
  std::array<int, 3>* const forms[2] = {&out.a, &out.b};
  double range[2];
  for (int f = 0; f < 2; ++f) range[f] = value(*forms[f], screen) - value(*forms[f], foreground);
  const int wide = range[0] >= range[1] ? 0 : 1;
  const int narrow = 1 - wide;
  if (range[wide] <= 0.0) return signal;
  // The wider form is scaled down to the narrower one's range: weights can shrink, not grow.
  const double weaker = std::max(range[narrow], range[wide] / most);
  const double kept = std::clamp(1.0 - 4.0 * noise * signal.unit / weaker, behind, 1.0);
  const double scale = std::min(weaker / kept / range[wide], 1.0);
  Triple scaled;
  for (int i = 0; i < 3; ++i) scaled[i] = (*forms[wide])[i] * scale;
  *forms[wide] = signal.chroma_only ? whole_weights(scaled, 1.0)
                                    : std::array<int, 3>{static_cast<int>(std::lround(scaled[0])),
                                                         static_cast<int>(std::lround(scaled[1])),
                                                         static_cast<int>(std::lround(scaled[2]))};
  out.offset[wide] =
      static_cast<int>(std::lround(value(*forms[narrow], screen) - value(*forms[wide], screen)));
  return out;
}

PixelForms pixel_forms(const KeySignal& signal, FrameFormat format) {
  const bool reversed = format == FrameFormat::bgrx || format == FrameFormat::bgra;
  PixelForms forms{};
  for (int i = 0; i < 3; ++i) {
    const int at = reversed ? 2 - i : i;
    forms.a[at] = static_cast<std::int8_t>(signal.a[i]);
    forms.b[at] = static_cast<std::int8_t>(signal.b[i]);
  }
  forms.a_offset = static_cast<std::int16_t>(std::clamp(signal.offset[0], -32767, 32767));
  forms.b_offset = static_cast<std::int16_t>(std::clamp(signal.offset[1], -32767, 32767));
  return forms;
}

ChromaForms chroma_forms(const KeySignal& signal, const FrameView& frame) {
  const ColourCoefficients c = colour_coefficients(frame);
  ChromaForms forms{};
  const std::array<int, 3>* weights[2] = {&signal.a, &signal.b};
  for (int f = 0; f < 2; ++f) {
    double cb = 0.0, cr = 0.0;
    for (int i = 0; i < 3; ++i) {
      cb += (*weights[f])[i] * c.cb[i];
      cr += (*weights[f])[i] * c.cr[i];
    }
    // The kernel sees four times the chroma and shifts by 8.
    const auto fixed = [](double v) {
      return static_cast<std::int16_t>(std::clamp(std::lround(v * 64.0), -32767l, 32767l));
    };
    forms.weights[2 * f] = fixed(cb);
    forms.weights[2 * f + 1] = fixed(cr);
    forms.offsets[f] =
        -static_cast<int>(c.chroma_zero) * 4 * (forms.weights[2 * f] + forms.weights[2 * f + 1]) +
        128 + (signal.offset[f] << 8);
  }
  return forms;
}

}  // namespace polyhull::silhouette
