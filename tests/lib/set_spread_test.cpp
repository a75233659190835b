// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/set_spread.h"

#include <gtest/gtest.h>

namespace polyhull {
namespace {

TEST(SetSpread, SmallestMedianLargest) {
  SetSpread spread;
  EXPECT_FALSE(spread.spread());
  spread.add({{"one", 5}});  // of one camera nothing can be said
  EXPECT_FALSE(spread.spread());
  for (const std::int64_t apart : {30, 10, 20, 90, 40})
    spread.add({{"one", 1000}, {"two", 1000 + apart / 2}, {"three", 1000 + apart}});
  EXPECT_EQ(spread.spread()->smallest, 10);
  EXPECT_EQ(spread.spread()->median, 30);
  EXPECT_EQ(spread.spread()->largest, 90);
}

TEST(SetSpread, AHundredSetsCount) {
  SetSpread spread;
  spread.add({{"one", 0}, {"two", 5000}, {"gone", 0}});
  for (int i = 0; i < 100; ++i) spread.add({{"one", i}, {"two", i + 7}});
  EXPECT_EQ(spread.spread()->largest, 7);
  EXPECT_EQ(spread.offsets().count("gone"), 0u);
}

TEST(SetSpread, OffsetsAreFromTheMiddleOfEachSet) {
  SetSpread spread;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t late = i % 10 == 0 ? 4000 : 300;  // now and then much later
    spread.add(
        {{"late", 40 * i + late}, {"two", 40 * i}, {"three", 40 * i}, {"early", 40 * i - 90}});
  }
  const auto offsets = spread.offsets();
  EXPECT_EQ(offsets.at("late"), 300);
  EXPECT_EQ(offsets.at("two"), 0);
  EXPECT_EQ(offsets.at("early"), -90);
  spread.reset();
  // Of two the later one is the middle.
  spread.add({{"one", 10}, {"two", 35}});
  EXPECT_EQ(spread.offsets().at("one"), -25);
  EXPECT_EQ(spread.offsets().at("two"), 0);
  spread.reset();
  EXPECT_TRUE(spread.offsets().empty());
}

}  // namespace
}  // namespace polyhull
