// SPDX-License-Identifier: LGPL-2.1-or-later
// After one turn before cameras on one side the back is known, limbs that swing take nothing from the
// trunk, and what cannot be trusted is not.
#include "texture/colour/colour_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "base/picture.h"
#include "mesh/texture_mesh.h"
#include "raytrace/ray_caster.h"
#include "synthetic.h"

namespace polyhull {
namespace {

constexpr double pi = std::numbers::pi;

Mat3 turn_y(double a) {
  return Mat3(Vec3(std::cos(a), 0, -std::sin(a)), Vec3(0, 1, 0), Vec3(std::sin(a), 0, std::cos(a)));
}
Mat3 turn_x(double a) {
  return Mat3(Vec3(1, 0, 0), Vec3(0, std::cos(a), std::sin(a)), Vec3(0, -std::sin(a), std::cos(a)));
}

using Paint = std::function<Vec3f(const Vec3f& at_rest)>;

/// Spots of two sizes; nowhere like elsewhere.
Vec3f spots(const Vec3f& p) {
  const auto wave = [&](float x, float y, float z, float phase) {
    return std::sin(x * p.x + y * p.y + z * p.z + phase);
  };
  return 127.0f + 55.0f * Vec3f(wave(19, 7, 4, 0), wave(5, 23, -8, 1), wave(-6, 9, 21, 2)) +
         40.0f * Vec3f(wave(3, 2, 7, 3), wave(6, -3, 2, 4), wave(2, 5, -5, 5));
}

/// A painted body whose parts move, before cameras, one instant after the other.
class Stage {
 public:
  Stage(Hull rest, std::vector<Camera> cameras)
      : rest_(std::move(rest)), cameras_(std::move(cameras)) {}

  /// The next instant: vertices at \p place, in \p paint.
  void show(const std::function<Vec3f(std::size_t vertex)>& place, const Paint& paint,
            int threads = 0) {
    Hull hull = rest_;
    for (std::size_t v = 0; v < hull.vertices.size(); ++v) hull.vertices[v] = place(v);
    colours_.clear();
    for (const Vec3f& p : rest_.vertices) colours_.push_back(paint(p));
    RayCaster caster;
    caster.add_mesh(hull.vertices, hull.triangles);
    caster.commit();
    pictures_.clear();
    Mesh mesh;
    mesh.hull = hull;
    mesh.capture_time = time_ += 40'000'000;
    for (const Camera& camera : cameras_) pictures_.push_back(photograph(caster, camera, paint));
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      MeshView view;
      view.calibration = cameras_[k];
      view.view.camera = cameras_[k].name;
      view.view.width = pictures_[k].width;
      view.view.height = pictures_[k].height;
      view.view.roi = {0, 0, pictures_[k].width, pictures_[k].height};
      view.view.format = PixelFormat::rgba;
      view.view.stride = 4 * pictures_[k].width;
      view.view.pixels = pictures_[k].pixels;
      mesh.views.push_back(std::move(view));
    }
    Mesh plain = mesh;
    TextureSettings settings{.metric = TextureMetric::camera_normal};
    settings.threads = threads;
    without_.texture(plain, settings);
    settings.memory = true;
    with_.texture(mesh, settings);
    remembered_ = mesh.texturing->fill;
    filled_ = plain.texturing->fill;
    weights_ = plain.texturing->weights;
  }

  /// By how many dB memory betters the fill of what no camera sees.
  double gain() const {
    double off[2] = {1e-9, 1e-9};
    for (std::size_t v = 0; v < filled_.size(); ++v) {
      bool seen = false;
      for (std::size_t k = 0; k < cameras_.size(); ++k)
        seen = seen || weights_[v * cameras_.size() + k] > 0.0f;
      if (seen) continue;
      for (int c = 0; c < 3; ++c) {
        off[0] += std::pow((filled_[v] >> 8 * c & 255) - colours_[v][c], 2.0);
        off[1] += std::pow((remembered_[v] >> 8 * c & 255) - colours_[v][c], 2.0);
      }
    }
    return 10.0 * std::log10(off[0] / off[1]);
  }
  void wait(double seconds) { time_ += static_cast<std::int64_t>(1e9 * seconds); }
  const MemoryStatistics& statistics() const { return with_.memory_statistics(); }
  const std::vector<std::uint32_t>& remembered() const { return remembered_; }
  const std::vector<std::uint32_t>& filled() const { return filled_; }
  const Hull& rest() const { return rest_; }
  MeshTexturer& texturer() { return with_; }

 private:
  Picture photograph(RayCaster& caster, const Camera& camera, const Paint& paint) const {
    Picture out{camera.width, camera.height, 4, {}};
    out.pixels.assign(static_cast<std::size_t>(camera.width) * camera.height * 4, 0);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const RayHit hit =
            caster.intersect({Vec3f(camera.centre()), 0.0f, Vec3f(camera.ray({x, y}))});
        if (!hit.hit()) continue;
        const std::uint32_t* t = &rest_.triangles[3 * static_cast<std::size_t>(hit.triangle)];
        const Vec3f rest = (1.0f - hit.u - hit.v) * rest_.vertices[t[0]] +
                           hit.u * rest_.vertices[t[1]] + hit.v * rest_.vertices[t[2]];
        const Vec3f colour = paint(rest);
        for (int c = 0; c < 3; ++c)
          out.row(y)[4 * x + c] = static_cast<std::uint8_t>(std::lround(colour[c]));
        out.row(y)[4 * x + 3] = 255;
      }
    return out;
  }

  Hull rest_;
  std::vector<Camera> cameras_;
  std::vector<Vec3f> colours_;
  std::vector<Picture> pictures_;
  MeshTexturer with_, without_;
  std::vector<std::uint32_t> remembered_, filled_;
  std::vector<float> weights_;
  std::int64_t time_ = 0;
};

/// A quarter of a circle before the body.
std::vector<Camera> one_side() {
  std::vector<Camera> cameras;
  for (const double a : {-0.25 * pi, 0.25 * pi}) {
    cameras.push_back(
        synthetic::look_at({2.5 * std::sin(a), 1.3, 2.5 * std::cos(a)}, {0, 1, 0}, 128, 128, 25.0));
    cameras.back().name = "cam" + std::to_string(cameras.size());
  }
  return cameras;
}

Hull trunk() {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0, 1, 0}, {0.3f, 0.42f, 0.2f}, 40);
  return hull;
}

constexpr int turn = 60;  // instants

void turn_once(Stage& stage, int from, int to, const std::function<Paint(int)>& paint,
               int threads = 0) {
  for (int n = from; n < to; ++n) {
    const Mat3 turned = turn_y(2.0 * pi * n / turn);
    stage.show([&](std::size_t v) { return Vec3f(turned * Vec3(stage.rest().vertices[v])); },
               paint(n), threads);
  }
}

const auto painted = [](int) { return Paint(spots); };

// Nothing is remembered at first; after the turn the back is.
TEST(ColourMemory, AfterATurnTheBackIsKnown) {
  Stage stage(trunk(), one_side());
  turn_once(stage, 0, 1, painted);
  EXPECT_EQ(stage.remembered(), stage.filled());
  turn_once(stage, 1, turn, painted);
  double sum = 0.0;
  for (int n = turn; n < turn + 10; ++n) {
    turn_once(stage, n, n + 1, painted);
    sum += stage.gain() / 10.0;
  }
  std::printf("%.2f dB, trust %.2f, %zu points, error %.1f, %.1f without\n", sum,
              stage.statistics().trust, stage.statistics().points, stage.statistics().error,
              stage.statistics().error_without);
  EXPECT_GT(sum, 3.0);
  EXPECT_GT(stage.statistics().trust, 0.4);
  EXPECT_GT(stage.statistics().vertices, 300u);
  EXPECT_LT(stage.statistics().points, 9000u);
}

// A walk: the trunk sways, arms and legs swing beside it and hide it and each other. At no instant is
// memory worse than without.
TEST(ColourMemory, WalkingIsNeverWorse) {
  Hull body;
  struct Part {
    std::size_t end;
    double swing;
    Vec3 joint;
  };
  std::vector<Part> parts;
  const auto add = [&](const Vec3f& centre, const Vec3f& radii, int stacks, double swing) {
    synthetic::add_ellipsoid(body, centre, radii, stacks);
    parts.push_back({body.vertices.size(), swing, Vec3(centre) + Vec3(0, radii.y, 0)});
  };
  add({0, 1.25f, 0}, {0.2f, 0.36f, 0.14f}, 32, 0.0);
  add({-0.28f, 1.2f, 0}, {0.06f, 0.32f, 0.06f}, 24, 0.5);
  add({0.28f, 1.2f, 0}, {0.06f, 0.32f, 0.06f}, 24, -0.5);
  add({-0.11f, 0.5f, 0}, {0.09f, 0.42f, 0.09f}, 24, -0.4);
  add({0.11f, 0.5f, 0}, {0.09f, 0.42f, 0.09f}, 24, 0.4);
  std::vector<Camera> four = synthetic::ring(4, 2.8, 1.3, {0, 0.95, 0}, 200, 200, 40.0);
  for (const bool around : {false, true}) {
    std::vector<Camera> cameras = four;
    if (!around) cameras.resize(2);
    Stage stage(body, cameras);
    double least = 99.0, sum = 0.0;
    for (int n = 0; n < 50; ++n) {
      const double phase = 2.0 * pi * n / 25.0;
      const Mat3 sway = turn_y(0.9 * std::sin(0.3 * phase));
      stage.show(
          [&](std::size_t v) {
            std::size_t k = 0;
            while (v >= parts[k].end) ++k;
            const Mat3 swing = turn_x(parts[k].swing * std::sin(phase));
            const Vec3 own = swing * (Vec3(body.vertices[v]) - parts[k].joint) + parts[k].joint;
            return Vec3f(sway * own + Vec3(0, 0.02 * std::sin(2.0 * phase), 0.02 * n / 5.0));
          },
          spots);
      least = std::min(least, stage.gain());
      sum += stage.gain() / 50.0;
    }
    std::printf("%.2f dB, least %.2f, trust %.2f, error %.1f, %.1f without\n", sum, least,
                stage.statistics().trust, stage.statistics().error,
                stage.statistics().error_without);
    EXPECT_GT(least, -0.1);
    EXPECT_GT(sum, around ? 0.01 : -0.01);
  }
}

// What changes its colours whenever it is hidden cannot be remembered, which what is seen again tells.
TEST(ColourMemory, WhatIsWrongIsNotTrusted) {
  Stage stage(trunk(), one_side());
  turn_once(stage, 0, turn, [](int n) {
    return [n](const Vec3f& p) {
      // How often the point has passed the middle of the back.
      const double passed =
          std::floor((std::atan2(p.x, p.z) + 2.0 * pi * n / turn + pi) / (2.0 * pi));
      return spots(p + static_cast<float>(passed) * Vec3f(0.9f, 0.7f, 0.4f));
    };
  });
  std::printf("trust %.2f, %.1f, %.1f without\n", stage.statistics().trust,
              stage.statistics().error, stage.statistics().error_without);
  EXPECT_LT(stage.statistics().trust, 0.05);
  EXPECT_GT(stage.gain(), -0.1);
}

// A cut: another subject, elsewhere. A flush, time that goes back, and a long pause forget, too.
TEST(ColourMemory, BeginsAnew) {
  Stage stage(trunk(), one_side());
  turn_once(stage, 0, 27, painted);
  EXPECT_GT(stage.statistics().trust, 0.0);
  const std::size_t points = stage.statistics().points;
  stage.show([&](std::size_t v) { return stage.rest().vertices[v] + Vec3f(0.25f, 0.1f, -0.3f); },
             [](const Vec3f& p) { return Vec3f(255.0f) - spots(p); });
  EXPECT_EQ(stage.statistics().trust, 0.0);
  EXPECT_LT(stage.statistics().points, points);
  EXPECT_EQ(stage.remembered(), stage.filled());
  const auto forgotten = [&](const auto& how) {
    turn_once(stage, 30, 40, painted);
    const std::size_t known = stage.statistics().points;
    how();
    turn_once(stage, 40, 41, painted);
    EXPECT_LT(stage.statistics().points, known);
    EXPECT_EQ(stage.statistics().trust, 0.0);
    EXPECT_EQ(stage.remembered(), stage.filled());
  };
  forgotten([&] { stage.wait(2.5); });
  forgotten([&] { stage.wait(-5.0); });
  forgotten([&] { stage.texturer().forget(); });
}

TEST(ColourMemory, TheSameForAnyNumberOfThreads) {
  Stage one(trunk(), one_side()), seven(trunk(), one_side());
  turn_once(one, 0, 27, painted, 1);
  turn_once(seven, 0, 27, painted, 7);
  EXPECT_GT(one.statistics().trust, 0.0);
  EXPECT_NE(one.remembered(), one.filled());
  EXPECT_EQ(one.remembered(), seven.remembered());
}

// Nothing to see, nothing to remember; and a mesh in between that is empty.
TEST(ColourMemory, NothingThere) {
  Stage stage(trunk(), one_side());
  turn_once(stage, 0, 1, painted);
  const std::size_t points = stage.statistics().points;
  EXPECT_GT(points, 0u);
  TextureSettings settings;
  settings.memory = true;
  Mesh empty;
  stage.texturer().texture(empty, settings);
  EXPECT_TRUE(empty.texturing->fill.empty());
  EXPECT_EQ(stage.statistics().points, 0u);
  turn_once(stage, 1, 2, painted);
  EXPECT_GE(stage.statistics().points, points);
}

}  // namespace
}  // namespace polyhull
