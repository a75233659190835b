// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/compositor.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "base/error.h"
#include "gl_context.h"
#include "render/program.h"
#include "render/shader_sources.h"
#include "simple_trace.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using testing::HeadlessContext;

constexpr Vec3f ambient(0.35f, 0.33f, 0.3f);

/// A figure in the small room with all that a composite and its truth need.
struct Stage {
  std::shared_ptr<const Scene> scene;
  synthetic::Photographed subject;
  Frame frame;
  Picture background;

  explicit Stage(int width = 640, int height = 360, bool polished = true) {
    scene = std::make_shared<const Scene>(synthetic::small_room(polished));
    const Hull hull = synthetic::figure(20);
    subject =
        synthetic::photographed(hull, synthetic::ring(4, 3.2, 1.5, {0, 1, 0}, 512, 512, 45.0));
    std::vector<Camera> cameras;
    for (const MeshView& view : subject.mesh.views) cameras.push_back(view.calibration);
    subject.mesh.texturing = texture_hull(hull, cameras);
    frame.width = width;
    frame.height = height;
    frame.viewport = synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.9, 0.0}, width, height, 50.0);
    frame.scene = scene;
    frame.lights = scene->lights;
    frame.exposure = scene->exposure;
    frame.ambient = ambient;
    frame.subjects.push_back({&subject.mesh, {}, 0});
  }
  void trace_background(int light_side = 8, int pixel_side = 2) {
    background =
        synthetic::SimpleTrace(*scene, ambient).draw(frame.viewport, light_side, pixel_side);
  }
  Picture truth(int light_side = 8, int pixel_side = 2) const {
    synthetic::SimpleTrace trace(*scene, ambient);
    const Plan plan = plan_frame(frame, {}, {});
    const Mat4 back = plan.subjects[0].from_scene;
    trace.add_subject(plan.subjects[0].points, subject.mesh.hull.triangles, [back](const Vec3f& p) {
      return synthetic::paint(Vec3(back * Vec4(Vec3(p), 1.0)));
    });
    return trace.draw(frame.viewport, light_side, pixel_side);
  }
};

/// Renders \p stage over its background.
Picture composite(Compositor& compositor, const Stage& stage, const RenderSettings& settings) {
  Picture out = stage.background;
  const Plan plan = compositor.plan(stage.frame, settings);
  compositor.render(stage.frame, plan, settings, stage.background.pixels.data(),
                    4 * stage.background.width, out.pixels.data(), 4 * out.width);
  return out;
}

/// Keeps pictures for looking at where POLYHULL_PICTURES names a folder.
void keep(const Picture& picture, const std::string& name) {
  if (const char* folder = std::getenv("POLYHULL_PICTURES"))
    save_picture(picture, std::string(folder) + "/" + name + ".png");
}

class CompositorTest : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    context_ = std::make_unique<HeadlessContext>(GetParam());
    if (!context_->ready()) GTEST_SKIP() << context_->why();
  }
  std::unique_ptr<HeadlessContext> context_;
};

TEST_P(CompositorTest, StandsInTheSceneLikeTheTruth) {
  Stage stage;
  stage.trace_background();
  const Picture truth = stage.truth();
  Compositor compositor;
  std::printf("%s\n", compositor.description().c_str());
  RenderSettings settings;
  if (const char* q = std::getenv("Q")) settings.shadow = static_cast<ShadowQuality>(std::atoi(q));
  if (const char* q = std::getenv("N")) settings.light_samples = std::atoi(q);
  if (const char* q = std::getenv("M")) settings.shadow_map_size = std::atoi(q);
  const Picture result = composite(compositor, stage, settings);
  keep(stage.background, "background");
  keep(truth, "truth");
  keep(result, "composite");
  const double whole = synthetic::psnr(result, truth, [](int, int) { return true; });
  const double without = synthetic::psnr(stage.background, truth, [](int, int) { return true; });
  std::printf("PSNR of the whole picture %.2f dB (background alone %.2f dB)\n", whole, without);
  EXPECT_GT(whole, without + 6.0);
  for (const RenderStatistics::PassTime& pass : compositor.statistics().passes)
    std::printf("  %-12s cpu %.2f ms\n", pass.name, pass.cpu_milliseconds);
}

TEST_P(CompositorTest, Speed) {
  Stage stage(1280, 720);
  stage.trace_background(2, 1);
  RenderSettings settings;
  if (const char* q = std::getenv("Q")) settings.shadow = static_cast<ShadowQuality>(std::atoi(q));
  if (const char* q = std::getenv("N")) settings.light_samples = std::atoi(q);
  if (const char* q = std::getenv("M")) settings.shadow_map_size = std::atoi(q);
  Compositor compositor;
  double best = 1e9;
  std::vector<RenderStatistics::PassTime> passes;
  for (int i = 0; i < 12; ++i) {
    stage.frame.viewport =
        synthetic::look_at({1.3 + 0.01 * i, 1.5, 4.2}, {0.0, 0.9, 0.0}, 1280, 720, 50.0);
    const auto start = std::chrono::steady_clock::now();
    composite(compositor, stage, settings);
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (i > 3 && ms < best) best = ms, passes = compositor.statistics().passes;
  }
  const Plan plan = compositor.plan(stage.frame, {});
  std::printf("1280x720: %.1f ms; subject %dx%d, shadow %dx%d, mirror %dx%d\n", best,
              plan.subject.width, plan.subject.height, plan.shadow.width, plan.shadow.height,
              plan.mirror.width, plan.mirror.height);
  for (const RenderStatistics::PassTime& pass : passes)
    std::printf("  %-12s cpu %6.2f ms gpu %6.2f ms\n", pass.name, pass.cpu_milliseconds,
                pass.gpu_milliseconds);
}

INSTANTIATE_TEST_SUITE_P(Api, CompositorTest, ::testing::Values(false, true),
                         [](const auto& info) { return info.param ? "Embedded" : "Desktop"; });

}  // namespace
}  // namespace polyhull
