// SPDX-License-Identifier: LGPL-2.1-or-later
#include "flip.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "base/vector.h"

namespace polyhull::synthetic {
namespace {

using Plane = std::vector<float>;

struct Layers {
  int width = 0, height = 0;
  Plane planes[3];
};

// Linear sRGB to CIE XYZ (IEC 61966-2-1), by columns.
const Mat3 xyz_from_rgb(Vec3(0.4124564, 0.2126729, 0.0193339),
                        Vec3(0.3575761, 0.7151522, 0.1191920),
                        Vec3(0.1804375, 0.0721750, 0.9503041));
const Vec3 white = xyz_from_rgb * Vec3(1.0);

/// Y, Cx, Cz of a linear colour.
Vec3 opponents(const Vec3& rgb) {
  const Vec3 c = xyz_from_rgb * rgb / white;
  return {116.0 * c.y - 16.0, 500.0 * (c.x - c.y), 200.0 * (c.y - c.z)};
}

Vec3 linear_of(const Vec3& opponent) {
  const double y = (opponent.x + 16.0) / 116.0;
  const Vec3 xyz = Vec3(opponent.y / 500.0 + y, y, y - opponent.z / 200.0) * white;
  return glm::clamp(glm::inverse(xyz_from_rgb) * xyz, Vec3(0.0), Vec3(1.0));
}

/// L*, and a* and b* as Hunt's effect has them: less colourful the darker they are.
Vec3 hunt_lab(const Vec3& rgb) {
  const Vec3 c = xyz_from_rgb * rgb / white;
  Vec3 f;
  for (int k = 0; k < 3; ++k) {
    constexpr double d = 6.0 / 29.0;
    f[k] = c[k] > d * d * d ? std::cbrt(c[k]) : c[k] / (3.0 * d * d) + 4.0 / 29.0;
  }
  const double lightness = 116.0 * f.y - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (f.x - f.y),
          0.01 * lightness * 200.0 * (f.y - f.z)};
}

double hyab(const Vec3& a, const Vec3& b) {
  return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

/// A square filter of side 2 radius + 1.
struct Filter {
  int radius = 0;
  std::vector<float> weights;

  Filter(int reach, const std::function<double(int, int)>& value) : radius(reach) {
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x) weights.push_back(static_cast<float>(value(x, y)));
  }
  /// Makes those above 0 sum up to 1, and those below to -1.
  Filter& normalise() {
    double more = 0.0, less = 0.0;
    for (const float w : weights) (w > 0.0f ? more : less) += w;
    for (float& w : weights) w /= static_cast<float>(w > 0.0f ? more : -less);
    return *this;
  }
  /// The picture goes on beyond its border as it is there.
  Plane apply(const Plane& in, int width, int height) const {
    Plane out(in.size());
    parallel_for(static_cast<std::size_t>(height), 4, 0, [&](std::size_t begin, std::size_t end) {
      std::vector<float> row(static_cast<std::size_t>(width + 2 * radius));
      for (std::size_t line = begin; line < end; ++line) {
        float* to = &out[line * static_cast<std::size_t>(width)];
        for (int j = -radius; j <= radius; ++j) {
          const int y = std::clamp(static_cast<int>(line) + j, 0, height - 1);
          const float* from = &in[static_cast<std::size_t>(y) * width];
          for (int x = -radius; x < width + radius; ++x)
            row[static_cast<std::size_t>(x + radius)] = from[std::clamp(x, 0, width - 1)];
          const float* w = &weights[static_cast<std::size_t>(j + radius) * (2 * radius + 1)];
          for (int i = 0; i <= 2 * radius; ++i)
            for (int x = 0; x < width; ++x) to[x] += w[i] * row[static_cast<std::size_t>(x + i)];
        }
      }
    });
    return out;
  }
};

Layers opponents_of(const Picture& picture) {
  Layers out{picture.width, picture.height, {}};
  const float* decode = srgb_to_linear_table();
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const std::uint8_t* p = picture.row(y) + picture.channels * x;
      const Vec3 value = opponents({decode[p[0]], decode[p[1]], decode[p[2]]});
      for (int c = 0; c < 3; ++c) out.planes[c].push_back(static_cast<float>(value[c]));
    }
  }
  return out;
}

/// What is left of the picture's colours at the eye, as hunt_lab().
std::vector<Vec3> perceived(const Layers& picture, double pixels_per_degree) {
  struct Sensitivity {
    double a1, b1, a2, b2;
  };
  // Table 1 of the paper.
  constexpr Sensitivity channels[3] = {
      {1.0, 0.0047, 0.0, 1e-5}, {1.0, 0.0053, 0.0, 1e-5}, {34.1, 0.04, 13.5, 0.025}};
  constexpr double pi = std::numbers::pi;
  const int reach =
      static_cast<int>(std::ceil(3.0 * std::sqrt(0.04 / (2.0 * pi * pi)) * pixels_per_degree));
  Plane blurred[3];
  for (int c = 0; c < 3; ++c) {
    const Sensitivity& s = channels[c];
    Filter filter(reach, [&](int x, int y) {
      const double d2 = (x * x + y * y) / (pixels_per_degree * pixels_per_degree);
      return s.a1 * std::sqrt(pi / s.b1) * std::exp(-pi * pi * d2 / s.b1) +
             s.a2 * std::sqrt(pi / s.b2) * std::exp(-pi * pi * d2 / s.b2);
    });
    blurred[c] = filter.normalise().apply(picture.planes[c], picture.width, picture.height);
  }
  std::vector<Vec3> out(blurred[0].size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = hunt_lab(linear_of({blurred[0][i], blurred[1][i], blurred[2][i]}));
  return out;
}

/// How much of an edge, and of a point, each pixel is.
struct Features {
  Plane edge, point;
};

Features features(const Layers& picture, double pixels_per_degree) {
  const double deviation = 0.5 * 0.082 * pixels_per_degree;
  const int reach = static_cast<int>(std::ceil(3.0 * deviation));
  const auto bell = [&](int x, int y) {
    return std::exp(-(x * x + y * y) / (2.0 * deviation * deviation));
  };
  const auto first = [&](int x, int y) { return -x * bell(x, y); };
  const auto second = [&](int x, int y) {
    return (x * x / (deviation * deviation) - 1.0) * bell(x, y);
  };
  Plane lightness = picture.planes[0];
  for (float& value : lightness) value = (value + 16.0f) / 116.0f;
  const auto strength = [&](const std::function<double(int, int)>& along) {
    Plane x = Filter(reach, along).normalise().apply(lightness, picture.width, picture.height);
    const Plane y = Filter(reach, [&](int i, int j) { return along(j, i); })
                        .normalise()
                        .apply(lightness, picture.width, picture.height);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::hypot(x[i], y[i]);
    return x;
  };
  return {strength(first), strength(second)};
}

}  // namespace

double mean_flip(const Picture& reference, const Picture& shown, double pixels_per_degree) {
  const Layers pictures[2] = {opponents_of(reference), opponents_of(shown)};
  const std::vector<Vec3> colours[2] = {perceived(pictures[0], pixels_per_degree),
                                        perceived(pictures[1], pixels_per_degree)};
  const Features found[2] = {features(pictures[0], pixels_per_degree),
                             features(pictures[1], pixels_per_degree)};
  // Section 4.1: the largest distance is that of green and blue; up to 0.4 of it take 0.95.
  const double most = std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), 0.7);
  const double knee = 0.4 * most;
  double sum = 0.0;
  for (std::size_t i = 0; i < colours[0].size(); ++i) {
    const double distance = std::pow(hyab(colours[0][i], colours[1][i]), 0.7);
    const double colour =
        distance < knee ? 0.95 / knee * distance : 0.95 + 0.05 * (distance - knee) / (most - knee);
    const double difference = std::max(std::abs(found[0].edge[i] - found[1].edge[i]),
                                       std::abs(found[0].point[i] - found[1].point[i]));
    const double feature = std::min(std::sqrt(difference / std::numbers::sqrt2), 1.0);
    sum += std::pow(std::min(colour, 1.0), 1.0 - feature);
  }
  return colours[0].empty() ? 0.0 : sum / static_cast<double>(colours[0].size());
}

}  // namespace polyhull::synthetic
