// SPDX-License-Identifier: LGPL-2.1-or-later
// Where a matte's edge is near, and what follows for the removal of spill.
#include "silhouette/key/edge_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "key_checks.h"
#include "silhouette/key/key_signal.h"

namespace polyhull {
namespace {

using test::Colour;
using test::matte_of;
using test::mix;
using test::rgb;

silhouette::EdgeMap map_of(const Matte& matte) {
  silhouette::EdgeMap map;
  map.begin(matte.width, matte.height);
  for (int y = 0; y < matte.height; ++y) map.add_row(y, matte.row(y), matte.state_row(y));
  return map;
}

/// The weights, by the definition.
class Definition {
 public:
  Definition(const Matte& matte, int cell)
      : cell_(cell), across_((matte.width - 1) / cell + 1), down_((matte.height - 1) / cell + 1) {
    for (int j = 0; j < down_; ++j)
      for (int i = 0; i < across_; ++i) {
        double sum = 0.0, count = 0.0;
        for (int v = j * cell; v < std::min((j + 1) * cell, matte.height); ++v)
          for (int u = i * cell; u < std::min((i + 1) * cell, matte.width); ++u)
            sum += 1.0 - std::min<int>(matte.row(v)[u], 192) / 192.0, count += 1.0;
        open_.push_back(sum / count);
      }
  }
  double weight(int x, int y) const {
    const double u = (x + 0.5) / cell_ - 0.5, v = (y + 0.5) / cell_ - 0.5;
    const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
    const double fu = u - i, fv = v - j;
    const double mean = (1 - fv) * ((1 - fu) * smooth(i, j) + fu * smooth(i + 1, j)) +
                        fv * ((1 - fu) * smooth(i, j + 1) + fu * smooth(i + 1, j + 1));
    return std::min(8.0 * mean, 1.0);
  }

 private:
  double open(int i, int j) const {
    return open_[static_cast<std::size_t>(std::clamp(j, 0, down_ - 1) * across_ +
                                          std::clamp(i, 0, across_ - 1))];
  }
  double smooth(int i, int j) const {
    i = std::clamp(i, 0, across_ - 1), j = std::clamp(j, 0, down_ - 1);
    double sum = 0.0;
    for (int v = -1; v <= 1; ++v)
      for (int u = -1; u <= 1; ++u)
        sum += (2 - std::abs(u)) * (2 - std::abs(v)) * open(i + u, j + v);
    return sum / 16.0;
  }

  int cell_, across_, down_;
  std::vector<double> open_;
};

TEST(EdgeMap, FollowsItsDefinition) {
  std::mt19937 random(7);
  for (const auto& [width, height, cell] :
       {std::tuple{1, 1, 2}, {16, 9, 2}, {77, 53, 2}, {45, 361, 4}, {45, 721, 8}, {35, 1443, 16}}) {
    const Matte matte = matte_of(width, height, [&](int x, int y) {
      return x > 20 && y > 13 && y < 36 ? 255 : x < 8 ? 0 : static_cast<int>(random() % 256);
    });
    const silhouette::EdgeMap map = map_of(matte);
    const Definition definition(matte, cell);
    for (int y = 0; y < height; ++y) {
      std::vector<std::int16_t> whole(static_cast<std::size_t>(width));
      map.weigh_row(y, 0, width, whole.data());
      for (int x = 0; x < width; ++x)
        ASSERT_NEAR(whole[x] / 32768.0, definition.weight(x, y), 1e-3) << x << "," << y;
      for (int x0 = 0; x0 < width; x0 += 5) {
        std::vector<std::int16_t> part(static_cast<std::size_t>(width - x0));
        map.weigh_row(y, x0, width, part.data());
        ASSERT_TRUE(std::equal(part.begin(), part.end(), whole.begin() + x0)) << x0 << "," << y;
      }
    }
  }
}

TEST(EdgeMap, IsFullUpToACellInsideAnEdgeAndNothingFarther) {
  for (int offset = 0; offset < 4; ++offset) {
    const silhouette::EdgeMap map =
        map_of(matte_of(120, 400, [&](int x, int) { return x < 60 + offset ? 0 : 255; }));
    std::int16_t weights[120];
    map.weigh_row(200, 0, 120, weights);
    for (int x = 0; x < 120; ++x) {
      const int inside = x - (60 + offset);
      EXPECT_TRUE(inside >= 4 || weights[x] >= 32000) << offset << " " << x;
      EXPECT_TRUE(inside < 10 || weights[x] == 0) << offset << " " << x;
    }
  }
}

/// A disk of \p subject before \p screen with a soft edge, keyed and written with all spill removed.
struct Written {
  std::vector<std::uint8_t> pixels;
  static constexpr int size = 200, centre = 100, radius = 60;

  Written(const Colour& subject, const Colour& screen, FrameFormat format) {
    const test::Frame frame = test::make_frame(format, size, size, [&](int x, int y) {
      return mix(screen, subject,
                 std::clamp((radius + 1.5 - std::hypot(x - centre, y - centre)) / 3.0, 0.0, 1.0));
    });
    KeySettings settings;
    settings.key = KeyColour::automatic;
    settings.screen = rgb(screen);
    settings.foreground = rgb(subject);
    Keyer keyer;
    keyer.set(settings);
    Matte matte;
    keyer.key(frame.view, matte);
    pixels.resize(4 * size * size);
    keyer.write_rgba(frame.view, matte, {0, 0, size, size}, KeyView::composite, pixels.data(),
                     4 * size);
  }
  const std::uint8_t* at(int x, int y) const { return &pixels[4 * (size * y + x)]; }
};

TEST(Spill, AFaceBeforeAYellowScreenKeepsItsColourAndHasNoYellowRim) {
  const Colour face{153, 115, 71}, screen{177, 177, 8};
  const silhouette::KeySignal signal =
      silhouette::key_signal(KeyColour::custom, rgb(screen), 1.0, 1.0);
  for (const FrameFormat format : {FrameFormat::rgbx, FrameFormat::nv12, FrameFormat::i420_10le}) {
    const Written written(face, screen, format);
    for (int y = 0; y < Written::size; ++y)
      for (int x = 0; x < Written::size; ++x) {
        const std::uint8_t* p = written.at(x, y);
        const double distance = std::hypot(x - Written::centre, y - Written::centre);
        if (distance < Written::radius - 12) {
          // A tenth of the screen's signal is 17 levels.
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(p[c], face[c], 14.0) << name_of(format) << " " << x << "," << y;
          ASSERT_GT(signal.of(p[0], p[1], p[2]), 0.5 * signal.of(face[0], face[1], face[2]));
        } else if (distance > Written::radius - 1) {
          ASSERT_LT(signal.of(p[0], p[1], p[2]), 3.0) << name_of(format) << " " << x << "," << y;
        }
      }
  }
}

TEST(Spill, AGreenCastIsTakenFromAllOfTheSubject) {
  const Colour cast{150, 160, 148}, screen{60, 190, 70};
  const Written written(cast, screen, FrameFormat::bgrx);
  for (int y = 0; y < Written::size; ++y)
    for (int x = 0; x < Written::size; ++x) {
      const std::uint8_t* p = written.at(x, y);
      ASSERT_LE(p[1], std::max(p[0], p[2]) + 2) << x << "," << y;
    }
}

}  // namespace
}  // namespace polyhull
