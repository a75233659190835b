// SPDX-License-Identifier: LGPL-2.1-or-later
// Drawing into distorted pictures: places against the exact inverse, pixels that nothing changes, and
// what is drawn against rays through the real lens.
#include "render/lens/distorted_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "backend.h"
#include "base/error.h"
#include "rig/lens.h"
#include "shot.h"

namespace polyhull {
namespace {

Camera camera_with(std::vector<double> distortion, int width = 640, int height = 360,
                   double degrees = 70.0) {
  Camera camera = synthetic::look_at({0, 1, 4}, {0, 1, 0}, width, height, degrees);
  camera.distortion = std::move(distortion);
  return camera;
}

const std::vector<std::vector<double>>& lenses() {
  static const std::vector<std::vector<double>> all = {
      {-0.3, 0.1, 0.0, 0.0},                                 // barrel
      {0.2, 0.05, 0.0, 0.0, 0.01},                           // pincushion
      {-0.15, 0.02, 0.004, -0.003},                          // decentred
      {0.4, 0.1, 0.001, 0.0, 0.02, 0.7, 0.3, 0.05},          // rational
      {-0.1, 0.01, 0, 0, 0, 0, 0, 0, 0.004, 0, -0.003, 0}};  // thin prism
  return all;
}

std::vector<std::uint8_t> noise(const Camera& camera, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> pixels(4 * static_cast<std::size_t>(camera.width) *
                                   static_cast<std::size_t>(camera.height));
  for (std::uint8_t& value : pixels) value = static_cast<std::uint8_t>(random());
  return pixels;
}

TEST(DistortedView, HasNoPartWithoutDistortion) {
  DistortedView view;
  EXPECT_FALSE(view.set(camera_with({})));
  EXPECT_FALSE(view.set(camera_with({0, 0, 0, 0})));
  EXPECT_TRUE(view.set(camera_with(lenses()[0])));
  EXPECT_FALSE(view.set(camera_with({})));
  EXPECT_FALSE(view.active());
}

TEST(DistortedView, RefusesNumbersThatAreNone) {
  DistortedView view;
  EXPECT_THROW(view.set(camera_with({NAN, 0, 0, 0})), Error);
  EXPECT_THROW(view.set(camera_with({0.1, INFINITY, 0, 0})), Error);
  Camera flat = camera_with(lenses()[0]);
  flat.K[0][0] = 0.0;
  EXPECT_THROW(view.set(flat), Error);
}

// What a depth tells of the picture's pixels goes to the pinhole's that show the same.
TEST(DistortedView, TakesDepths) {
  for (const std::vector<double>& k : lenses()) {
    const Camera camera = camera_with(k, 320, 180);
    DepthPicture depth{320, 180, {}};
    for (int y = 0; y < 180; ++y)
      for (int x = 0; x < 320; ++x) depth.inverse.push_back(static_cast<float>(1 + x + 1000 * y));
    DistortedView view;
    ASSERT_TRUE(view.set(camera));
    const auto taken = view.take(depth);
    ASSERT_EQ(taken->width, view.pinhole().width);
    ASSERT_EQ(taken->height, view.pinhole().height);
    int seen = 0, wrong = 0;
    for (int y = 0; y < 180; ++y)
      for (int x = 0; x < 320; ++x) {
        const Vec2 at = glm::floor(view.place(x, y) + 0.5);
        const float found =
            taken->at(static_cast<int>(at.x), static_cast<int>(at.y), taken->width, taken->height);
        if (!(found > 0.0f)) continue;
        ++seen;
        const int number = static_cast<int>(found) - 1;
        // The pinhole's pixel is half of one away, the picture's half of another.
        wrong += std::abs(number % 1000 - x) > 2 || std::abs(number / 1000 - y) > 2;
      }
    EXPECT_GT(seen, 320 * 180 * 9 / 10);
    EXPECT_EQ(wrong, 0);
  }
}

// Whatever the numbers, the overscan stays small and drawing stays within its memory.
TEST(DistortedView, HoldsOutAgainstAbsurdLenses) {
  for (const std::vector<double>& k : std::vector<std::vector<double>>{{-5.0, 0, 0, 0},
                                                                       {1e9, 0, 0, 0},
                                                                       {-1e-9, -1e30, 0, 0},
                                                                       {0, 0, 3.0, -3.0},
                                                                       {0, 0, 0, 0, 0, -1.0, 0, 0},
                                                                       {0, 0, 0, 0, 1e300}}) {
    const Camera camera = camera_with(k, 97, 61);
    DistortedView view;
    if (!view.set(camera)) continue;
    EXPECT_LE(static_cast<double>(view.pinhole().width) * view.pinhole().height,
              1.1 * DistortedView::most_pixels * 97 * 61 + 2000.0);
    std::vector<std::uint8_t> picture = noise(camera, 3);
    const Rectangle all{0, 0, view.pinhole().width, view.pinhole().height};
    view.take(picture.data(), 4 * 97, all);
    for (int i = 0; i < all.width * all.height; ++i) view.drawn()[4 * i] ^= 1;
    view.give(all, picture.data(), 4 * 97);
  }
}

TEST(DistortedView, PlacesAreExact) {
  std::mt19937 random(1);
  double worst = 0.0;
  for (const std::vector<double>& k : lenses()) {
    for (const double degrees : {50.0, 90.0}) {
      const Camera camera = camera_with(k, 1280, 720, degrees);
      DistortedView view;
      ASSERT_TRUE(view.set(camera));
      const Lens lens(camera);
      const Mat3 back = view.pinhole().K * glm::inverse(camera.K);
      const double scale = back[0][0];
      std::uniform_int_distribution<int> x(0, 1279), y(0, 719);
      for (int i = 0; i < 3000; ++i) {
        const int px = x(random), py = y(random);
        const Vec2 real(px, py);
        const Vec2 ideal = lens.undistort(real);
        // What lies outside of the model's disk has no place.
        if (glm::length(lens.distort(ideal) - real) > 1e-3) continue;
        const Vec3 truth = back * Vec3(ideal, 1.0);
        const Vec2 found = view.place(px, py);
        worst = std::max(worst, glm::length(found - Vec2(truth)) / scale);
        EXPECT_GE(found.x, 1.0);
        EXPECT_GE(found.y, 1.0);
        EXPECT_LE(found.x, view.pinhole().width - 2.0);
        EXPECT_LE(found.y, view.pinhole().height - 2.0);
      }
    }
  }
  RecordProperty("worst_px", std::to_string(worst));
  std::printf("worst place: %.4f px\n", worst);
  EXPECT_LE(worst, 0.05);
}

TEST(DistortedView, WritesOnlyWhatChanges) {
  for (const std::vector<double>& k : lenses()) {
    const Camera camera = camera_with(k, 323, 181);
    DistortedView view;
    ASSERT_TRUE(view.set(camera));
    const std::vector<std::uint8_t> picture = noise(camera, 5);
    std::vector<std::uint8_t> target = picture;
    const Rectangle all{0, 0, view.pinhole().width, view.pinhole().height};
    view.take(picture.data(), 4 * 323, all);
    view.give(all, target.data(), 4 * 323);
    EXPECT_EQ(target, picture);
    // One pixel of the overscan reaches what is around its place alone.
    const Vec2 place = view.place(160, 90);
    const int px = static_cast<int>(place.x), py = static_cast<int>(place.y);
    view.drawn()[view.stride() * py + 4 * px] ^= 255;
    const Rectangle part{px, py, 1, 1};
    view.give(part, target.data(), 4 * 323);
    const Rectangle reach = view.reach(part);
    int changed = 0;
    for (int y = 0; y < 181; ++y)
      for (int x = 0; x < 323; ++x) {
        const std::size_t at =
            4 * (static_cast<std::size_t>(y) * 323 + static_cast<std::size_t>(x));
        if (std::equal(&target[at], &target[at] + 4, &picture[at])) continue;
        ++changed;
        EXPECT_LE(std::abs(x - 160), 5);
        EXPECT_LE(std::abs(y - 90), 5);
        EXPECT_TRUE(x >= reach.x && x < reach.x + reach.width && y >= reach.y &&
                    y < reach.y + reach.height);
      }
    EXPECT_GE(changed, 1);
  }
}

// What was drawn before, elsewhere or by a lens of another size, is not to be seen; and what is kept of a
// picture that comes again is as if it were taken anew.
TEST(DistortedView, RemembersNothing) {
  for (const std::vector<double>& k : lenses()) {
    const Camera camera = camera_with(k, 323, 181);
    DistortedView used;
    std::mt19937 random(9);
    for (unsigned frame = 0; frame < 12; ++frame) {
      const Camera zoomed = camera_with(k, 323, 181, frame % 3 == 2 ? 60.0 : 70.0);
      const std::vector<std::uint8_t> picture = noise(zoomed, 100 + frame / 4);
      std::vector<std::uint8_t> targets[2] = {picture, picture};
      DistortedView fresh;
      DistortedView* const views[2] = {&used, &fresh};
      const unsigned seed = random();
      for (int i = 0; i < 2; ++i) {
        DistortedView& view = *views[i];
        ASSERT_TRUE(view.set(zoomed));
        std::mt19937 same(seed);
        const int width = view.pinhole().width, height = view.pinhole().height;
        Rectangle part{static_cast<int>(same() % static_cast<unsigned>(width - 40)),
                       static_cast<int>(same() % static_cast<unsigned>(height - 40)), 40, 40};
        if (frame % 4 == 1) part = {0, 0, width, height};
        view.take(picture.data(), 4 * 323, part);
        for (int y = part.y; y < part.y + part.height; ++y)
          for (int x = part.x; x < part.x + part.width; ++x)
            if (same() % 3 == 0) view.drawn()[view.stride() * y + 4 * x] = 200;
        view.give(part, targets[i].data(), 4 * 323);
      }
      EXPECT_EQ(targets[0], targets[1]) << frame;
      EXPECT_NE(targets[0], picture) << frame;
    }
  }
}

// A barrel lens whose model turns back within the picture.
TEST(DistortedView, LeavesPixelsWithoutAPlaceAlone) {
  const Camera camera = camera_with({-0.3, 0, 0, 0}, 320, 180, 80.0);
  DistortedView view;
  ASSERT_TRUE(view.set(camera));
  const Lens lens(camera);
  const std::vector<std::uint8_t> picture = noise(camera, 7);
  std::vector<std::uint8_t> target = picture;
  const Rectangle all{0, 0, view.pinhole().width, view.pinhole().height};
  view.take(picture.data(), 4 * 320, all);
  for (int i = 0; i < all.width * all.height; ++i) view.drawn()[4 * i] ^= 255;
  view.give(all, target.data(), 4 * 320);
  int without = 0, drawn = 0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) {
      const Vec2 real(x, y);
      const std::size_t at = 4 * (static_cast<std::size_t>(y) * 320 + static_cast<std::size_t>(x));
      const bool same = std::equal(&target[at], &target[at] + 4, &picture[at]);
      if (glm::length(lens.distort(lens.undistort(real)) - real) > 1e-2) {
        ++without;
        EXPECT_TRUE(same) << x << ", " << y;
      } else {
        drawn += !same;
      }
    }
  EXPECT_GT(without, 1000);
  EXPECT_GT(drawn, 20'000);
}

// ---- against rays through the real lens

struct Ball {
  Vec3 centre;
  double radius;
};

/// The share of each pixel of \p camera's real picture that shows one of \p balls, by 8 x 8 rays; the
/// lens's inverse is taken at pixels' corners, and as linear within.
std::vector<float> coverage(const Camera& camera, const std::vector<Ball>& balls) {
  constexpr int rays = 8;
  const Lens lens(camera);
  const int across = camera.width + 1;
  std::vector<Vec3> ways;
  for (int y = 0; y <= camera.height; ++y)
    for (int x = 0; x < across; ++x) ways.push_back(camera.ray(lens.undistort({x - 0.5, y - 0.5})));
  std::vector<float> out(static_cast<std::size_t>(camera.width) *
                         static_cast<std::size_t>(camera.height));
  for (const Ball& ball : balls) {
    const Vec3 to = ball.centre - camera.centre();
    const Vec2 middle = camera.project(ball.centre).value();
    const int reach =
        static_cast<int>(2.0 * ball.radius * camera.K[0][0] / camera.to_camera(ball.centre).z) + 4;
    const int left = std::max(static_cast<int>(middle.x) - reach, 0);
    const int top = std::max(static_cast<int>(middle.y) - reach, 0);
    for (int y = top; y <= std::min(top + 2 * reach, camera.height - 1); ++y)
      for (int x = left; x <= std::min(left + 2 * reach, camera.width - 1); ++x) {
        const Vec3* corner = &ways[static_cast<std::size_t>(y) * static_cast<std::size_t>(across) +
                                   static_cast<std::size_t>(x)];
        int hits = 0;
        for (int s = 0; s < rays * rays; ++s) {
          const double a = (s % rays + 0.5) / rays, b = (s / rays + 0.5) / rays;
          const Vec3 way =
              glm::normalize(glm::mix(glm::mix(corner[0], corner[1], a),
                                      glm::mix(corner[across], corner[across + 1], a), b));
          hits += glm::length(to - glm::dot(to, way) * way) < ball.radius;
        }
        out[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
            static_cast<std::size_t>(x)] += static_cast<float>(hits) / (rays * rays);
      }
  }
  return out;
}

/// Bright balls on black, gamma-coded: red for the background's, green for the subject's.
struct Pictures {
  std::vector<std::uint8_t> background, truth, drawn;
};

std::uint8_t code(float linear) {
  return static_cast<std::uint8_t>(
      std::lround(255.0f * synthetic::to_srgb(std::min(linear, 1.0f))));
}

/// The middle of channel \p channel's light around \p near.
Vec2 centroid(const std::vector<std::uint8_t>& picture, const Camera& camera, int channel,
              const Vec2& near, int reach) {
  Vec2 sum(0.0);
  double weight = 0.0;
  for (int y = static_cast<int>(near.y) - reach; y <= static_cast<int>(near.y) + reach; ++y)
    for (int x = static_cast<int>(near.x) - reach; x <= static_cast<int>(near.x) + reach; ++x) {
      const float value = synthetic::to_linear(
          picture[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                       static_cast<std::size_t>(x)) +
                  static_cast<std::size_t>(channel)] /
          255.0f);
      sum += static_cast<double>(value) * Vec2(x, y);
      weight += value;
    }
  return sum / weight;
}

using DistortedDrawingTest = testing::BackendTest;

// The subject's balls stand a little before those of the background: drawn through a pinhole and the
// resampling, they lie where rays through the lens see them, and so do the background's.
TEST_P(DistortedDrawingTest, IsInRegisterWithTheScene) {
  std::vector<std::vector<double>> all = lenses();
  all.push_back({});  // what the renderer alone is worth
  for (const std::vector<double>& k : all) {
    const Camera camera = camera_with(k, 640, 360, 75.0);
    std::vector<Ball> scene, subject;
    for (double y = 40; y < 340; y += 70)
      for (double x = 50; x < 620; x += 90) {
        // Where the picture's pixels (x, y) and (x + 40, y) look.
        const auto at = [&](double u, double depth) {
          return camera.centre() + depth * camera.ray(camera.undistort({u, y}));
        };
        scene.push_back({at(x, 4.0), 0.1});
        if (x + 40 < 620) subject.push_back({at(x + 40, 3.0), 0.08});
      }
    const std::vector<float> red = coverage(camera, scene), green = coverage(camera, subject);
    Pictures pictures;
    for (std::size_t i = 0; i < red.size(); ++i) {
      for (const std::uint8_t value : {code(red[i]), code(0.0f), code(0.0f), std::uint8_t{255}})
        pictures.background.push_back(value);
      for (const std::uint8_t value : {code(red[i]), code(green[i]), code(0.0f), std::uint8_t{255}})
        pictures.truth.push_back(value);
    }
    Mesh mesh;
    for (const Ball& ball : subject)
      synthetic::add_ellipsoid(mesh.hull, Vec3f(ball.centre),
                               Vec3f(static_cast<float>(ball.radius)), 32);
    mesh.texturing.emplace();
    mesh.texturing->untextured = Vec3f(0.0f, 1.0f, 0.0f);

    DistortedView view;
    EXPECT_EQ(view.set(camera), !k.empty());
    RenderFrame frame;
    frame.viewport = view.active() ? view.pinhole() : camera;
    frame.width = frame.viewport.width;
    frame.height = frame.viewport.height;
    frame.subjects.push_back({&mesh, {}, 0});
    RenderSettings settings;
    settings.edge_samples = 8;
    const auto renderer = make_renderer();
    const RenderPlan plan = renderer->plan(frame, settings);
    pictures.drawn = pictures.background;
    if (view.active()) {
      view.take(pictures.background.data(), 4 * 640, plan.changed());
      renderer->render(frame, plan, settings, view.before(), view.stride(), view.drawn(),
                       view.stride());
      view.give(plan.changed(), pictures.drawn.data(), 4 * 640);
    } else {
      renderer->render(frame, plan, settings, pictures.background.data(), 4 * 640,
                       pictures.drawn.data(), 4 * 640);
    }

    Vec2 mean(0.0);
    int count = 0;
    double worst[2] = {0.0, 0.0};
    for (const int channel : {0, 1})
      for (const Ball& ball : channel == 0 ? scene : subject) {
        const Vec2 near = glm::round(camera.project(ball.centre).value());
        const int reach = 22;
        if (near.x < reach || near.y < reach || near.x >= 640 - reach || near.y >= 360 - reach)
          continue;
        const Vec2 off = centroid(pictures.drawn, camera, channel, near, reach) -
                         centroid(pictures.truth, camera, channel, near, reach);
        worst[channel] = std::max(worst[channel], glm::length(off));
        mean += channel == 1 ? off : Vec2(0.0);
        count += channel;
      }
    double sum = 0.0;
    for (std::size_t i = 0; i < pictures.truth.size(); ++i) {
      const double d = static_cast<double>(pictures.drawn[i]) - pictures.truth[i];
      sum += d * d;
    }
    const double psnr =
        10.0 * std::log10(255.0 * 255.0 * 0.75 * static_cast<double>(pictures.truth.size()) / sum);
    std::printf("k1 %5.2f: subject %.4f px (mean %.4f), background %.4f px, %.1f dB\n",
                k.empty() ? 0.0 : k[0], worst[1], glm::length(mean) / count, worst[0], psnr);
    EXPECT_LE(glm::length(mean) / count, 0.03);
    EXPECT_LE(worst[0], 0.1);
    EXPECT_LE(worst[1], 0.1);
    EXPECT_GE(psnr, 37.0);
  }
}

INSTANTIATE_TEST_SUITE_P(, DistortedDrawingTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
