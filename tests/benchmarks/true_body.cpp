// SPDX-License-Identifier: LGPL-2.1-or-later
#include "true_body.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "base/error.h"

namespace polyhull::test {

TriangleSurface load_surface(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw Error(Error::Kind::not_found, "{}: cannot open the body.", path);
  TriangleSurface surface;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Vec3 v;
      words >> v.x >> v.y >> v.z;
      surface.vertices.push_back(v);
    } else if (kind == "f") {
      std::vector<std::uint32_t> corners;
      for (std::string word; words >> word;) corners.push_back(std::uint32_t(std::stoul(word)) - 1);
      for (std::size_t k = 2; k < corners.size(); ++k) {
        surface.triangles.push_back({corners[0], corners[k - 1], corners[k]});
      }
    }
  }
  return surface;
}

Picture mask_of(const TriangleSurface& surface, const Camera& camera, int samples) {
  const int width = camera.width * samples, height = camera.height * samples;
  std::vector<std::uint8_t> fine(static_cast<std::size_t>(width) * height, 0);
  std::vector<Vec2> pixels;
  for (const Vec3& v : surface.vertices) {
    const auto p = camera.project_ideal(v);
    // Sample (i, j) of a pixel lies at (i + 1/2) / samples - 1/2 from its centre.
    pixels.push_back(p ? (*p + 0.5) * double(samples) - 0.5 : Vec2(NAN));
  }
  for (const auto& t : surface.triangles) {
    Vec2 a = pixels[t[0]], b = pixels[t[1]], c = pixels[t[2]];
    if (!(std::isfinite(a.x + b.x + c.x))) continue;
    if ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) < 0) std::swap(b, c);
    const int top = std::max(0, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}))));
    const int bottom =
        std::min(height - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}))));
    for (int y = top; y <= bottom; ++y) {
      double left = -1e30, right = 1e30;
      const auto clip = [&](Vec2 p, Vec2 q) {  // inside where the cross product is not negative
        const double slope = -(q.y - p.y), rest = (q.x - p.x) * (y - p.y) + (q.y - p.y) * p.x;
        if (slope > 0) left = std::max(left, -rest / slope);
        if (slope < 0) right = std::min(right, -rest / slope);
        if (slope == 0 && rest < 0) right = -1e30;
      };
      clip(a, b);
      clip(b, c);
      clip(c, a);
      const int first = std::max(0, static_cast<int>(std::ceil(std::max(left, -1.0))));
      const int last = std::min(width - 1, static_cast<int>(std::floor(std::min(right, 1e6))));
      if (first <= last) {
        std::fill_n(&fine[static_cast<std::size_t>(y) * width + first], last - first + 1,
                    std::uint8_t{1});
      }
    }
  }
  Picture picture{camera.width, camera.height, 1, {}};
  picture.pixels.resize(static_cast<std::size_t>(camera.width) * camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      int sum = 0;
      for (int j = 0; j < samples; ++j) {
        const std::uint8_t* row =
            &fine[static_cast<std::size_t>(y * samples + j) * width + x * samples];
        for (int i = 0; i < samples; ++i) sum += row[i];
      }
      picture.row(y)[x] = static_cast<std::uint8_t>(sum * 255 / (samples * samples));
    }
  }
  return picture;
}

double intersection_over_union(const Picture& a, const Picture& b) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const bool in_a = a.pixels[i] > 127, in_b = b.pixels[i] > 127;
    both += in_a && in_b;
    either += in_a || in_b;
  }
  return either ? double(both) / double(either) : 1.0;
}

}  // namespace polyhull::test
