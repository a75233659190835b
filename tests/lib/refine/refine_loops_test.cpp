// SPDX-License-Identifier: LGPL-2.1-or-later
// The refiner's inner loops: right, and the same bits for every instruction set.
#include "refine/loops/loops.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "base/instruction_set.h"
#include "refine/field/contact_rays.h"
#include "refine/field/hull_distance.h"

namespace polyhull::refine {
namespace {

class RefineLoops : public ::testing::Test {
 protected:
  float number(float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  }
  std::vector<float> numbers(std::size_t count, float low, float high) {
    std::vector<float> made(count);
    for (float& value : made) value = number(low, high);
    return made;
  }
  /// Each set of loops that this machine can run.
  std::vector<const Loops*> all() const {
    std::vector<const Loops*> sets{&Loops::baseline()};
#if defined(__x86_64__)
    if (has_avx2()) sets.push_back(&Loops::avx2());
#endif
    return sets;
  }
  /// A camera at (0, 0, -20) that looks along z, with a map of noise that shows a part of what is
  /// around the origin.
  ContactView view() {
    ContactView made;
    const float rows[3][4] = {{300, 20, 160, 3200}, {-15, 310, 120, 2400}, {0.1f, 0.05f, 1, 20}};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 4; ++k) made.pixel[i][k] = rows[i][k];
    made.focal = 300.0f;
    for (SilhouetteMap* map : {&made.coarse, &made.fine}) {
      map->left = 100.0f;
      map->top = 60.0f;
      map->texel = map == &made.coarse ? 4.0f : 1.5f;
      map->width = 60;
      map->height = 50;
      map->distance = numbers(60 * 50, -30.0f, 30.0f);
    }
    return made;
  }
  std::mt19937 random{5};
};

/// What \p run writes for each set of loops is the same.
template <typename Run>
void expect_same_bits(const std::vector<const Loops*>& sets, const Run& run) {
  const std::vector<float> first = run(*sets.front());
  for (const Loops* loops : sets)
    EXPECT_EQ(run(*loops), first) << (loops == &Loops::baseline() ? "baseline" : "avx2");
}

TEST_F(RefineLoops, ARowIsAsDeepInsideAsItsPoints) {
  HullDistance hull;
  for (int k = 0; k < 3; ++k) hull.views.push_back(view());
  hull.low = Vec3f(-9.0f);
  hull.high = Vec3f(9.0f);
  Grid grid{{-12.0f, -11.0f, -9.5f}, 0.5f, 48, 44, 40};
  for (int round = 0; round < 60; ++round) {
    // The rows behind the camera, too.
    if (round == 50) grid.low.z = -60.0f;
    const float y = number(0.0f, 43.0f), z = number(0.0f, 39.0f);
    const std::vector<float> x = numbers(1 + random() % 30, 0.0f, 47.0f);
    std::vector<float> rough(x.size()), exact(x.size());
    HullRows(hull, HullRows::By::rough).find(grid, y, z, x, rough.data());
    HullRows(hull, HullRows::By::exact).find(grid, y, z, x, exact.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Vec3f at = grid.low + grid.cell * Vec3f(x[i], y, z);
      EXPECT_NEAR(rough[i], hull.rough(at, -1e9f), 1e-3f);
      EXPECT_NEAR(exact[i], hull.exact(at, -1e9f), 1e-3f);
    }
  }
}

TEST_F(RefineLoops, AViewWithoutAnOutlineIsBeyond) {
  HullDistance hull;
  hull.views.push_back(view());
  hull.views[0].coarse = {};
  const Grid grid{{-1.0f, -1.0f, -1.0f}, 0.5f, 8, 4, 4};
  const std::vector<float> x{0.0f, 3.0f, 7.0f};
  std::vector<float> rough(x.size());
  HullRows(hull, HullRows::By::rough).find(grid, 1.0f, 1.0f, x, rough.data());
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_NEAR(rough[i], hull.rough(grid.position(static_cast<int>(x[i]), 1, 1), -1e9f), 1e-4f);
}

TEST_F(RefineLoops, InsideGivesTheSameBits) {
  const ContactView from = view();
  for (int round = 0; round < 50; ++round) {
    const std::vector<float> x = numbers(1 + random() % 50, 0.0f, 60.0f);
    const RowPoints points{{number(-15, 0), number(-8, 8), number(-30, 8)},
                           0.4f,
                           x.data(),
                           static_cast<int>(x.size())};
    const std::vector<float> before = numbers(x.size(), -1.0f, 9.0f);
    expect_same_bits(all(), [&](const Loops& loops) {
      std::vector<float> out = before;
      loops.inside(from.look(from.fine), points, out.data());
      return out;
    });
  }
}

TEST_F(RefineLoops, AlongALineAsSampled) {
  const Grid grid{{-3.0f, -2.0f, -1.0f}, 0.5f, 16, 9, 7};
  const std::vector<float> values = numbers(grid.size(), -2.0f, 2.0f);
  for (int round = 0; round < 60; ++round) {
    const Vec3f begin(number(-4, 6), number(-3, 3), number(-2, 3));
    const Vec3f way(number(-0.3f, 0.3f), number(-0.3f, 0.3f), number(-0.3f, 0.3f));
    const Vec3f at = (begin - grid.low) / grid.cell, step = way / grid.cell;
    const GridLine line{
        values.data(),           grid.nx, grid.ny, grid.nz, outside, {at.x, at.y, at.z},
        {step.x, step.y, step.z}};
    const int count = 1 + static_cast<int>(random() % 32);
    const auto run = [&](const Loops& loops) {
      std::vector<float> out(static_cast<std::size_t>(count));
      loops.along(line, count, out.data());
      return out;
    };
    expect_same_bits(all(), run);
    const std::vector<float> out = run(Loops::best());
    for (int i = 0; i < count; ++i)
      EXPECT_NEAR(out[static_cast<std::size_t>(i)],
                  sample(grid, values.data(), begin + static_cast<float>(i) * way), 2e-5f);
  }
}

TEST_F(RefineLoops, ARowOfAnotherGridAsSampled) {
  const Grid grid{{-3.0f, -2.0f, -1.0f}, 0.5f, 16, 9, 7};
  const std::vector<float> values = numbers(grid.size(), -2.0f, 2.0f);
  const Grid other{{-3.6f, -2.4f, -1.3f}, 0.31f, 32, 17, 13};  // a little beyond on each side
  std::vector<float> mixed, out(other.row());
  int within = 0;
  for (int z = 0; z < other.nz; ++z)
    for (int y = 0; y < other.ny; ++y) {
      sample_row(grid, values.data(), other, y, z, {0, other.nx}, mixed, out.data());
      for (int x = 0; x < other.nx; ++x) {
        const float expected = sample(grid, values.data(), other.position(x, y, z));
        EXPECT_NEAR(out[static_cast<std::size_t>(x)], expected, 2e-5f);
        within += expected != outside;
      }
    }
  EXPECT_GT(within, 1000);
}

TEST_F(RefineLoops, RimsAskNodesByTheFormula) {
  constexpr int nx = 16, ny = 9, nz = 3;
  const std::vector<float> f = numbers(nx * ny * nz, -2.0f, 2.0f);
  for (int round = 0; round < 200; ++round) {
    std::vector<Extent> rows(ny);
    for (Extent& row : rows) {
      row.begin = static_cast<int>(random() % nx);
      row.end = row.begin + static_cast<int>(random() % static_cast<unsigned>(nx + 1 - row.begin));
    }
    const Vec3f normal = glm::normalize(Vec3f(number(-1, 1), number(-1, 1), number(-1, 1)));
    const AskingRim rim{{number(-1, nx), number(-1, ny), number(-1, 3)},
                        {normal.x, normal.y, normal.z},
                        number(-1, 1),
                        number(0.8f, 6.0f),
                        0.2f};
    const auto run = [&](const Loops& loops) {
      std::vector<float> asks(2 * nx * ny), out(2 * nx * ny);
      std::vector<Extent> asked(ny);
      loops.ask(rim, {f.data() + nx * ny, rows.data(), nx, ny, 1.0f, asked.data(), asks.data()});
      for (std::size_t i = 0; i < nx * ny; ++i) {
        out[i] = asks[i / 8 * 16 + i % 8];
        out[nx * ny + i] = asks[i / 8 * 16 + 8 + i % 8];
      }
      for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x)
          EXPECT_TRUE(out[nx * ny + y * nx + x] == 0.0f ||
                      (x >= asked[y].begin && x < asked[y].end));
      return out;
    };
    expect_same_bits(all(), run);
    const std::vector<float> out = run(Loops::best());
    for (int y = 1; y < ny - 1; ++y)
      for (int x = 1; x < nx - 1; ++x) {
        const Vec3f away = Vec3f(x, y, 1) - Vec3f(rim.at[0], rim.at[1], rim.at[2]);
        const float share = 1.0f - glm::dot(away, away) / (rim.reach * rim.reach);
        const float* p = f.data() + nx * ny + y * nx + x;
        const Vec3f up(p[1] - p[-1], p[nx] - p[-nx], p[nx * ny] - p[-nx * ny]);
        const float along = -glm::dot(glm::normalize(up), normal);
        const bool asked = x >= rows[y].begin && x < rows[y].end && share > 0.0f && along > 0.2f;
        const float weight = asked ? along * share * share : 0.0f;
        if (std::abs(along - 0.2f) < 1e-4f) continue;
        EXPECT_NEAR(out[nx * ny + y * nx + x], weight, 1e-5f);
        EXPECT_NEAR(out[y * nx + x], weight * rim.gap, 1e-5f);
      }
  }
}

TEST_F(RefineLoops, SignsAreOneWhereAbove) {
  for (const int count : {8, 64, 72, 104, 176}) {
    std::vector<float> f = numbers(static_cast<std::size_t>(count), -1.0f, 1.0f);
    f[3] = 0.0f, f[5] = 0.25f;
    for (const float above : {0.0f, 0.25f})
      for (const Loops* loops : all()) {
        std::vector<std::uint64_t> words(static_cast<std::size_t>(count + 63) / 64);
        loops->signs(f.data(), above, count, words.data());
        for (int i = 0; i < 64 * static_cast<int>(words.size()); ++i)
          EXPECT_EQ(words[static_cast<std::size_t>(i / 64)] >> i % 64 & 1,
                    i < count && f[static_cast<std::size_t>(i)] > above)
              << (loops == &Loops::baseline() ? "baseline " : "avx2 ") << i;
      }
  }
}

/// A row of 16 nodes in the middle of a grid of 5 x 5 of them, with room at both ends.
struct PlateScene {
  static constexpr int nx = 16, slab = 5 * nx, room = 8;
  static constexpr std::size_t size = 5 * slab + 2 * room, row = room + 2 * slab + 2 * nx;
  std::vector<float> f, laplacian, mask, more, solution, residual;
  PlateRow at() const { return {nx, nx, slab, mask.data() + row}; }
};

TEST_F(RefineLoops, ThePlatesStepsAreTheFormulas) {
  PlateScene scene;
  for (auto* v : {&scene.f, &scene.laplacian, &scene.more, &scene.solution, &scene.residual})
    *v = numbers(PlateScene::size, -1.0f, 1.0f);
  scene.mask.assign(PlateScene::size, 1.0f);
  scene.mask[PlateScene::row + 5] = scene.mask[PlateScene::row + 14] = 0.0f;
  const float tie = 0.03f, length = 0.7f;
  const auto at = [](const std::vector<float>& v, std::size_t n) {
    const std::size_t row = PlateScene::nx, slab = PlateScene::slab;
    return v[n - 1] + v[n + 1] + v[n - row] + v[n + row] + v[n - slab] + v[n + slab] - 6.0f * v[n];
  };
  const auto run = [&](const Loops& loops) {
    PlateScene made = scene;
    std::vector<float> sums(16), out(PlateScene::nx);
    loops.laplacian(made.at(), made.f.data() + PlateScene::row, tie, out.data(), sums.data());
    loops.step(made.at(), made.f.data() + PlateScene::row, made.laplacian.data() + PlateScene::row,
               tie, length, made.more.data() + PlateScene::row,
               made.solution.data() + PlateScene::row, made.residual.data() + PlateScene::row,
               sums.data() + 8);
    loops.turn(PlateScene::nx, made.residual.data() + PlateScene::row, 0.4f,
               made.f.data() + PlateScene::row);
    for (const auto* v : {&made.f, &made.more, &made.solution, &made.residual, &sums})
      out.insert(out.end(), v->begin(), v->end());
    return out;
  };
  expect_same_bits(all(), run);
  const std::vector<float> out = run(Loops::best());
  const float* more = out.data() + PlateScene::nx + PlateScene::size;
  const float* solution = more + PlateScene::size;
  const float* residual = solution + PlateScene::size;
  const float* sums = residual + PlateScene::size;
  float bent = 0.0f, left = 0.0f;
  for (std::size_t i = 0; i < PlateScene::nx; ++i) {
    const std::size_t n = PlateScene::row + i;
    const float value = scene.mask[n] * at(scene.f, n);
    EXPECT_NEAR(out[i], value, 1e-5f);
    bent += value * value + tie * scene.f[n] * scene.f[n];
    EXPECT_EQ(more[n], 0.0f);
    EXPECT_NEAR(solution[n], scene.solution[n] + length * scene.f[n], 1e-6f);
    const float image = scene.mask[n] * (at(scene.laplacian, n) + tie * scene.f[n] + scene.more[n]);
    EXPECT_NEAR(residual[n], scene.residual[n] - length * image, 1e-5f);
    left += residual[n] * residual[n];
    EXPECT_NEAR(out[PlateScene::nx + n], residual[n] + 0.4f * scene.f[n], 1e-6f);
  }
  float sum[2] = {};
  for (int k = 0; k < 16; ++k) sum[k / 8] += sums[k];
  EXPECT_NEAR(sum[0], bent, 1e-4f * bent);
  EXPECT_NEAR(sum[1], left, 1e-4f * left);
}

/// Against the energy's differences: it is a quadratic form, so that those are exact.
TEST_F(RefineLoops, RimsAskForTheirEnergysGradient) {
  constexpr std::int32_t row = 4, slab = 16;
  const std::vector<float> f = numbers(64, -1.0f, 1.0f), before = numbers(64, -1.0f, 1.0f);
  const std::vector<std::int32_t> node{0, 42, 21, 21, 22, 37, 1, 0};
  const auto x = numbers(8, 0.0f, 1.0f), y = numbers(8, 0.0f, 1.0f), z = numbers(8, 0.0f, 1.0f);
  const PlateRims rims{node.data(), x.data(), y.data(), z.data(), 8, row, slab, 3.0f, 0.7f};
  const auto run = [&](const Loops& loops) {
    std::vector<float> out = before, sums(8);
    loops.rims(rims, f.data(), out.data(), sums.data());
    out.insert(out.end(), sums.begin(), sums.end());
    return out;
  };
  expect_same_bits(all(), run);
  const auto energy = [&](std::size_t moved, double by) {
    double sum = 0.0;
    for (std::size_t r = 0; r < 8; ++r) {
      double value = 0.0;
      Vec3 up(0.0);
      for (std::size_t k = 0; k < 8; ++k) {
        const std::size_t n = node[r] + (k & 1) + (k & 2 ? row : 0) + (k & 4 ? slab : 0);
        const Vec3 high(k & 1, k >> 1 & 1, k >> 2), at(x[r], y[r], z[r]);
        const Vec3 share = high * at + (1.0 - high) * (1.0 - at), sign = 2.0 * high - 1.0;
        const double here = double{f[n]} + (n == moved ? by : 0.0);
        value += here * share.x * share.y * share.z;
        up += here * sign * Vec3(share.y * share.z, share.x * share.z, share.x * share.y);
      }
      sum += 3.0 * value * value + 0.7 * glm::dot(up, up);
    }
    return sum;
  };
  const std::vector<float> out = run(Loops::best());
  for (std::size_t n = 0; n < f.size(); ++n)
    EXPECT_NEAR(out[n] - before[n], 0.25 * (energy(n, 1.0) - energy(n, -1.0)), 1e-4);
  double left = energy(0, 0.0);
  for (std::size_t k = 0; k < 8; ++k) left -= double{out[64 + k]};
  EXPECT_NEAR(left, 0.0, 1e-4);
}

}  // namespace
}  // namespace polyhull::refine
