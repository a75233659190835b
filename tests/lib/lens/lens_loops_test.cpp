// SPDX-License-Identifier: LGPL-2.1-or-later
// The loops of the lens, one instruction set against the other: to the bit.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

#include "base/instruction_set.h"
#include "render/lens/loops/focus_loops.h"
#include "render/lens/loops/motion_loops.h"
#include "render/lens/loops/resample_loops.h"

#if defined(__x86_64__)
namespace polyhull::lens {
namespace {

constexpr int width = 70, height = 50, size = width * height;

std::vector<float> numbers(unsigned seed, float low, float high, int count = size) {
  std::mt19937 random(seed);
  std::vector<float> made;
  for (int i = 0; i < count; ++i)
    made.push_back(low + (high - low) * static_cast<float>(random() % 4096) / 4096.0f);
  return made;
}

template <typename Row>
void expect_same(const Row& baseline, const Row& avx2) {
  EXPECT_EQ(std::memcmp(&baseline, &avx2, sizeof baseline), 0);
}

TEST(LensLoopsTest, ResampledTheSame) {
  if (!may_use_avx2()) GTEST_SKIP();
  std::mt19937 random(1);
  std::vector<std::uint8_t> picture(4 * size), before;
  for (std::uint8_t& code : picture) code = static_cast<std::uint8_t>(random());
  before = picture;
  for (std::size_t i = 0; i < before.size(); i += 404) before[i] ^= 1;
  const PictureSource from{picture.data(), 4 * width, width, height};
  for (float x = -12.0f; x < width + 12.0f; x += 1.7f)
    for (const float y : {-5.0f, 3.3f, 20.8f, 48.9f, 1e9f}) {
      const PlaceRun run{{x, 7.9f, 0.1f, -0.05f}, {y, 0.4f, -0.2f, 0.1f}, 2, 6};
      std::uint8_t out[2][2][24] = {};
      int set = 0;
      for (const ResampleLoops* loops : {&ResampleLoops::baseline(), &ResampleLoops::avx2()}) {
        loops->resample(from, run, out[set][0]);
        loops->resample_changed(from, before.data(), run, out[set++][1]);
      }
      expect_same(out[0], out[1]);
    }
}

TEST(LensLoopsTest, FocusedTheSame) {
  if (!may_use_avx2()) GTEST_SKIP();
  const std::vector<float> drawn = numbers(2, 0.5f, 4.0f, 80), areas = numbers(3, 0.1f, 1.0f, 80);
  const DiskTables tables{drawn.data(), areas.data(), 16.0f, 4.0f};
  std::vector<float> light[4];
  for (unsigned c = 0; c < 4; ++c) light[c] = numbers(4 + c, 0.0f, 1.0f);
  for (float& coverage : light[3]) coverage = coverage < 0.6f ? 0.0f : coverage;
  std::vector<DiskOffset> offsets;
  for (int y = -3; y <= 3; ++y)
    for (int x = -3; x <= 3; ++x)
      offsets.push_back({y * width + x, static_cast<float>(x * x + y * y) / 4.0f, 1.0f});
  const int count = static_cast<int>(offsets.size());
  struct Made {
    float disks[3][size], even[3][focus_row], scene[3][focus_row], both[3][focus_row],
        body[4][focus_row], circle[focus_row];
  };
  std::vector<Made> made(2, Made{});
  Made* to = made.data();
  for (const FocusLoops* loops : {&FocusLoops::baseline(), &FocusLoops::avx2()}) {
    const std::vector<float> inverse = numbers(9, 0.0f, 1.0f);
    loops->disks(tables, 8.0f, 0.4f, inverse.data(), size - 3, to->disks[0], to->disks[1],
                 to->disks[2]);
    const int at = 10 * width + 20;
    const DiskPlanes planes{{&light[0][at], &light[1][at], &light[2][at], &light[3][at]},
                            to->disks[0] + at,
                            to->disks[1] + at,
                            to->disks[2] + at};
    loops->even(planes, offsets.data(), count, to->even);
    loops->subject(planes, offsets.data(), count, to->body, to->circle);
    loops->cover(planes, offsets.data(), count, planes.radius, planes.inverse_area, to->body);
    loops->scene(planes, offsets.data(), count, nullptr, nullptr, to->scene);
    loops->scene(planes, offsets.data(), count, to->body, to->circle, to->both);
    ++to;
  }
  expect_same(made[0], made[1]);
}

TEST(LensLoopsTest, MovedTheSame) {
  if (!may_use_avx2()) GTEST_SKIP();
  const MotionMap map{{{1.01f, 0.0f, -4.0f}, {0.0f, 1.02f, 2.0f}, {1e-4f, 0.0f, 1.0f}},
                      {6.0f, -3.0f, 0.1f},
                      0.5f,
                      20.0f};
  const std::vector<float> inverse = numbers(11, 0.1f, 0.9f);
  std::vector<float> light[4];
  for (unsigned c = 0; c < 4; ++c) light[c] = numbers(12 + c, 0.0f, 1.0f);
  struct Made {
    float x[size], y[size], light[3][3][height][width + motion_row][motion_row];
  };
  std::vector<Made> made(2, Made{});
  Made* to = made.data();
  for (const MotionLoops* loops : {&MotionLoops::baseline(), &MotionLoops::avx2()}) {
    for (int y = 0; y < height; ++y)
      loops->motions(map, 0, y, &inverse[static_cast<std::size_t>(y) * width], width,
                     to->x + y * width, to->y + y * width);
    const MovingLayer layer{{light[0].data(), light[1].data(), light[2].data(), light[3].data()},
                            inverse.data(),
                            to->x,
                            to->y,
                            width,
                            height};
    for (int y = 0; y < height; y += 3)
      for (int x = 0; x < width; x += motion_row)
        for (int way = 0; way < 3; ++way) {
          const MotionSpan span{x, y, 7, way == 2, way == 1, true, 0.9f, 0.1f};
          float row[3][motion_row];
          loops->blur(map, layer, way > 0 ? &layer : nullptr, span, row);
          for (int c = 0; c < 3; ++c) std::memcpy(to->light[way][c][y][x], row[c], sizeof row[c]);
        }
    ++to;
  }
  expect_same(made[0], made[1]);
}

}  // namespace
}  // namespace polyhull::lens
#endif
