// SPDX-License-Identifier: LGPL-2.1-or-later
// Where triangles meet inside a subject no dots are seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "backend.h"
#include "base/srgb.h"
#include "scene/scene.h"
#include "studio_mesh.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using SeamsTest = testing::BackendTest;

constexpr int width = 640, height = 360;

/// Red, green and blue, and what of a pixel the subject covers, as two backgrounds tell.
struct Drawn {
  Picture dark, light;
};

Drawn draw(Renderer& renderer, const Mesh& mesh, double degrees, int scale) {
  const double a = degrees * std::numbers::pi / 180.0;
  RenderFrame frame;
  frame.width = scale * width;
  frame.height = scale * height;
  frame.viewport = look_at({2.7 * std::sin(a), 1.5, 2.7 * std::cos(a)}, {0.0, 0.9, 0.0}, 50.0,
                           frame.width, frame.height);
  frame.subjects = {{&mesh, {}, 0}};
  RenderSettings settings;
  Drawn out;
  for (const bool light : {false, true}) {
    Picture& picture = light ? out.light : out.dark;
    picture = {frame.width, frame.height, 4,
               std::vector<std::uint8_t>(static_cast<std::size_t>(frame.width) * frame.height * 4,
                                         light ? 255 : 0)};
    const Picture before = picture;
    renderer.render(frame, renderer.plan(frame, settings), settings, before.pixels.data(),
                    4 * frame.width, picture.pixels.data(), 4 * frame.width);
  }
  return out;
}

/// Four pixels of \p fine as one, in linear light: 16 samples of 4 x 4.
Picture halved(const Picture& fine) {
  Picture out{fine.width / 2, fine.height / 2, 4, {}};
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 4; ++c) {
        float sum = 0.0f;
        for (int k = 0; k < 4; ++k)
          sum += srgb_to_linear_table()[fine.row(2 * y + k / 2)[4 * (2 * x + k % 2) + c]];
        out.pixels.push_back(linear_to_srgb(0.25f * sum));
      }
  return out;
}

/// How far a pixel is from the median of the nine around it, in its worst channel.
int off_median(const Picture& picture, int x, int y) {
  int worst = 0;
  for (int c = 0; c < 3; ++c) {
    std::array<int, 9> around{};
    for (int k = 0; k < 9; ++k)
      around[static_cast<std::size_t>(k)] = picture.row(y + k / 3 - 1)[4 * (x + k % 3 - 1) + c];
    const int own = around[4];
    std::nth_element(around.begin(), around.begin() + 4, around.end());
    worst = std::max(worst, std::abs(own - around[4]));
  }
  return worst;
}

/// Whether it or a pixel beside it is off by more than 24.
bool any_off(const Picture& picture, int x, int y) {
  for (int k = 0; k < 9; ++k)
    if (off_median(picture, x + k % 3 - 1, y + k / 3 - 1) > 24) return true;
  return false;
}

TEST_P(SeamsTest, NoDotsInsideTheSubject) {
  static const synthetic::Photographed figure = [] {
    SilhouetteSettings settings;
    settings.blur.sigma = 1.5;
    settings.approximate.tolerance = 0.7;
    settings.approximate.min_area = 100;
    const Rig rig = test::ring_rig(8);
    // All views agree about the colours, which change slowly: what stands out is a seam.
    synthetic::Photographed out = synthetic::photographed(
        test::studio_mesh(rig, "figure", 3.0, settings).mesh.hull, rig.cameras);
    out.mesh.texturing =
        texture_hull(out.mesh.hull, rig.cameras, {.metric = TextureMetric::camera_normal});
    return out;
  }();
  const auto renderer = make_renderer();
  int inside = 0, dots = 0;
  for (const double degrees : {30.0, 100.0, 205.0, 315.0}) {
    const Drawn four = draw(*renderer, figure.mesh, degrees, 1);
    const Picture sixteen = halved(draw(*renderer, figure.mesh, degrees, 2).dark);
    for (int y = 2; y + 2 < height; ++y) {
      for (int x = 2; x + 2 < width; ++x) {
        bool covered = true;  // with what is around it
        for (int k = 0; covered && k < 25; ++k) {
          const std::size_t at =
              4 * (static_cast<std::size_t>(y + k / 5 - 2) * width + x + k % 5 - 2);
          covered = four.dark.pixels[at] == four.light.pixels[at] &&
                    four.dark.pixels[at + 1] == four.light.pixels[at + 1];
        }
        if (!covered) continue;
        ++inside;
        dots += off_median(four.dark, x, y) > 24 && !any_off(sixteen, x, y);
      }
    }
  }
  EXPECT_GT(inside, 20000);
  // One or two, at the border of what a limb hides; 37 where slivers are sampled beside themselves.
  EXPECT_LE(dots, 3);
}

INSTANTIATE_TEST_SUITE_P(Backends, SeamsTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
