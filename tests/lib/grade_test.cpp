// SPDX-License-Identifier: LGPL-2.1-or-later
// Colour decisions on subjects: each pixel against the definition, in mirrors, at soft edges.
#include "render/grade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "backend.h"
#include "shot.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::plain_box;
using synthetic::point_lamp;
using synthetic::Shot;

/// The release 1.2 formulas, in doubles and a channel after the other.
Vec3 decided(const Grade& grade, const Vec3& in) {
  const auto clamped = [](double v) { return std::min(std::max(v, 0.0), 1.0); };
  double v[3];
  for (int c = 0; c < 3; ++c)
    v[c] = std::pow(clamped(in[c] * grade.slope[c] + grade.offset[c]), double(grade.power[c]));
  const double luma = 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
  Vec3 out;
  for (int c = 0; c < 3; ++c) out[c] = clamped(luma + grade.saturation * (v[c] - luma));
  return out;
}

const Grade grades[] = {{Vec3f(0.5f)},
                        {{2.0f, 1.0f, 0.6f}},
                        {Vec3f(1.0f), {0.05f, -0.05f, 0.1f}},
                        {Vec3f(1.0f), Vec3f(0.0f), {0.6f, 1.0f, 2.2f}},
                        {Vec3f(1.0f), Vec3f(0.0f), Vec3f(1.0f), 0.0f},
                        {{2.0f, 0.5f, 1.6f}, {-0.2f, 0.1f, 0.05f}, {0.8f, 1.3f, 1.0f}, 1.7f}};

using GradeTest = testing::BackendTest;

// Of a wall with all kinds of colours that fills the picture: as the definition says of the picture
// without, to what that is rounded to.
TEST_P(GradeTest, IsTheDecisionListsOnLinearLight) {
  Hull hull;
  synthetic::add_box(hull, {-0.6f, 0.4f, -0.04f}, {0.6f, 1.6f, 0.0f});
  const std::vector<Camera> cameras = synthetic::ring(1, 1.5, 1.0, {0, 1, 0}, 256, 256, 60.0);
  synthetic::Photographed wall = synthetic::photographed(hull, cameras);
  wall.mesh.texturing = texture_hull(hull, cameras, {.metric = TextureMetric::camera_normal});
  Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), wall.mesh,
            synthetic::look_at({0, 1, 1.2}, {0, 1, 0}, 96, 96, 40.0));
  shot.settings.edge_samples = 1;  // a mean of graded samples is no graded mean
  shot.draw(0.2f);
  const Picture before = shot.picture;
  for (const Grade& grade : grades) {
    // Each picture of OpenGL's takes a second or more.
    if (!processor() && &grade != &grades[3] && &grade != &grades[5]) continue;
    shot.frame.subjects[0].grade = grade;
    shot.draw(0.2f);
    double worst = 0.0;
    for (std::size_t i = 0; i < before.pixels.size(); i += 4) {
      // Each channel of the result grows or falls with each that it is made of.
      double low[3] = {1, 1, 1}, high[3] = {0, 0, 0};
      for (int corner = 0; corner < 8; ++corner) {
        Vec3 in;
        for (int c = 0; c < 3; ++c)
          in[c] = synthetic::to_linear(
              (static_cast<float>(before.pixels[i + c]) + (corner >> c & 1 ? 0.6f : -0.6f)) /
              255.0f);
        const Vec3 out = decided(grade, in);
        for (int c = 0; c < 3; ++c) {
          low[c] = std::min(low[c], out[c]);
          high[c] = std::max(high[c], out[c]);
        }
      }
      for (int c = 0; c < 3; ++c) {
        const double found = shot.picture.pixels[i + c];
        worst = std::max({worst, found - 255.0 * synthetic::to_srgb(static_cast<float>(high[c])),
                          255.0 * synthetic::to_srgb(static_cast<float>(low[c])) - found});
      }
    }
    EXPECT_LT(worst, 1.0) << "levels, grade " << &grade - grades;
  }
}

// The mirror image is graded with the subject, and nothing else is.
TEST_P(GradeTest, HoldsInMirrorsAndLeavesTheRest) {
  Material metal;
  metal.base_colour = Vec3f(0.8f);
  metal.metallic = 1.0f;
  metal.roughness = 0.0f;
  const Mesh box = plain_box({-0.3f, 0.2f, -0.2f}, {0.3f, 0.7f, 0.2f}, 0.7f);
  Shot shot(floor_scene(metal, point_lamp({0, 3, 1}, Vec3f(2.0f))), box,
            synthetic::look_at({0, 1.2, 2.4}, {0, 0.1, 0}, 160, 160, 50.0));
  const Vec3 own(0.1, 0.4, 0.2), image(0.1, -0.4, 0.2);
  const float background = shot.draw(0.1f);
  const Picture before = shot.picture;
  const Vec3f plain = shot.at(own), mirrored = shot.at(image);
  ASSERT_GT(mirrored.x, 1.5f * background);
  shot.frame.subjects[0].grade = {{0.2f, 0.5f, 1.0f}, Vec3f(0.02f), Vec3f(1.3f)};
  shot.draw(0.1f);
  const Vec3 expected = decided(shot.frame.subjects[0].grade, Vec3(plain));
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(shot.at(own)[c], expected[c], 0.005) << c;
    EXPECT_NEAR(shot.at(image)[c], mirrored[c] * expected[c] / plain[c], 0.005) << c;
  }
  // Where neither of them is, nothing is another byte.
  shot.frame.subjects[0].grade = {Vec3f(0.0f), Vec3f(1.0f)};
  shot.draw(0.1f);
  int same = 0;
  for (std::size_t i = 0; i < before.pixels.size(); i += 4) {
    const bool dim = before.pixels[i] <= std::lround(255.0f * synthetic::to_srgb(background));
    same += dim;
    if (dim) {
      EXPECT_TRUE(std::equal(&before.pixels[i], &before.pixels[i] + 4, &shot.picture.pixels[i]))
          << i / 4;
    }
  }
  EXPECT_GT(same, 10000);
}

// A subject that is graded to the background's own grey cannot be seen, soft edges and all.
TEST_P(GradeTest, SoftEdgesKeepTheirCoverage) {
  const std::vector<Camera> cameras = synthetic::ring(3, 3.2, 1.2, {0, 1, 0}, 200, 200, 50.0);
  synthetic::Photographed figure = synthetic::photographed(synthetic::figure(8), cameras);
  figure.mesh.texturing = texture_hull(figure.mesh.hull, cameras, {});
  Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), figure.mesh,
            synthetic::look_at({0.4, 1.2, 3.1}, {0, 1, 0}, 160, 160, 45.0));
  shot.settings.shadow = ShadowQuality::off;
  shot.settings.mirror = MirrorMode::off;
  shot.settings.soft_edges = true;
  const float grey = shot.draw(0.2f);
  int edges = 0, worst = 0;
  const auto code = static_cast<int>(std::lround(255.0f * synthetic::to_srgb(grey)));
  for (const std::uint8_t byte : shot.picture.pixels) edges += std::abs(byte - code) > 3;
  EXPECT_GT(edges, 2000) << "the subject is seen as it is";
  shot.frame.subjects[0].grade = {Vec3f(0.0f), Vec3f(grey)};
  shot.draw(0.2f);
  for (std::size_t i = 0; i < shot.picture.pixels.size(); ++i)
    if (i % 4 != 3) worst = std::max(worst, std::abs(shot.picture.pixels[i] - code));
  EXPECT_LE(worst, 2);
}

INSTANTIATE_TEST_SUITE_P(Api, GradeTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
