// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/compositor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "backend.h"
#include "base/error.h"
#include "figure_stage.h"
#include "flip.h"
#include "render/gl/objects/gl_objects.h"
#include "render/gl/objects/program.h"
#include "render/gl/objects/shader_sources.h"
#include "simple_trace.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using Stage = synthetic::FigureStage;

Picture composite(Renderer& renderer, const Stage& stage, const RenderSettings& settings) {
  return stage.composite(renderer, settings);
}

/// Keeps pictures for looking at where POLYHULL_PICTURES names a folder.
void keep(const Picture& picture, const std::string& name) {
  if (const char* folder = std::getenv("POLYHULL_PICTURES"))
    save_picture(picture, std::string(folder) + "/" + name + ".png");
}

using CompositorTest = testing::BackendTest;

TEST_P(CompositorTest, EveryShaderCompiles) {
  if (processor()) GTEST_SKIP() << "the processor has no shaders";
  int programs = 0;
  const std::string slots = "VIEW_SLOTS 64", samples = "MAX_LIGHT_SAMPLES 16",
                    lights = "MAX_LIGHTS 8";
  const auto link = [&](const char* vertex, const char* fragment, std::vector<std::string> defines,
                        std::vector<std::string> includes = {}) {
    EXPECT_NO_THROW(gl::Program(vertex, fragment, defines, includes)) << vertex << " " << fragment;
    ++programs;
  };
  for (const char* lens : {"NO_LENS", "DISTORTION"}) {
    link("hull.vert", "hull.frag", {slots, lens});
    link("hull.vert", "hull.frag", {slots, lens, "CLIPPED"});
  }
  link("scene.vert", "depth.frag", {});
  link("scene.vert", "depth.frag", {"CLIPPED"});
  link("hull_depth.vert", "depth.frag", {});
  for (const char* taps : {"0", "4", "16"})
    link("tiles.vert", "shadow.frag",
         {samples, std::string("BLOCKER_TAPS ") + taps, std::string("FILTER_TAPS ") + taps},
         {"place.glsl", "light.glsl"});
  link("tiles.vert", "shadow_blur.frag", {});
  link("scene.vert", "scene_layer.frag", {}, {"material.glsl"});
  link("scene.vert", "scene_layer.frag", {"CLIPPED"}, {"material.glsl"});
  link("fullscreen.vert", "reach.frag", {}, {"place.glsl"});
  link("fullscreen.vert", "shadow_tiles.frag", {});
  link("tiles.vert", "shadow_touched.frag", {});
  link("fullscreen.vert", "depth_picture.frag", {});
  link("fullscreen.vert", "environment.frag", {});
  link("scene.vert", "mirrored_scene.frag", {lights},
       {"material.glsl", "light.glsl", "lamps.glsl"});
  for (const char* step : {"GRID_STEP 1", "GRID_STEP 2"})
    for (const char* layers : {"SHADOW", "MIRROR_SHADOW", "MIRROR", "SUBJECT"})
      for (const char* fill : {"OPAQUE", "FILL"})
        link("tiles.vert", "composite.frag", {step, layers, fill, lights},
             {"light.glsl", "lamps.glsl"});
  // Whatever is in shaders/ is one of these.
  for (const ShaderSource& shader : shader_sources()) {
    const std::string_view known[] = {
        "common.glsl",         "composite.frag",      "depth.frag",         "fullscreen.vert",
        "hull.frag",           "hull.vert",           "hull_depth.vert",    "scene.vert",
        "material.glsl",       "shadow.frag",         "shadow_tiles.frag",  "shadow_blur.frag",
        "mirrored_scene.frag", "tiles.vert",          "place.glsl",         "scene_layer.frag",
        "reach.frag",          "shadow_touched.frag", "depth_picture.frag", "lamps.glsl",
        "light.glsl",          "environment.frag"};
    EXPECT_NE(std::find(std::begin(known), std::end(known), shader.name), std::end(known))
        << shader.name << " is not compiled by this test";
  }
  EXPECT_THROW(gl::Program("hull.vert", "depth.frag", {"VIEW_SLOTS nonsense"}), Error);
}

// Two figures side by side: one hides a part of the other, and their shadows and mirror images meet.
TEST_P(CompositorTest, TwoStandSideBySideLikeTheTruth) {
  Stage stage(480, 270);
  stage.frame.subjects[0].placement.translate = {-0.65, 0.0, -0.2};
  RenderSubject other = stage.frame.subjects[0];
  other.placement = {.translate = {0.6, 0.0, 0.25}, .rotate = {0.0, 40.0, 0.0}};
  stage.frame.subjects.push_back(other);
  stage.trace_background(6, 2);
  static const Picture truth = stage.truth(6, 2);  // of all backends
  const auto renderer = make_renderer();
  const Picture result = composite(*renderer, stage, {});
  keep(truth, "two-truth");
  keep(result, "two");
  const double whole = synthetic::psnr(result, truth);
  std::printf("two figures: %.2f dB (background %.2f)\n", whole,
              synthetic::psnr(stage.background, truth));
  EXPECT_GT(whole, 38.0);
}

TEST_P(CompositorTest, StandsInTheSceneLikeTheTruth) {
  Stage stage(480, 270);
  stage.trace_background(6, 2);
  static const Picture truth = stage.truth(6, 2);  // of all backends
  const auto compositor_renderer = make_renderer();
  Renderer& compositor = *compositor_renderer;
  std::printf("%s\n", compositor.description().c_str());
  const Picture result = composite(compositor, stage, {});
  keep(stage.background, "background");
  keep(truth, "truth");
  keep(result, "composite");
  const double whole = synthetic::psnr(result, truth);
  const double without = synthetic::psnr(stage.background, truth);
  // Of the figure, the regions that it changes without standing there: shadow and mirror image.
  const RenderPlan plan = compositor.plan(stage.frame, {});
  const auto around = [&](int x, int y) {
    const Rectangle& r = plan.subject;
    const bool inside = x >= r.x && x < r.x + r.width && y >= r.y && y < r.y + r.height;
    const std::uint8_t* a = stage.background.row(y) + 4 * x;
    const std::uint8_t* b = truth.row(y) + 4 * x;
    return !inside && std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) > 6;
  };
  const double shaded = synthetic::psnr(result, truth, around);
  const double unshaded = synthetic::psnr(stage.background, truth, around);
  const double flip = synthetic::mean_flip(truth, result);
  std::printf(
      "FLIP %.4f, PSNR whole %.2f dB (background %.2f), shadow and mirror image %.2f dB "
      "(background %.2f)\n",
      flip, whole, without, shaded, unshaded);
  // Measured: 41.00 and 48.67 with OpenGL, 40.98 and 49.33 on the processor.
  EXPECT_GT(whole, 40.5);
  EXPECT_LT(flip, 0.02);
  EXPECT_GT(shaded, processor() ? 48.5 : 48.2);
}

TEST_P(CompositorTest, TakesTheSamePicturesLater) {
  if (processor()) GTEST_SKIP() << "only OpenGL draws while others work";
  Stage stage(320, 180);
  stage.fill_background(90);
  Compositor compositor;
  Picture wanted[3], taken[3];
  unsigned places[3] = {};
  const int stride = 4 * stage.frame.width;
  for (int i = 0; i < 3; ++i) {
    stage.frame.subjects[0].placement.translate = {0.5 * i, 0, 0};
    wanted[i] = composite(compositor, stage, {});
  }
  for (int i = 0; i < 3; ++i) {
    stage.frame.subjects[0].placement.translate = {0.5 * i, 0, 0};
    taken[i] = stage.background;
    const RenderPlan plan = compositor.plan(stage.frame, {});
    places[i] = compositor.start(stage.frame, plan, {}, stage.background.pixels.data(), stride);
    if (i > 0) compositor.take(places[i - 1], taken[i - 1].pixels.data(), stride);
  }
  compositor.take(places[2], taken[2].pixels.data(), stride);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NE(wanted[i].pixels, stage.background.pixels);
    EXPECT_EQ(taken[i].pixels, wanted[i].pixels) << i;
  }
}

TEST_P(CompositorTest, SkippingChangesNoBit) {
  Stage stage(320, 180);
  stage.trace_background(2, 1);
  const auto lazy_renderer = make_renderer(), eager_renderer = make_renderer();
  Renderer &lazy = *lazy_renderer, &eager = *eager_renderer;
  RenderSettings skip, all;
  all.skip = false;
  int untouched = 0, reused = 0;
  const Vec3 eyes[] = {{1.3, 1.5, 4.2}, {1.3, 1.5, 4.2}, {1.3, 1.5, 3.0}, {-2.0, 0.4, 2.0},
                       {0.0, 1.2, 2.2}, {2.0, 2.5, 2.0}, {0.0, 1.0, 3.3}};
  const Vec3 targets[] = {{0, 0.9, 0},      {0, 0.9, 0},      {0, 0.3, 0},    {0, 0.9, 0},
                          {-2.5, 1.5, 2.0}, {2.5, 2.5, -9.0}, {0.0, 1.0, 9.0}};
  for (std::size_t i = 0; i < std::size(eyes); ++i) {
    stage.frame.viewport = synthetic::look_at(eyes[i], targets[i], 320, 180, 55.0);
    stage.frame.subjects[0].content = 1;
    const Picture a = composite(lazy, stage, skip);
    const Picture b = composite(eager, stage, all);
    EXPECT_EQ(a.pixels, b.pixels) << "view " << i;
    untouched += lazy.plan(stage.frame, skip).untouched();
    reused += lazy.statistics().static_shadow_reused;
  }
  EXPECT_GT(untouched, 0);
  EXPECT_GT(reused, 0);
}

// The maps of what the scene itself hides from a lamp stay while subjects move.
TEST_P(CompositorTest, SkippingChangesNoBitUnderAPointLight) {
  Stage stage(320, 180);
  stage.trace_background(1, 1);
  stage.frame.lights[0].u = stage.frame.lights[0].v = Vec3f(0.0f);
  const auto lazy_renderer = make_renderer(), eager_renderer = make_renderer();
  Renderer &lazy = *lazy_renderer, &eager = *eager_renderer;
  RenderSettings skip, all;
  all.skip = false;
  int reused = 0;
  for (int i = 0; i < 3; ++i) {
    stage.frame.subjects[0].placement.translate = Vec3(-0.3 * i, 0.0, 0.2 * i);
    const Picture a = composite(lazy, stage, skip);
    const Picture b = composite(eager, stage, all);
    EXPECT_EQ(a.pixels, b.pixels) << "place " << i;
    reused += lazy.statistics().static_shadow_reused;
  }
  EXPECT_EQ(reused, 2);
}

// Another scene before the same viewport is drawn as a fresh renderer would.
TEST_P(CompositorTest, TheSceneChangesWhileItRuns) {
  Stage stage(320, 180);
  stage.trace_background(1, 1);
  const auto changing_renderer = make_renderer();
  Renderer& changing = *changing_renderer;
  const Picture before = composite(changing, stage, {});
  Scene other = *stage.scene;
  for (SceneMesh& mesh : other.meshes)
    for (Vec3f& p : mesh.positions) p.y -= 0.1f;
  other.mirrors = find_mirrors(other);
  stage.frame.scene = std::make_shared<const Scene>(other);
  const auto fresh_renderer = make_renderer();
  const Picture expected = composite(*fresh_renderer, stage, {});
  EXPECT_NE(before.pixels, expected.pixels);
  EXPECT_EQ(composite(changing, stage, {}).pixels, expected.pixels);
}

// What was kept for a view that went while a layer was off is not of the view that it comes back to.
TEST_P(CompositorTest, LayersThatWereOffWhileTheViewChanged) {
  Stage stage(320, 180);
  stage.trace_background(1, 1);
  stage.frame.subjects[0].content = 1;
  RenderSettings all, no_shadow, no_mirror, plain;
  no_shadow.shadow = ShadowQuality::off;
  no_mirror.mirror = MirrorMode::off;
  plain.mirror = MirrorMode::plain;
  for (const RenderSettings& meanwhile : {no_shadow, no_mirror, plain}) {
    const auto renderer = make_renderer();
    stage.frame.viewport = synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.9, 0.0}, 320, 180, 50.0);
    composite(*renderer, stage, all);
    stage.frame.viewport = synthetic::look_at({0.7, 1.3, 4.0}, {0.1, 0.8, 0.0}, 320, 180, 50.0);
    composite(*renderer, stage, meanwhile);
    const Picture again = composite(*renderer, stage, all);
    const auto fresh_renderer = make_renderer();
    EXPECT_EQ(again.pixels, composite(*fresh_renderer, stage, all).pixels);
  }
}

// Every number of samples draws what it draws at first, whatever was drawn before.
TEST_P(CompositorTest, EdgeSamplesChangeWhileItRuns) {
  Stage stage(320, 180);
  stage.trace_background(1, 1);
  const auto changing_renderer = make_renderer();
  Renderer& changing = *changing_renderer;
  for (const int samples : {4, 0, 4, 1, 2, 0, 8}) {
    RenderSettings settings;
    settings.edge_samples = samples;
    const auto fresh_renderer = make_renderer();
    Renderer& fresh = *fresh_renderer;
    EXPECT_EQ(composite(changing, stage, settings).pixels, composite(fresh, stage, settings).pixels)
        << samples;
  }
}

// A lamp straight above a side of the subject's box: its rays there have no part along x.
TEST_P(CompositorTest, ShadowUnderALampInAPlaneOfTheBox) {
  Stage stage(320, 180);
  RenderPlan plan = plan_frame(stage.frame, {}, {});
  double low = 1e9;
  for (const Vec3f& p : plan.subjects[0].points) low = std::min<double>(low, p.x);
  stage.frame.lights[0].u = stage.frame.lights[0].v = Vec3f(0.0f);
  stage.frame.lights[0].centre = Vec3f(static_cast<float>(low), 2.4f, 0.1f);
  const auto compositor_renderer = make_renderer();
  Renderer& compositor = *compositor_renderer;
  const Rectangle exact = compositor.plan(stage.frame, {}).shadow;
  stage.frame.lights[0].centre.x += 1e-4f;
  const Rectangle beside = compositor.plan(stage.frame, {}).shadow;
  EXPECT_LE(std::abs(exact.x - beside.x), 1);
  EXPECT_LE(std::abs(exact.y + exact.height - beside.y - beside.height), 1);
  EXPECT_LE(std::abs(exact.width - beside.width), 2);
}

TEST_P(CompositorTest, TexturesAndMemoryGiveTheSamePicture) {
  if (processor()) GTEST_SKIP() << "the processor has no textures";
  Stage stage(320, 180);
  stage.trace_background(2, 1);
  Compositor compositor;
  const Picture expected = composite(compositor, stage, {});
  gl::Texture textures[2];
  for (gl::Texture& texture : textures) {
    gl::bind_texture(0, GL_TEXTURE_2D, texture.get());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, 320, 180, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 stage.background.pixels.data());
    gl::texture_parameters(GL_TEXTURE_2D, GL_LINEAR);
  }
  const RenderPlan plan = compositor.plan(stage.frame, {});
  compositor.render(stage.frame, plan, {}, textures[0].get(), textures[1].get());
  gl::Framebuffer framebuffer;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.get());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures[1].get(), 0);
  Picture read = expected;
  glReadPixels(0, 0, 320, 180, GL_RGBA, GL_UNSIGNED_BYTE, read.pixels.data());
  EXPECT_EQ(read.pixels, expected.pixels);
}

TEST_P(CompositorTest, OnlyUsedPicturesAreUploaded) {
  Stage stage(320, 180);
  Hull ball;
  synthetic::add_ellipsoid(ball, {0, 1, 0}, {0.4f, 0.4f, 0.4f}, 12);
  stage.subject =
      synthetic::photographed(ball, synthetic::ring(4, 3.2, 1.0, {0, 1, 0}, 128, 128, 45.0));
  std::vector<Camera> cameras;
  for (const MeshView& view : stage.subject.mesh.views) cameras.push_back(view.calibration);
  TextureSettings direct{.metric = TextureMetric::camera_normal};
  direct.method = TextureMethod::direct;
  stage.subject.mesh.texturing = texture_hull(ball, cameras, direct);
  stage.frame.viewport = synthetic::look_at({0, 1.0, 2.0}, {0.0, 1.0, 0.0}, 320, 180, 50.0);
  stage.trace_background(1, 1);
  const auto compositor_renderer = make_renderer();
  Renderer& compositor = *compositor_renderer;
  RenderSettings settings;
  settings.mirror = MirrorMode::off;
  composite(compositor, stage, settings);
  // The camera behind the ball colours nothing that the viewport sees.
  EXPECT_EQ(compositor.statistics().pictures_skipped, 1u);
  EXPECT_EQ(compositor.statistics().pictures_uploaded, 3u);
  stage.frame.subjects[0].content = 7;
  composite(compositor, stage, settings);
  composite(compositor, stage, settings);
  EXPECT_TRUE(compositor.statistics().mesh_reused);
  EXPECT_TRUE(compositor.statistics().scene_depth_reused);
  EXPECT_EQ(compositor.statistics().pictures_uploaded, 0u);
}

TEST_P(CompositorTest, StrangeInputIsDrawnOrRefused) {
  Stage stage(64, 48);
  stage.background = Picture{64, 48, 4, std::vector<std::uint8_t>(64 * 48 * 4, 100)};
  const auto compositor_renderer = make_renderer();
  Renderer& compositor = *compositor_renderer;
  const auto draw = [&] { return composite(compositor, stage, {}); };
  EXPECT_NO_THROW(draw());
  Stage strange(64, 48);
  const auto views = stage.subject.mesh.views;
  stage.subject.mesh.views.clear();  // no views at all
  EXPECT_NO_THROW(draw());
  stage.subject.mesh.views = views;
  for (MeshView& view : stage.subject.mesh.views) view.view.format = PixelFormat::none;
  EXPECT_NO_THROW(draw());
  stage.subject.mesh.texturing.reset();
  EXPECT_NO_THROW(draw());
  stage.frame.scene.reset();
  EXPECT_NO_THROW(draw());
  stage.frame.scene = stage.scene;
  for (const Vec3& eye : {Vec3(0, 1, 0), Vec3(0, 1, 0.21), Vec3(0, -3, 0.01), Vec3(0.01, 9, 0)}) {
    stage.frame.viewport =
        synthetic::look_at(eye, {0, 1, -3}, 64, 48, 90.0);  // in it, below, above
    EXPECT_NO_THROW(draw());
  }
  for (const Vec3f& place : {Vec3f(0, 1, 0), Vec3f(0, 1.95f, 0), Vec3f(0, 0, 0)}) {
    stage.frame.lights[0].centre = place;  // inside the subject
    EXPECT_NO_THROW(draw());
  }
  stage.frame.lights.clear();
  EXPECT_NO_THROW(draw());
  stage.frame.subjects.clear();
  EXPECT_TRUE(compositor.plan(stage.frame, {}).untouched());
  stage.frame.subjects.push_back({&stage.subject.mesh, {}, 0});
  stage.frame.viewport.K[0][0] = std::nan("");
  EXPECT_THROW(draw(), Error);
}

// What the first frame makes is kept while the viewport zooms: the scene's maps, the mesh and its
// pictures. Prints what the passes of 1280x720 cost.
TEST_P(CompositorTest, ZoomingMakesNothingAnew) {
  Stage stage(1280, 720);
  stage.background = Picture{1280, 720, 4, std::vector<std::uint8_t>(1280 * 720 * 4, 100)};
  stage.frame.subjects[0].content = 1;
  const auto compositor_renderer = make_renderer();
  Renderer& compositor = *compositor_renderer;
  std::uint64_t uploaded = 0;
  for (int i = 0; i < 3; ++i) {
    stage.frame.viewport =
        synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.9, 0.0}, 1280, 720, 50.0 + i);
    composite(compositor, stage, {});
    const RenderStatistics& now = compositor.statistics();
    // The processor asks the scene for the rays of this view only.
    EXPECT_EQ(now.static_shadow_reused, i > 0 && !processor()) << i;
    EXPECT_EQ(now.mesh_reused, i > 0) << i;
    EXPECT_FALSE(now.scene_depth_reused) << i;
    uploaded += now.pictures_uploaded;
  }
  EXPECT_GT(uploaded, 0u);
  EXPECT_LE(uploaded, stage.subject.mesh.views.size());
  composite(compositor, stage, {});
  EXPECT_TRUE(compositor.statistics().scene_depth_reused);
  EXPECT_EQ(compositor.statistics().pictures_uploaded, 0u);
  for (const char* name :
       {"upload", "shadow-maps", "scene-depth", "shadow", "mirror", "subject", "blend"}) {
    const auto& passes = compositor.statistics().passes;
    EXPECT_TRUE(std::any_of(passes.begin(), passes.end(), [name](const auto& pass) {
      return std::string_view(pass.name) == name;
    })) << name;
  }
  for (const RenderStatistics::PassTime& pass : compositor.statistics().passes)
    std::printf("  %-12s cpu %6.2f ms gpu %6.2f ms\n", pass.name, pass.cpu_milliseconds,
                pass.gpu_milliseconds);
}

INSTANTIATE_TEST_SUITE_P(Api, CompositorTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
