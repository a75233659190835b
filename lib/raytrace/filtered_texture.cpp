// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/filtered_texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/srgb.h"

namespace polyhull {
namespace {

constexpr float most_samples = 16.0f;  // along the longer side of a footprint
constexpr float full = 65535.0f;

}  // namespace

FilteredTexture::FilteredTexture(const Picture& picture) {
  Level base{picture.width, picture.height, {}};
  base.texels.resize(static_cast<std::size_t>(base.width) * base.height, {});
  for (std::size_t i = 0; i < base.texels.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      base.texels[i][k] =
          static_cast<std::uint16_t>(std::lround(full * srgb_to_linear(picture.pixels[4 * i + k])));
    }
  }
  levels_.push_back(std::move(base));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse{std::max(fine.width / 2, 1), std::max(fine.height / 2, 1), {}};
    coarse.texels.resize(static_cast<std::size_t>(coarse.width) * coarse.height);
    for (int y = 0; y < coarse.height; ++y) {
      // An odd row or column at the end is left out, as graphics cards' makers do.
      const int y0 = std::min(2 * y, fine.height - 1), y1 = std::min(2 * y + 1, fine.height - 1);
      for (int x = 0; x < coarse.width; ++x) {
        const int x0 = std::min(2 * x, fine.width - 1), x1 = std::min(2 * x + 1, fine.width - 1);
        for (std::size_t k = 0; k < 3; ++k) {
          const auto at = [&](int column, int row) {
            return static_cast<unsigned>(
                fine.texels[static_cast<std::size_t>(row) * fine.width + column][k]);
          };
          coarse.texels[static_cast<std::size_t>(y) * coarse.width + x][k] =
              static_cast<std::uint16_t>((at(x0, y0) + at(x1, y0) + at(x0, y1) + at(x1, y1) + 2) /
                                         4);
        }
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

Float4 FilteredTexture::bilinear(std::size_t index, const Vec2f& uv) const {
  const Level& level = levels_[index];
  const auto place = [](float t, int size, int& first, int& second) {
    // Wrapped first: texture coordinates far out would lose their fraction. By way of int, as
    // std::floor is a call of a function on plain x86-64.
    t -= static_cast<float>(static_cast<int>(t));
    const float x = (t < 0.0f ? t + 1.0f : t) * static_cast<float>(size) + 0.5f;
    const int whole = static_cast<int>(x);
    first = whole == 0 ? size - 1 : whole - 1;
    second = whole >= size ? 0 : whole;
    return x - static_cast<float>(whole);
  };
  int x0, x1, y0, y1;
  const float fx = place(uv.x, level.width, x0, x1), fy = place(uv.y, level.height, y0, y1);
  const std::array<std::uint16_t, 4>* row0 =
      &level.texels[static_cast<std::size_t>(y0) * level.width];
  const std::array<std::uint16_t, 4>* row1 =
      &level.texels[static_cast<std::size_t>(y1) * level.width];
  const auto texel = [](const std::array<std::uint16_t, 4>& stored) {
    using Short4 = std::uint16_t __attribute__((vector_size(8)));
    Short4 bits;
    std::memcpy(&bits, stored.data(), sizeof bits);
    return __builtin_convertvector(bits, Float4);
  };
  const Float4 above = texel(row0[x0]) * (1.0f - fx) + texel(row0[x1]) * fx;
  const Float4 below = texel(row1[x0]) * (1.0f - fx) + texel(row1[x1]) * fx;
  return (above * (1.0f - fy) + below * fy) * (1.0f / full);
}

Float4 FilteredTexture::trilinear(float level, const Vec2f& uv) const {
  level = std::clamp(level, 0.0f, static_cast<float>(levels_.size() - 1));
  const auto lower = static_cast<std::size_t>(level);
  const float part = level - static_cast<float>(lower);
  if (part < 0.01f || lower + 1 >= levels_.size()) return bilinear(lower, uv);
  return bilinear(lower, uv) * (1.0f - part) + bilinear(lower + 1, uv) * part;
}

Vec3f FilteredTexture::over(const Vec2f& uv, const Vec2f& du, const Vec2f& dv) const {
  const Vec2f size(levels_[0].width, levels_[0].height);
  const float length_u = glm::length(du * size), length_v = glm::length(dv * size);
  const bool u_longer = length_u > length_v;
  const float longer = u_longer ? length_u : length_v;
  const float shorter = std::max(u_longer ? length_v : length_u, longer / most_samples);
  if (!(longer > 1.0f)) return at(uv);
  const float samples = std::ceil(std::min(longer / std::max(shorter, 1.0f), most_samples));
  const float level = std::log2(std::max(longer / samples, 1.0f));
  const Vec2f step = (u_longer ? du : dv) / samples;
  Float4 sum{};
  for (float i = 0.0f; i < samples; i += 1.0f)
    sum += trilinear(level, uv + (i + 0.5f - 0.5f * samples) * step);
  return to_vector(sum / samples);
}

}  // namespace polyhull
