// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/room_textures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "base/vector.h"

namespace polyhull {
namespace {

std::uint32_t mixed(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  return x ^ (x >> 16);
}

/// A random number in 0..1 for each whole place.
float lattice(int x, int y, std::uint32_t seed) {
  return static_cast<float>(mixed(static_cast<std::uint32_t>(x) +
                                  mixed(static_cast<std::uint32_t>(y) + mixed(seed))) >>
                            8) *
         0x1p-24f;
}

/// std::lerp() of numbers from 0 on and t <= 1, without its cases for others.
float between(float a, float b, float t) {
  const float value = t == 1.0f ? b : a + t * (b - a);
  return b > a ? std::min(value, b) : std::max(value, b);
}

/// Smooth noise in 0..1 that repeats after \p period in both directions. Its random numbers are
/// made once: a pixel looks up four of each of a dozen noises.
class Noise {
 public:
  Noise(int period, std::uint32_t seed) : period_(period) {
    const auto repeated = [&](int i) { return i < period ? i : 0; };
    for (int y = 0; y <= period; ++y)
      for (int x = 0; x <= period; ++x) lattice_.push_back(lattice(repeated(x), repeated(y), seed));
  }

  float at(float x, float y) const {
    // std::floor is a call of a function on plain x86-64; places here are far inside an int.
    const auto down = [](float value) {
      const auto whole = static_cast<float>(static_cast<int>(value));
      return whole > value ? whole - 1.0f : whole;
    };
    const float fx = down(x), fy = down(y);
    const auto smooth = [](float t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); };
    const float u = smooth(x - fx), v = smooth(y - fy);
    const auto wrap = [&](float value) {
      const int i = static_cast<int>(value);
      if (i >= 0 && i < period_) return i;
      const int rest = i % period_;
      return rest < 0 ? rest + period_ : rest;
    };
    const int stride = period_ + 1;
    const float* above = &lattice_[static_cast<std::size_t>(wrap(fy)) * stride + wrap(fx)];
    const float* below = above + stride;
    return between(between(above[0], above[1], u), between(below[0], below[1], u), v);
  }

 private:
  int period_;
  std::vector<float> lattice_;  // by rows, its first row and column once more at their ends
};

/// Octaves of noise over the unit square, \p period cells in the first; about 0..1, mean 0.5.
class Clouds {
 public:
  Clouds(int period, int octaves, std::uint32_t seed) {
    for (int i = 0; i < octaves; ++i, period *= 2)
      octaves_.push_back(
          {static_cast<float>(period), {period, seed + static_cast<std::uint32_t>(i)}});
  }

  float at(float x, float y) const {
    float sum = 0.0f, weight = 0.5f, total = 0.0f;
    for (const Octave& octave : octaves_) {
      sum += weight * octave.noise.at(x * octave.period, y * octave.period);
      total += weight;
      weight *= 0.5f;
    }
    return sum / total;
  }

 private:
  struct Octave {
    float period;
    Noise noise;
  };
  std::vector<Octave> octaves_;
};

std::array<std::uint8_t, 4096> make_srgb_table() {
  std::array<std::uint8_t, 4096> table;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double v = (static_cast<double>(i) + 0.5) / static_cast<double>(table.size());
    table[i] = static_cast<std::uint8_t>(std::lround(255.0 * srgb_encoded(v)));
  }
  return table;
}

std::uint8_t srgb_byte(float linear) {
  static const std::array<std::uint8_t, 4096> table = make_srgb_table();
  return table[static_cast<std::size_t>(std::clamp(linear * 4096.0f, 0.0f, 4095.0f))];
}

/// One pixel in so many is computed to see whether a kept picture is the same; no multiple of a
/// picture's width, so that they are in all columns.
constexpr std::size_t looked_at = 101;

/// The picture of colour(u, v), or \p kept if it is the same.
template <typename Colour>
Picture paint(int width, int height, Picture kept, const Colour& colour) {
  const auto paint_pixel = [&](std::size_t x, std::size_t y, std::uint8_t* pixel) {
    const Vec3f c = colour((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                           (static_cast<float>(y) + 0.5f) / static_cast<float>(height));
    for (int k = 0; k < 3; ++k) pixel[k] = srgb_byte(c[k]);
    pixel[3] = 255;
  };
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  bool same = kept.width == width && kept.height == height;
  for (std::size_t i = 0; same && i < columns * rows; i += looked_at) {
    std::uint8_t pixel[4];
    paint_pixel(i % columns, i / columns, pixel);
    same = std::equal(pixel, pixel + 4, &kept.pixels[4 * i]);
  }
  if (same) return kept;
  Picture picture{width, height, 4, std::vector<std::uint8_t>(4u * width * height)};
  parallel_each(rows, 16, 0, [&](std::size_t y) {
    for (std::size_t x = 0; x < columns; ++x)
      paint_pixel(x, y, &picture.pixels[4 * (y * columns + x)]);
  });
  return picture;
}

}  // namespace

Picture stone_texture(int size, Picture kept) {
  struct Slab {
    Clouds bend_x, bend_y, cloud, ridge;
    explicit Slab(std::uint32_t seed)
        : bend_x(4, 3, seed),
          bend_y(4, 3, seed + 7),
          cloud(6, 5, seed + 13),
          ridge(3, 3, seed + 29) {}
  };
  const Slab slabs[] = {Slab(100), Slab(120), Slab(140), Slab(160)};
  return paint(size, size, std::move(kept), [&](float u, float v) {
    const int tile = (u < 0.5f ? 0 : 1) + (v < 0.5f ? 0 : 2);
    const Slab& slab = slabs[tile];
    // Each slab is cut from another place of the quarry and laid in another direction.
    const float x = tile % 3 == 0 ? u : v, y = tile % 3 == 0 ? v : 1.0f - u;
    const float bend_x = slab.bend_x.at(x, y) - 0.5f, bend_y = slab.bend_y.at(x, y) - 0.5f;
    const float cloud = slab.cloud.at(x + 0.12f * bend_x, y + 0.12f * bend_y);
    const float ridge = std::abs(slab.ridge.at(x + 0.35f * bend_x, y + 0.35f * bend_y) - 0.5f);
    const float far = ridge * ridge * 9000.0f;
    const float vein =
        far > 110.0f ? 0.0f : std::exp(-far) * std::clamp(3.0f * cloud - 1.0f, 0.0f, 1.0f);
    const bool light = tile == 0 || tile == 3;
    Vec3f colour = light ? Vec3f(0.125f, 0.120f, 0.112f) : Vec3f(0.046f, 0.050f, 0.056f);
    colour *= 0.62f + 0.76f * cloud;
    colour = glm::mix(colour, Vec3f(0.34f, 0.31f, 0.26f), 0.55f * vein);
    const auto to_joint = [](float t) { return std::min({t, std::abs(t - 0.5f), 1.0f - t}); };
    const float joint = std::min(to_joint(u), to_joint(v));
    const float in_joint = std::clamp((0.0021f - joint) / 0.0008f, 0.0f, 1.0f);
    return glm::mix(colour, Vec3f(0.018f), in_joint);
  });
}

Picture wood_texture(int size, Picture kept) {
  const Clouds bends(2, 3, 501), grains(8, 4, 521);
  const Noise fibres(192, 511);
  return paint(size, size, std::move(kept), [&](float u, float v) {
    const float bend = bends.at(u, v) - 0.5f;
    const float rings = v * 14.0f + 2.6f * bend;
    const float ring = rings - std::floor(rings);
    const float fibre = fibres.at(u * 12.0f, v * 192.0f);
    const float grain = grains.at(u, v);
    const float dark = 0.55f * ring * ring + 0.25f * fibre + 0.2f * grain;
    return glm::mix(Vec3f(0.42f, 0.225f, 0.095f), Vec3f(0.155f, 0.066f, 0.026f), dark);
  });
}

Picture painting_texture(int width, int height, Picture kept) {
  const Clouds brushes(24, 4, 601);
  // Three ranges of hills, by column.
  std::vector<std::array<float, 3>> ridges(static_cast<std::size_t>(width));
  for (int i = 0; i < 3; ++i) {
    const float f = static_cast<float>(i);
    const Clouds clouds(8, 4, 611 + 7 * static_cast<std::uint32_t>(i));
    for (int x = 0; x < width; ++x) {
      const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(width);
      ridges[x][i] = 0.56f + 0.13f * f + 0.10f * std::sin(u * (5.0f - f) + 2.1f * f) +
                     0.10f * (clouds.at(u, 0.37f) - 0.5f);
    }
  }
  return paint(width, height, std::move(kept), [&](float u, float v) {
    const float brush = brushes.at(u * 0.999f, v * 0.999f) - 0.5f;
    Vec3f colour = glm::mix(Vec3f(0.10f, 0.22f, 0.36f), Vec3f(0.92f, 0.52f, 0.22f),
                            std::clamp(1.45f * v + 0.25f * brush, 0.0f, 1.0f));
    const float dx = 1.6f * (u - 0.67f), dy = v - 0.42f;
    const float sun = std::sqrt(dx * dx + dy * dy);
    colour =
        glm::mix(Vec3f(1.0f, 0.86f, 0.55f), colour, std::clamp((sun - 0.105f) * 90.0f, 0.0f, 1.0f));
    const Vec3f hills[] = {{0.42f, 0.22f, 0.24f}, {0.20f, 0.12f, 0.22f}, {0.05f, 0.07f, 0.13f}};
    const std::array<float, 3>& ridge =
        ridges[static_cast<std::size_t>(u * static_cast<float>(width))];
    for (std::size_t i = 0; i < 3; ++i)
      if (v > ridge[i]) colour = hills[i] * (0.8f + 0.55f * (v - ridge[i]) + 0.6f * brush);
    return colour;
  });
}

Picture print_texture(int width, int height, unsigned number, Picture kept) {
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  struct Disc {
    float x, y, radius;
  };
  std::array<Disc, 5> discs;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const auto random = [&](int k) { return lattice(k, static_cast<int>(i), 701 + number); };
    discs[i] = {(0.2f + 0.6f * random(0)) * aspect, 0.2f + 0.6f * random(1),
                0.10f + 0.14f * random(2)};
  }
  const Noise fibres(128, 733);
  return paint(width, height, std::move(kept), [&](float u, float v) {
    const Vec3f paper(0.80f, 0.76f, 0.68f);
    const float edge = std::min({u * aspect, v, (1.0f - u) * aspect, 1.0f - v});
    if (edge < 0.07f) return paper;
    const Vec3f inks[3][3] = {
        {{0.62f, 0.16f, 0.06f}, {0.05f, 0.20f, 0.24f}, {0.72f, 0.48f, 0.14f}},
        {{0.04f, 0.10f, 0.24f}, {0.66f, 0.26f, 0.10f}, {0.30f, 0.42f, 0.40f}},
        {{0.10f, 0.22f, 0.12f}, {0.70f, 0.50f, 0.20f}, {0.46f, 0.08f, 0.08f}}};
    const Vec3f* ink = inks[number % 3];
    Vec3f colour = paper * 0.93f;
    for (std::size_t i = 0; i < discs.size(); ++i) {
      const auto [x, y, radius] = discs[i];
      const float across = u * aspect - x, down = v - y;
      if (std::max(std::abs(across), std::abs(down)) > radius) continue;
      const float distance = std::hypot(across, down);
      const float cover = std::clamp((radius - distance) * 400.0f, 0.0f, 1.0f);
      const bool ring = i % 2 == 1;
      const float hole = ring ? std::clamp((0.7f * radius - distance) * 400.0f, 0.0f, 1.0f) : 0.0f;
      // Inks are laid over one another as on a press.
      colour =
          glm::mix(colour, glm::mix(ink[i % 3], ink[i % 3] * colour * 1.6f, 0.6f), cover - hole);
    }
    return colour * (0.94f + 0.12f * fibres.at(u * 90.0f, v * 120.0f));
  });
}

Picture tapestry_texture(int width, int height, Picture kept) {
  const Noise threads(256, 811);
  return paint(width, height, std::move(kept), [&](float u, float v) {
    const Vec3f yarns[] = {{0.42f, 0.34f, 0.22f},
                           {0.030f, 0.085f, 0.115f},
                           {0.52f, 0.30f, 0.07f},
                           {0.055f, 0.16f, 0.15f},
                           {0.60f, 0.52f, 0.38f}};
    const float y = 12.0f * v;
    const int band = static_cast<int>(y);
    const float inside = y - static_cast<float>(band);
    int yarn = 0;
    if (v < 0.03f || v > 0.97f || u < 0.03f || u > 0.97f) {
      yarn = 1;
    } else if (band % 3 == 0) {
      yarn = static_cast<int>(inside * 5.0f) % 2 ? 2 : 1;
    } else if (band % 3 == 1) {
      const float x = u * 8.0f - std::trunc(u * 8.0f);
      const float lozenge = std::abs(x - 0.5f) + std::abs(inside - 0.5f);
      yarn = lozenge < 0.18f ? 4 : lozenge < 0.40f ? 3 : 0;
    } else {
      const float step = u * 12.0f - std::trunc(u * 12.0f);
      yarn = inside < 0.25f * (1.0f + std::trunc(3.0f * std::abs(2.0f * step - 1.0f))) ? 2 : 4;
    }
    const float thread = 0.90f + 0.20f * threads.at(u * 170.0f, v * 256.0f);
    return yarns[yarn] * thread;
  });
}

}  // namespace polyhull
