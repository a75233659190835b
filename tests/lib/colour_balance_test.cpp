// SPDX-License-Identifier: LGPL-2.1-or-later
// Cameras whose colours differ are balanced where they see the same places, and only there.
#include "texture/colour/colour_balance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/picture.h"
#include "base/srgb.h"
#include "hull/build/stage.h"
#include "mesh/texture_mesh.h"
#include "refine/refine.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"
#include "synthetic.h"

namespace polyhull::test {
namespace {

/// Unlike each other, from .8 to 1.25, and 1 in the geometric mean of each channel.
std::vector<Vec3f> faults(std::size_t cameras) {
  std::vector<Vec3f> gains(cameras);
  for (int c = 0; c < 3; ++c) {
    double mean = 0.0;
    for (std::size_t k = 0; k < cameras; ++k) {
      gains[k][c] =
          static_cast<float>(0.2 * std::sin(2.4 * static_cast<double>(k) + 1.1 * c + 0.4));
      mean += gains[k][c] / static_cast<double>(cameras);
    }
    for (Vec3f& gain : gains)
      gain[c] = std::clamp(std::exp(gain[c] - static_cast<float>(mean)), 0.8f, 1.25f);
  }
  return gains;
}

void apply(const Vec3f& gain, Picture& picture) {
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    if (i % 4 < 3)
      picture.pixels[i] =
          linear_to_srgb(gain[static_cast<int>(i % 4)] * srgb_to_linear(picture.pixels[i]));
}

/// A body, its refined surface and what cameras see of it, each with a gain of its own.
struct Stage {
  BodyScene scene;
  Hull surface;

  explicit Stage(const std::string& rig, double seconds = 3.0)
      : scene(body_scene(body_rig(rig), {"figure", open_subject("figure"), seconds})) {
    const std::vector<CameraContours> views = camera_contours(scene.cameras, scene.contours);
    HullStage stage;
    surface = HullRefiner().refine(hull_of(scene, stage, 0), views, 1.0, {});
  }

  Mesh mesh() const { return mesh_of(surface, scene); }
  void spoil(const std::vector<Vec3f>& gains) {
    for (std::size_t k = 0; k < gains.size(); ++k) apply(gains[k], scene.pictures[k]);
  }
  /// dB, in what either shows of the body, half way between the cameras.
  double psnr(const Mesh& mesh) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < scene.between.size(); ++k) {
      const Picture picture = drawn(mesh, scene.between[k]);
      const Picture& truth = scene.seen[k];
      double error = 0.0;
      std::size_t count = 0;
      for (std::size_t i = 0; i < truth.pixels.size(); i += 4) {
        if (truth.pixels[i + 3] < 255) continue;
        for (std::size_t c = 0; c < 3; ++c)
          error += std::pow(picture.pixels[i + c] - truth.pixels[i + c], 2.0);
        count += 3;
      }
      sum += 10.0 * std::log10(255.0 * 255.0 * static_cast<double>(count) / error);
    }
    return sum / static_cast<double>(scene.between.size());
  }
};

Mesh textured(const Stage& stage, bool balance) {
  Mesh mesh = stage.mesh();
  TextureSettings settings{.metric = TextureMetric::camera_normal};
  settings.balance = balance;
  texture_mesh(mesh, settings);
  return mesh;
}

// Half way between five cameras: what the faults cost comes back, and without faults nothing is lost.
TEST(ColourBalance, SeamsGo) {
  Stage stage("5");
  const double right = stage.psnr(textured(stage, false));
  const Mesh agreeing = textured(stage, true);
  EXPECT_GT(stage.psnr(agreeing), right - 0.02);
  for (const Vec3f& gain : agreeing.texturing->gains)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(gain[c], 1.0f, 0.01f);

  const std::vector<Vec3f> gains = faults(5);
  stage.spoil(gains);
  const double spoilt = stage.psnr(textured(stage, false));
  const Mesh mesh = textured(stage, true);
  const double balanced = stage.psnr(mesh);
  std::printf("%.2f dB, spoilt %.2f, balanced %.2f\n", right, spoilt, balanced);
  EXPECT_LT(spoilt, right - 1.0);
  EXPECT_GT(balanced, right - 0.05);
  for (int c = 0; c < 3; ++c) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_NEAR(mesh.texturing->gains[k][c] * gains[k][c], 1.0, 0.015) << k;
      sum += std::log(mesh.texturing->gains[k][c]);
    }
    EXPECT_NEAR(sum, 0.0, 1e-5);
  }
}

// Cameras that see colours their own way, each with the matrix that undoes it: nothing is lost, but for
// what rounding to bytes and clipping take, and there is nothing left to balance.
TEST(ColourBalance, MatricesOfTheCamerasCountFirst) {
  Stage stage("5");
  const double right = stage.psnr(textured(stage, false));
  for (std::size_t k = 0; k < 5; ++k) {
    const double s = 0.08 * std::sin(2.4 * static_cast<double>(k) + 0.4), g = 0.9 + 0.5 * s;
    const Mat3 response = from_rows({g, s, -0.04, 0.03 - s, g + 0.06, -0.02, s, 0.05, 0.85 - s});
    for (std::size_t i = 0; i < stage.scene.pictures[k].pixels.size(); i += 4) {
      std::uint8_t* pixel = &stage.scene.pictures[k].pixels[i];
      const Vec3 light = response * Vec3(srgb_to_linear(pixel[0]), srgb_to_linear(pixel[1]),
                                         srgb_to_linear(pixel[2]));
      for (int c = 0; c < 3; ++c) pixel[c] = linear_to_srgb(static_cast<float>(light[c]));
    }
    stage.scene.cameras[k].colour = glm::inverse(response);
  }
  const double matched = stage.psnr(textured(stage, false));
  const Mesh balanced = textured(stage, true);
  for (const Vec3f& gain : balanced.texturing->gains)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(gain[c], 1.0f, 0.06f);  // dark places were clipped
  for (Camera& camera : stage.scene.cameras) camera.colour = Mat3(1.0);
  const double spoilt = stage.psnr(textured(stage, false));
  std::printf("%.2f dB, spoilt %.2f, by matrices %.2f\n", right, spoilt, matched);
  EXPECT_LT(spoilt, right - 1.5);
  EXPECT_GT(matched, right - 0.1);
}

/// A painted ball before a ring of cameras, of whose pictures some are darker.
class Ring {
 public:
  explicit Ring(int cameras = 6) {
    synthetic::add_ellipsoid(ball_, {0, 1, 0}, {0.4f, 0.4f, 0.4f}, 24);
    made_ = synthetic::photographed(ball_,
                                    synthetic::ring(cameras, 2.5, 1.2, {0, 1, 0}, 160, 160, 25.0));
    for (const MeshView& view : made_.mesh.views) cameras_.push_back(view.calibration);
    original_ = made_.pictures;
    texturing_ = texture_hull(ball_, cameras_, {.metric = TextureMetric::camera_normal});
  }
  /// The light of camera \p k times \p gain.
  void set(std::size_t k, const Vec3f& gain) {
    std::copy(original_[k].pixels.begin(), original_[k].pixels.end(),
              made_.pictures[k].pixels.begin());
    apply(gain, made_.pictures[k]);
  }
  std::size_t size() const { return cameras_.size(); }
  /// What \p balance makes of it, without camera \p missing.
  std::vector<Vec3f> gains(ColourBalance& balance, std::optional<double> time,
                           double constant = 2.0, std::size_t missing = ~std::size_t{0},
                           int threads = 1, bool backwards = false) const {
    std::vector<FillPicture> pictures;
    std::vector<Camera> cameras;
    std::vector<std::string_view> names;
    for (std::size_t i = 0; i < size(); ++i) {
      const std::size_t k = backwards ? size() - 1 - i : i;
      if (k == missing) continue;
      const View& view = made_.mesh.views[k].view;
      pictures.push_back({view.roi, view.stride, view.pixels});
      cameras.push_back(cameras_[k]);
      names.push_back(cameras_[k].name);
    }
    const Texturing texturing =
        cameras.size() == size() && !backwards
            ? texturing_
            : texture_hull(ball_, cameras, {.metric = TextureMetric::camera_normal});
    return balance.update(ball_, {cameras, pictures, texturing, threads}, names, time, constant);
  }

 private:
  Hull ball_;
  synthetic::Photographed made_;
  std::vector<Picture> original_;
  std::vector<Camera> cameras_;
  Texturing texturing_;
};

const Vec3f darker(0.8f, 0.9f, 0.85f);

// A camera that changes: at once where nothing was known before, slowly otherwise, and never back and
// forth.
TEST(ColourBalance, GainsFollowSlowly) {
  Ring ring;
  ColourBalance balance;
  double time = 100.0;
  for (int i = 0; i < 100; ++i, time += 0.04)
    EXPECT_NEAR(ring.gains(balance, time)[2].x, 1.0f, 0.01f) << i;
  ring.set(2, darker);
  ColourBalance fresh;
  const float end = ring.gains(fresh, time)[2].x;
  EXPECT_NEAR(end, std::pow(0.8f, -5.0f / 6.0f), 0.01f);  // a sixth is everybody's
  float last = 1.0f, half = 0.0f;
  for (int i = 0; i < 250; ++i, time += 0.04) {
    const float gain = ring.gains(balance, time)[2].x;
    EXPECT_GE(gain, last - 1e-3f) << i;
    EXPECT_LT(gain - last, 0.006f) << i;
    last = gain;
    if (i == 49) half = gain;  // a time constant later
  }
  EXPECT_NEAR((half - 1.0f) / (end - 1.0f), 0.63f, 0.05f);
  EXPECT_NEAR(last, end, 0.005f);
}

// Only what was given counts: times, not how many threads or when.
TEST(ColourBalance, BeginsAnewWhereTimeGoesBack) {
  Ring ring;
  ring.set(1, darker);
  ColourBalance balance, fresh;
  const std::vector<Vec3f> first = ring.gains(fresh, 3.0);
  for (const double time : {7.0, 8.0, 9.0}) ring.gains(balance, time);
  ring.set(1, Vec3f(1.0f));
  ring.gains(balance, 9.5);
  ring.set(1, darker);
  EXPECT_EQ(ring.gains(balance, 3.0, 2.0, ~std::size_t{0}, 7), first);
  // Without times, as one in a twenty-fifth of a second.
  ColourBalance timed, untimed;
  for (int i = 0; i < 4; ++i) {
    ring.set(0, Vec3f(1.0f - 0.1f * static_cast<float>(i)));
    EXPECT_EQ(ring.gains(untimed, std::nullopt), ring.gains(timed, 0.04 * i)) << i;
  }
}

// A camera is known by its name, in which order ever the views come.
TEST(ColourBalance, OrderOfTheViewsDoesNotCount) {
  Ring ring;
  ring.set(1, darker);
  ring.set(4, {0.9f, 0.8f, 1.0f});
  ColourBalance balance;
  const std::vector<Vec3f> first = ring.gains(balance, 1.0);
  const std::vector<Vec3f> turned = ring.gains(balance, 4.0, 2.0, ~std::size_t{0}, 1, true);
  for (std::size_t k = 0; k < ring.size(); ++k)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(turned[ring.size() - 1 - k][c], first[k][c], 1e-3f) << k;
}

// A camera that is missing for a while leaves the others' gains alone, and has its own when it returns.
TEST(ColourBalance, MissingCamerasAreRemembered) {
  Ring ring;
  ring.set(2, darker);
  ColourBalance balance;
  const std::vector<Vec3f> before = ring.gains(balance, 1.0);
  std::vector<Vec3f> without;
  for (int i = 0; i < 10; ++i) without = ring.gains(balance, 1.2 + 0.2 * i, 2.0, 2);
  ASSERT_EQ(without.size(), 5u);
  for (std::size_t k = 0; k < 5; ++k)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(without[k][c], before[k < 2 ? k : k + 1][c], 0.01f) << k;
  const std::vector<Vec3f> after = ring.gains(balance, 3.1);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[2][c], before[2][c], 0.01f);
}

// Cameras that share nothing keep their colours, and so does one alone or without a picture.
TEST(ColourBalance, NothingInCommon) {
  Ring ring(2);
  ring.set(0, darker);
  ColourBalance balance;
  for (const Vec3f& gain : ring.gains(balance, 0.0))
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(gain[c], 1.0f, 1e-6f);
  ColourBalance alone;
  EXPECT_EQ(ring.gains(alone, 0.0, 2.0, 1), std::vector<Vec3f>{Vec3f(1.0f)});
  Mesh empty;
  TextureSettings settings;
  settings.balance = true;
  texture_mesh(empty, settings);
  EXPECT_TRUE(empty.texturing->gains.empty());
}

// A picture far darker is no twin of the others': its gain has a limit.
TEST(ColourBalance, GainsHaveALimit) {
  Ring ring;
  ring.set(3, Vec3f(0.25f));
  ColourBalance balance;
  EXPECT_NEAR(ring.gains(balance, 0.0)[3].y, 2.0f, 1e-5f);
}

}  // namespace
}  // namespace polyhull::test
