// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Environment pictures for tests, and .hdr files of them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "environment/radiance_picture.h"

namespace polyhull::test {

/// A picture \p height rows high of \p colour alone.
inline RadiancePicture even_environment(const Vec3f& colour, int height = 32) {
  return {2 * height, height,
          std::vector<Vec3f>(static_cast<std::size_t>(2 * height * height), colour)};
}

/// A blue sky over a brown ground, with a bright window and a sun of one pixel.
inline RadiancePicture outdoors(int height = 64) {
  RadiancePicture out = even_environment(Vec3f(0.0f), height);
  const auto pixel = [&](int x, int y) -> Vec3f& {
    return out.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) +
                      static_cast<std::size_t>(x)];
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const float up = 1.0f - 2.0f * (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
      pixel(x, y) = up > 0.0f ? glm::mix(Vec3f(0.9f, 0.95f, 1.0f), Vec3f(0.2f, 0.4f, 1.0f), up)
                              : Vec3f(0.3f, 0.2f, 0.1f);
    }
  for (int y = height / 4; y < height / 3; ++y)
    for (int x = height / 8; x < height / 4; ++x) pixel(x, y) = Vec3f(6.0f, 5.0f, 4.0f);
  const double solid_angle =
      19.74 / (2.0 * height * height) * std::cos(0.8);  // of the pixel, about
  pixel(height + height / 5, height / 4) =
      Vec3f(4.0f, 3.6f, 3.0f) / static_cast<float>(solid_angle);
  return out;
}

inline std::array<std::uint8_t, 4> to_rgbe(const Vec3f& value) {
  const float most = std::max({value.x, value.y, value.z});
  if (most < 1e-30f) return {};
  int exponent = 0;
  std::frexp(most, &exponent);
  const Vec3f scaled = value * std::ldexp(1.0f, 8 - exponent);
  const auto byte = [](float v) { return static_cast<std::uint8_t>(std::min(v, 255.0f)); };
  return {byte(scaled.x), byte(scaled.y), byte(scaled.z),
          static_cast<std::uint8_t>(exponent + 128)};
}

/// The bytes of a .hdr file; \p packed: by runs.
inline std::string hdr_bytes(const RadiancePicture& picture, bool packed = true) {
  std::string out = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(picture.height) +
                    " +X " + std::to_string(picture.width) + "\n";
  const auto put = [&](int byte) { out.push_back(static_cast<char>(byte)); };
  const auto width = static_cast<std::size_t>(picture.width);
  for (int y = 0; y < picture.height; ++y) {
    std::vector<std::array<std::uint8_t, 4>> row;
    for (std::size_t x = 0; x < width; ++x)
      row.push_back(to_rgbe(picture.pixels[static_cast<std::size_t>(y) * width + x]));
    if (!packed) {
      for (const auto& pixel : row)
        for (const int byte : pixel) put(byte);
      continue;
    }
    for (const int byte : {2, 2, picture.width >> 8, picture.width & 255}) put(byte);
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t x = 0; x < width;) {
        std::size_t same = 1;
        while (x + same < width && same < 127 && row[x + same][k] == row[x][k]) ++same;
        put(same > 1 ? static_cast<int>(128 + same) : 1);
        put(row[x][k]);
        x += same;
      }
  }
  return out;
}

inline std::string write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

}  // namespace polyhull::test
