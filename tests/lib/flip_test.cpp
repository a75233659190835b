// SPDX-License-Identifier: LGPL-2.1-or-later
// FLIP's ends, and that it sees what eyes see.
#include "flip.h"

#include <gtest/gtest.h>

namespace polyhull::synthetic {
namespace {

Picture even(int red, int green, int blue) {
  Picture out{64, 48, 3, {}};
  for (int i = 0; i < 64 * 48; ++i)
    for (const int value : {red, green, blue})
      out.pixels.push_back(static_cast<std::uint8_t>(value));
  return out;
}

/// Every second pixel of every second row is \p value.
Picture dotted(int value) {
  Picture out = even(128, 128, 128);
  for (int y = 0; y < 48; y += 2)
    for (int x = 0; x < 64; x += 2)
      for (int c = 0; c < 3; ++c) out.row(y)[3 * x + c] = static_cast<std::uint8_t>(value);
  return out;
}

TEST(Flip, RunsFromNothingToAll) {
  EXPECT_EQ(mean_flip(even(90, 40, 200), even(90, 40, 200)), 0.0);
  EXPECT_NEAR(mean_flip(even(0, 255, 0), even(0, 0, 255)), 1.0, 1e-6);
  EXPECT_NEAR(mean_flip(even(0, 0, 255), even(0, 255, 0)), 1.0, 1e-6);
}

TEST(Flip, GrowsWithTheDifferenceAndWithItsSize) {
  const Picture grey = even(128, 128, 128);
  const double small = mean_flip(grey, even(136, 136, 136));
  const double large = mean_flip(grey, even(160, 160, 160));
  EXPECT_GT(small, 0.03);
  EXPECT_GT(large, 1.5 * small);
  // Dots too fine to be told apart are a quarter of their difference, and less than all of it.
  const double dots = mean_flip(grey, dotted(160));
  EXPECT_GT(dots, small);
  EXPECT_LT(dots, 0.8 * large);
  // An edge counts more than an even difference.
  Picture edge = even(128, 128, 128);
  for (int y = 0; y < 48; ++y)
    for (int i = 3 * 32; i < 3 * 64; ++i) edge.row(y)[i] = 160;
  EXPECT_GT(mean_flip(grey, edge), 0.5 * large);
}

}  // namespace
}  // namespace polyhull::synthetic
