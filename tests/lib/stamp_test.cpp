// SPDX-License-Identifier: LGPL-2.1-or-later
// The label that tells which instant a picture shows.
#include "builtin/stamp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace polyhull {
namespace {

struct Picture {
  Picture(int w, int h) : width(w), height(h), pixels(static_cast<std::size_t>(w) * h * 4) {
    for (std::size_t i = 0; i < pixels.size(); i += 4) {  // a green screen
      pixels[i] = 44;
      pixels[i + 1] = 168;
      pixels[i + 2] = 66;
      pixels[i + 3] = 255;
    }
  }
  std::ptrdiff_t stride() const { return 4 * static_cast<std::ptrdiff_t>(width); }
  int width, height;
  std::vector<std::uint8_t> pixels;
};

TEST(Stamp, IsReadAsItWasWritten) {
  for (const int height : {24, 90, 200, 700})
    for (const int number : {0, 1, 2, 255, 256, 4711, 65535}) {
      Picture picture(800, 720);
      draw_stamp(static_cast<std::uint16_t>(number), {301, 11, height / 2, height},
                 picture.pixels.data(), picture.stride(), picture.width, picture.height);
      const auto read = read_stamp(picture.pixels.data(), picture.stride(), 800, 720);
      ASSERT_TRUE(read) << height << " " << number;
      EXPECT_EQ(*read, number) << height;
    }
}

TEST(Stamp, SurvivesNoiseAndCropping) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 12.0);
  for (int number = 0; number < 200; ++number) {
    Picture picture(160, 120);
    draw_stamp(static_cast<std::uint16_t>(number * 331), {50, 10, 40, 100}, picture.pixels.data(),
               picture.stride(), 160, 120);
    for (std::uint8_t& value : picture.pixels)
      value = static_cast<std::uint8_t>(std::clamp(value + noise(random), 0.0, 255.0));
    // The subject's rectangle, as a view has it.
    const auto read = read_stamp(picture.pixels.data() + 10 * picture.stride() + 4 * 50,
                                 picture.stride(), 40, 100);
    ASSERT_TRUE(read) << number;
    EXPECT_EQ(*read, static_cast<std::uint16_t>(number * 331));
  }
}

TEST(Stamp, WhatIsNoLabelIsNotRead) {
  Picture picture(160, 120);
  EXPECT_FALSE(read_stamp(picture.pixels.data(), picture.stride(), 160, 120));
  draw_stamp(7, {0, 0, 10, 20}, picture.pixels.data(), picture.stride(), 160, 120);  // too small
  EXPECT_FALSE(read_stamp(picture.pixels.data(), picture.stride(), 160, 120));
  // Half outside the picture, and with a cell turned: refused, not misread.
  draw_stamp(7, {-40, 0, 80, 110}, picture.pixels.data(), picture.stride(), 160, 120);
  EXPECT_FALSE(read_stamp(picture.pixels.data(), picture.stride(), 160, 120));
  Picture other(160, 120);
  draw_stamp(7, {40, 0, 60, 110}, other.pixels.data(), other.stride(), 160, 120);
  int misread = 0;
  for (std::size_t i = 0; i < other.pixels.size(); i += 4) {
    if (other.pixels[i + 1] != 255) continue;  // a white pixel
    Picture damaged = other;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) {
        const std::size_t at = i + static_cast<std::size_t>(row) * 160 * 4 + 4 * column;
        if (at + 1 < damaged.pixels.size() && damaged.pixels[at] == damaged.pixels[at + 1])
          damaged.pixels[at] = damaged.pixels[at + 1] = damaged.pixels[at + 2] = 0;
      }
    const auto read = read_stamp(damaged.pixels.data(), damaged.stride(), 160, 120);
    misread += read && *read != 7;
  }
  EXPECT_EQ(misread, 0);
}

}  // namespace
}  // namespace polyhull
