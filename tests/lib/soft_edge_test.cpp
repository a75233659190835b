// SPDX-License-Identifier: LGPL-2.1-or-later
// Outlines as soft as the mattes: nearer to the truth, closed inside, the same on all backends.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "backend.h"
#include "render/subject/view_picture.h"
#include "scene/scene.h"
#include "studio_mesh.h"

namespace polyhull {
namespace {

using testing::BackendTest;
using SoftEdgeTest = BackendTest;
using Colour = std::array<std::uint8_t, 3>;

constexpr Colour blue{70, 105, 150};
constexpr int cameras = 8;

/// Made once for all tests.
const test::StudioMesh& studio(const std::string& subject) {
  static std::map<std::string, test::StudioMesh> made;
  const auto [entry, fresh] = made.try_emplace(subject);
  if (fresh) {
    SilhouetteSettings settings;
    settings.blur.sigma = 1.5;
    settings.approximate.tolerance = 0.5;
    settings.approximate.min_area = 100;
    entry->second = test::studio_mesh(test::ring_rig(cameras), subject, 3.0, settings);
  }
  return entry->second;
}

/// Like the first camera of the ring, \p degrees on towards the next.
Camera viewport(double degrees) {
  const double a = degrees * std::numbers::pi / 180.0;
  Camera camera =
      look_at({3.0 * std::sin(a), 1.2, 3.0 * std::cos(a)}, {0.0, 0.95, 0.0}, 60.0, 1024, 768);
  camera.K = test::ring_rig(1).cameras[0].K;
  return camera;
}

Picture draw(Renderer& renderer, const test::StudioMesh& studio, const Camera& viewport,
             const RenderSettings& settings, const Colour& behind = blue) {
  RenderFrame frame;
  frame.viewport = viewport;
  frame.width = frame.viewport.width;
  frame.height = frame.viewport.height;
  frame.subjects = {{&studio.mesh, {}, 0}};
  Picture before{frame.width, frame.height, 4, {}};
  for (int i = 0; i < frame.width * frame.height; ++i)
    before.pixels.insert(before.pixels.end(), {behind[0], behind[1], behind[2], 255});
  Picture out = before;
  renderer.render(frame, renderer.plan(frame, settings), settings, before.pixels.data(),
                  4 * frame.width, out.pixels.data(), 4 * frame.width);
  return out;
}

Picture draw(Renderer& renderer, const test::StudioMesh& studio, double degrees,
             const RenderSettings& settings, const Colour& behind = blue) {
  return draw(renderer, studio, viewport(degrees), settings, behind);
}

RenderSettings with_soft_edges(bool soft) {
  RenderSettings settings;
  settings.soft_edges = soft;
  return settings;
}

// From a camera's place, near it, and half way to the next.
TEST_P(SoftEdgeTest, HairIsNearerToTheTruth) {
  const auto renderer = make_renderer();
  const struct {
    double degrees, most;  // levels
  } places[] = {{0.0, 11.1}, {4.5, 15.8}, {22.5, 20.7}};
  for (const auto& [degrees, most] : places) {
    const Picture truth = test::studio_truth(viewport(degrees), "hairy", 3.0, blue);
    double rms[2];
    for (const bool soft : {false, true})
      rms[soft] =
          test::edge_error(draw(*renderer, studio("hairy"), degrees, with_soft_edges(soft)), truth)
              .rms;
    RecordProperty("rms-" + std::to_string(degrees),
                   std::to_string(rms[0]) + " " + std::to_string(rms[1]));
    EXPECT_LT(rms[1], 0.9 * rms[0]) << degrees;
    EXPECT_LT(rms[1], most) << degrees;
  }
}

// What lies well inside the true outline does not let the background through.
TEST_P(SoftEdgeTest, TheBodyStaysClosed) {
  const auto renderer = make_renderer();
  constexpr int inset = 7;
  for (const double degrees : {0.0, 11.0}) {
    const Picture truth = test::studio_truth(viewport(degrees), "figure", 3.0, blue);
    const RenderSettings settings = with_soft_edges(true);
    const Picture dark = draw(*renderer, studio("figure"), degrees, settings, {0, 0, 0});
    const Picture light = draw(*renderer, studio("figure"), degrees, settings, {255, 255, 255});
    int inside = 0, open = 0;
    for (int y = inset; y < truth.height - inset; ++y) {
      for (int x = inset; x < truth.width - inset; ++x) {
        bool covered = true;  // with all around it
        for (int dy = -inset; covered && dy <= inset; ++dy)
          for (int dx = -inset; covered && dx <= inset; ++dx)
            covered = truth.row(y + dy)[4 * (x + dx) + 3] == 255;
        if (!covered) continue;
        ++inside;
        const std::size_t at = 4 * (static_cast<std::size_t>(y) * truth.width + x);
        open += std::abs(dark.pixels[at] - light.pixels[at]) > 2;
      }
    }
    EXPECT_GT(inside, 5000);
    EXPECT_EQ(open, 0) << degrees;
  }
}

TEST_P(SoftEdgeTest, SkippingChangesNoByte) {
  const auto renderer = make_renderer();
  RenderSettings settings = with_soft_edges(true);
  const Picture skipped = draw(*renderer, studio("hairy"), 4.5, settings);
  settings.skip = false;
  EXPECT_EQ(skipped.pixels, draw(*renderer, studio("hairy"), 4.5, settings).pixels);
}

// The hull lies below the picture, by a pixel or two, and its edge reaches in.
TEST(SoftEdge, ReachesIntoThePictureFromBelow) {
  ProcessorRenderer renderer;
  RenderFrame frame;
  frame.viewport = viewport(4.5);
  frame.width = frame.viewport.width;
  frame.height = frame.viewport.height;
  frame.subjects = {{&studio("hairy").mesh, {}, 0}};
  const Rectangle hull = renderer.plan(frame, with_soft_edges(false)).subject;
  frame.viewport.K[2].y += frame.height - hull.y - 0.5;
  EXPECT_TRUE(renderer.plan(frame, with_soft_edges(false)).untouched());

  RenderSettings settings = with_soft_edges(true);
  const Picture skipped = draw(renderer, studio("hairy"), frame.viewport, settings);
  int touched = 0;
  for (std::size_t p = 0; p < skipped.pixels.size(); p += 4)
    touched += !std::equal(blue.begin(), blue.end(), &skipped.pixels[p]);
  EXPECT_GT(touched, 0);
  settings.skip = false;
  EXPECT_EQ(skipped.pixels, draw(renderer, studio("hairy"), frame.viewport, settings).pixels);
}

/// Of the pixels of the subject, how like \p a is to \p b: dB, and the difference that one in a hundred
/// exceeds.
std::pair<double, int> likeness(const Picture& a, const Picture& b) {
  double squares = 0.0;
  std::vector<int> off;
  for (std::size_t p = 0; p < b.pixels.size(); p += 4) {
    if (std::equal(blue.begin(), blue.end(), &b.pixels[p])) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      off.push_back(std::abs(a.pixels[p + c] - b.pixels[p + c]));
      squares += off.back() * off.back();
    }
  }
  std::sort(off.begin(), off.end());
  return {10.0 * std::log10(65025.0 * static_cast<double>(off.size()) / std::max(squares, 1.0)),
          off[off.size() * 99 / 100]};
}

// As well as about polygons: hulls of eight views consist of slivers, about whose colours they differ.
TEST_P(SoftEdgeTest, BackendsAgree) {
  if (processor()) GTEST_SKIP() << "the others are held against it";
  const auto own = make_renderer();
  ProcessorRenderer reference;
  for (const double degrees : {0.0, 11.0}) {
    const auto compare = [&](const char* subject, bool soft) {
      const RenderSettings settings = with_soft_edges(soft);
      return likeness(draw(*own, studio(subject), degrees, settings),
                      draw(reference, studio(subject), degrees, settings));
    };
    for (const char* subject : {"figure", "hairy"}) {
      const auto [soft, most] = compare(subject, true);
      const auto [hard, most_hard] = compare(subject, false);
      EXPECT_GT(soft, hard - 1.2) << subject << " " << degrees;
      EXPECT_LE(most, most_hard + 2) << subject << " " << degrees;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, SoftEdgeTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

// A row that goes from the subject over a ramp to the screen: its straight colours stay wherever enough
// of the subject is seen, and so does the matte.
TEST(ViewPicture, StraightColoursOfTheSoftEdgeStay) {
  constexpr int width = 40, height = 12;
  std::vector<std::uint8_t> pixels;
  const auto matte = [](int x) { return std::clamp(255 - 255 * (x - 10) / 16, 0, 255); };
  const auto own = [](int x) { return std::array{180 - 2 * x, 90 + x, 40 + 3 * x}; };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const int c : own(x)) pixels.push_back(static_cast<std::uint8_t>(c));
      pixels.push_back(static_cast<std::uint8_t>(matte(x)));
    }
  }
  View view;
  view.width = width;
  view.height = height;
  view.roi = {0, 0, width, height};
  view.format = PixelFormat::rgba;
  view.stride = 4 * width;
  view.pixels = pixels;
  std::vector<std::uint32_t> made;
  prepare_view_picture(view, soft_reach, made);
  ASSERT_EQ(made.size(), static_cast<std::size_t>(width + 2) * (height + 2));
  for (int x = 0; x < width; ++x) {
    const std::uint32_t pixel = made[static_cast<std::size_t>(6 * (width + 2) + x + 1)];
    EXPECT_EQ(static_cast<int>(pixel >> 24), matte(x)) << x;
    if (matte(x) < 40) continue;
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_EQ(static_cast<int>(pixel >> (8 * c) & 255u), own(x)[c]) << x;
  }
}

}  // namespace
}  // namespace polyhull
