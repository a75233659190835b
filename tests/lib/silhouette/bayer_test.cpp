// SPDX-License-Identifier: LGPL-2.1-or-later
// A colour sensor's mosaic: each order and depth against a demosaicing in doubles, and what a matte
// keyed from it loses against one of the whole picture.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "silhouette/key/key.h"
#include "silhouette/pixels/colour_kernels.h"
#include "silhouette/silhouette.h"
#include "silhouette_frames.h"

using namespace polyhull;

namespace {

constexpr std::array formats = {FrameFormat::bayer8, FrameFormat::bayer10le,
                                FrameFormat::bayer12le};
constexpr std::array orders = {BayerOrder::bggr, BayerOrder::gbrg, BayerOrder::grbg,
                               BayerOrder::rggb};

int reflected(int i, int n) {
  if (n == 1) return 0;
  if (i < 0) return -i;
  return i < n ? i : 2 * n - 2 - i;
}

/// In levels: the mean of the nearest samples of the channel, of the 3 x 3 pixels around.
double reference(const FrameView& f, int x, int y, int channel) {
  const auto sample = [&](int u, int v) {
    const std::uint8_t* row = f.row(0, v);
    if (f.format == FrameFormat::bayer8) return static_cast<double>(row[u]);
    return std::ldexp(row[2 * u] + 256.0 * row[2 * u + 1], 8 - bayer_bits(f.format));
  };
  for (int ring = 0; ring <= 2; ++ring) {
    double sum = 0.0;
    int count = 0;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        if (std::abs(dx) + std::abs(dy) != ring) continue;
        const int u = reflected(x + dx, f.width), v = reflected(y + dy, f.height);
        if (test::mosaic_channel(f.bayer, x + dx + 2, y + dy + 2) != channel) continue;
        sum += sample(u, v);
        ++count;
      }
    if (count > 0) return sum / count;
  }
  return -1.0;
}

test::Frame random_frame(FrameFormat format, BayerOrder order, int width, int height) {
  std::mt19937 random(static_cast<unsigned>(width * 100 + height));
  std::uniform_real_distribution<double> level(0.0, 255.9);
  return test::make_frame(
      format, width, height,
      [&](int, int) {
        return test::Colour{level(random), level(random), level(random)};
      },
      ColourMatrix::bt601, false, 6, order);
}

/// Where the matte crosses one half along each row, against the edge's place; mean and largest
/// distance, px.
struct EdgeError {
  double mean = 0.0, largest = 0.0;
};

/// A disk of a subject's colour before a green screen, mixed by the area that it covers.
constexpr double disk_x = 159.3, disk_y = 119.6, disk_radius = 80.4;

test::Colour disk_colour(int x, int y) {
  const double distance = std::hypot(x - disk_x, y - disk_y) - disk_radius;
  const double share = std::clamp(0.5 - distance / 1.6, 0.0, 1.0);  // a lens's blur
  const test::Colour subject{170, 110, 90}, screen{40, 170, 60};
  test::Colour mixed;
  for (std::size_t c = 0; c < 3; ++c) mixed[c] = share * subject[c] + (1.0 - share) * screen[c];
  return mixed;
}

EdgeError contour_error(const FrameView& frame) {
  Silhouetter silhouetter;
  SilhouetteSettings settings;
  settings.blur.sigma = 0.0;
  settings.approximate.tolerance = 0.0;
  silhouetter.set(settings);
  EdgeError error;
  int count = 0;
  for (const Vec2f& point : silhouetter.process(frame).points) {
    const double distance = std::abs(std::hypot(point.x - disk_x, point.y - disk_y) - disk_radius);
    error.mean += distance;
    error.largest = std::max(error.largest, distance);
    ++count;
  }
  EXPECT_GT(count, 100);
  error.mean /= std::max(count, 1);
  return error;
}

}  // namespace

TEST(Bayer, EveryOrderAndDepthWithinALevelOfTheMeanOfNeighbours) {
  for (const FrameFormat format : formats)
    for (const BayerOrder order : orders)
      for (const auto& [width, height] : {std::pair{640, 5}, std::pair{37, 11}, std::pair{2, 2},
                                          std::pair{3, 1}, std::pair{1, 3}}) {
        const test::Frame frame = random_frame(format, order, width, height);
        std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width) * 4);
        for (int y = 0; y < height; ++y) {
          convert_row(frame.view, y, 0, width, rgba.data());
          for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) {
              const double expected = reference(frame.view, x, y, c);
              if (expected < 0.0) continue;  // a frame too small to have the colour beside it
              const int found = rgba[static_cast<std::size_t>(4 * x + c)];
              ASSERT_LE(std::abs(found - std::min(expected, 255.0)), 0.5 + 1e-9)
                  << name_of(format) << " " << static_cast<int>(order) << " " << x << "," << y;
            }
        }
      }
}

TEST(Bayer, PartsOfARowAndInstructionSetsGiveTheSameBytes) {
  for (const FrameFormat format : formats) {
    const test::Frame frame = random_frame(format, BayerOrder::gbrg, 701, 4);
    for (int y = 0; y < 4; ++y) {
      std::vector<std::uint8_t> whole(701 * 4), part(701 * 4);
      silhouette::ColourKernels::baseline().convert_bayer(frame.view, y, 0, 701, whole.data());
      for (const auto& [x0, x1] : {std::pair{0, 701}, {1, 700}, {5, 6}, {255, 520}}) {
        convert_row(frame.view, y, x0, x1, part.data());
        EXPECT_TRUE(std::equal(part.begin(), part.begin() + 4 * (x1 - x0), whole.begin() + 4 * x0));
      }
    }
  }
}

// Unblurred: a mosaic read half a pixel off, or in another order, is off by much more.
TEST(Bayer, ContoursAreWhereThoseOfTheWholePictureAre) {
  const test::Frame whole = test::make_frame(FrameFormat::rgbx, 320, 240, disk_colour);
  const EdgeError best = contour_error(whole.view);
  std::printf("RGBx: mean %.4f, largest %.4f px\n", best.mean, best.largest);
  for (const FrameFormat format : formats)
    for (const BayerOrder order : orders) {
      const test::Frame frame =
          test::make_frame(format, 320, 240, disk_colour, ColourMatrix::bt601, false, 6, order);
      const EdgeError error = contour_error(frame.view);
      std::printf("%s: mean %.4f, largest %.4f px\n", name_of(format), error.mean, error.largest);
      EXPECT_LE(error.mean, 0.06);
      EXPECT_LE(error.largest, 0.24);
    }
}

TEST(Bayer, EqualFramesOfAnotherOrderAreOthers) {
  const test::Frame frame = random_frame(FrameFormat::bayer8, BayerOrder::bggr, 32, 32);
  FrameView other = frame.view;
  other.bayer = BayerOrder::rggb;
  EXPECT_TRUE(same_pixels(frame.view, frame.view, {0, 0, 32, 32}));
  EXPECT_FALSE(same_pixels(frame.view, other, {0, 0, 32, 32}));
}

// A pixel beside the region changes colours inside it.
TEST(Bayer, PixelsBesideARegionCount) {
  test::Frame frame = random_frame(FrameFormat::bayer10le, BayerOrder::bggr, 32, 32);
  FrameCopy copy;
  const Rectangle region{8, 8, 8, 8};
  for (const auto& [x, y, same] :
       {std::tuple{7, 7, false}, {16, 16, false}, {6, 8, true}, {8, 17, true}}) {
    copy.assign(frame.view, region);
    EXPECT_TRUE(same_pixels(frame.view, copy.view(), region));
    frame.planes[0][static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.view.strides[0]) +
                    static_cast<std::size_t>(2 * x)] ^= 1;
    EXPECT_EQ(same_pixels(frame.view, copy.view(), region), same) << x << "," << y;
  }
}
