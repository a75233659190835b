// SPDX-License-Identifier: LGPL-2.1-or-later
// A figure that stands still before noisy cameras, from their pictures to the composite.
#include <gtest/gtest.h>

#include <cstdlib>

#include "base/picture.h"
#include "builtin/default_rig.h"
#include "builtin/room.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "render/processor/processor_renderer.h"
#include "silhouette/silhouette.h"
#include "studio/cameras/camera_picture.h"
#include "texture/texture_hull.h"
#include "view/background.h"

namespace polyhull {
namespace {

constexpr int width = 1280, height = 720;

/// Four cameras, and all that follows them, as pipelines/demo.sh has it.
struct Chain {
  Rig rig = default_rig();
  std::vector<CameraPicture> cameras;
  std::vector<Silhouetter> silhouetters;
  HullStage hull;
  HullTexturer texturer;
  ProcessorRenderer renderer;
  std::vector<std::vector<std::uint8_t>> pixels;
  Mesh mesh;
  RenderFrame frame;
  RenderSettings settings;
  int reused = 0;  // hulls and their texturing that were the last ones
  Picture background{width, height, 4, std::vector<std::uint8_t>(width* height * 4, 128)};

  explicit Chain(const SilhouetteSettings& s) {
    const auto subject = open_subject("figure");
    for (int k = 0; k < 4; ++k) {
      cameras.emplace_back(rig, k, subject);
      silhouetters.emplace_back();
      silhouetters.back().set(s);
    }
    pixels.resize(4);
    mesh.views.resize(4);
    frame.width = width;
    frame.height = height;
    frame.scene = std::make_shared<const Scene>(room_scene());
    frame.lights = frame.scene->lights;
    frame.exposure = frame.scene->exposure;
    frame.viewport = look_at({1.35, 1.5, 2.34}, {0.0, 0.9, 0.0}, 50.0, width, height);
    Background room(*frame.scene);
    room.update(frame.viewport, frame.lights, frame.exposure);
    room.write(background.pixels.data(), 4 * width, 0);
  }

  Picture next(double seconds, std::uint64_t number) {
    PictureLook look;
    look.screen = {{44, 168, 66}, 0.15};
    look.shadow = 0.3;
    look.spill = 0.3;
    look.noise = 2.0;
    std::vector<std::uint8_t> rgba(1024 * 768 * 4);
    std::vector<CameraContours> contours;
    for (std::size_t k = 0; k < 4; ++k) {
      cameras[k].set_time(seconds);
      cameras[k].picture(look, number, false, rgba.data(), 4096);
      FrameView view;
      view.format = FrameFormat::rgba;
      view.width = 1024;
      view.height = 768;
      view.planes[0] = rgba.data();
      view.strides[0] = 4096;
      View& v = mesh.views[k].view;
      const Rings& rings = silhouetters[k].process(view);
      v.contours = rings;
      v.roi = bounding_rectangle(rings, 1024, 768);
      v.width = 1024;
      v.height = 768;
      v.format = PixelFormat::rgba;
      v.stride = 4 * v.roi.width;
      pixels[k].resize(static_cast<std::size_t>(v.stride) * v.roi.height);
      silhouetters[k].write_rgba(view, v.roi, pixels[k].data(), v.stride);
      v.pixels = pixels[k];
      mesh.views[k].calibration = rig.cameras[k];
      contours.push_back({&rig.cameras[k], &v.contours});
    }
    mesh.hull = hull.build(contours, {}, 0.0);
    mesh.texturing =
        texturer.texture(mesh.hull, rig.cameras, {.metric = TextureMetric::camera_normal});
    reused += hull.statistics().reused && texturer.statistics().reused;
    frame.subjects = {{&mesh, {}, 0}};
    Picture out = background;
    const RenderPlan plan = renderer.plan(frame, settings);
    renderer.render(frame, plan, settings, background.pixels.data(), 4 * width, out.pixels.data(),
                    4 * width);
    return out;
  }
};

/// How many pixels differ by more than 32 levels.
int flicker(const Picture& a, const Picture& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
    int most = 0;
    for (std::size_t c = 0; c < 3; ++c)
      most = std::max(most, std::abs(a.pixels[i + c] - b.pixels[i + c]));
    count += most > 32;
  }
  return count;
}

SilhouetteSettings settings() {
  SilhouetteSettings s;
  s.blur.sigma = 1.5;
  s.approximate.tolerance = 0.7;
  s.approximate.min_area = 100;
  return s;
}

/// How many pixels of each frame differ from the frame before.
std::vector<int> flickering(Chain& chain, int frames, const char* name) {
  std::vector<int> out;
  Picture last;
  for (int n = 0; n <= frames; ++n) {
    Picture now = chain.next(1.0, static_cast<std::uint64_t>(n));
    if (n > 0) out.push_back(flicker(last, now));
    last = std::move(now);
  }
  std::printf("%s:", name);
  for (const int count : out) std::printf(" %d", count);
  std::printf("\n");
  if (const char* folder = std::getenv("POLYHULL_PICTURES"))
    save_picture(last, std::string(folder) + "/" + name + ".png");
  return out;
}

TEST(StillSubject, DoesNotFlicker) {
  Chain chain(settings());
  for (const int count : flickering(chain, 10, "steady")) EXPECT_LE(count, 50);
  EXPECT_GE(chain.reused, 8);
}

TEST(StillSubject, FlickersWithoutSteadiness) {
  SilhouetteSettings loose = settings();
  loose.steadiness = 0.0;
  Chain chain(loose);
  for (const int count : flickering(chain, 2, "loose")) EXPECT_GE(count, 150);
  EXPECT_EQ(chain.reused, 0);
}

double to_lines(Vec2f p, const Rings& rings) {
  float least = 1e9f;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const auto ring = rings.ring(i);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2f a = ring[k], along = ring[(k + 1) % ring.size()] - a;
      const float t = std::clamp(glm::dot(p - a, along) / glm::dot(along, along), 0.0f, 1.0f);
      least = std::min(least, glm::distance(p, a + t * along));
    }
  }
  return least;
}

// Where the figure walks its contours are those of its own frames, as near as they always are.
TEST(StillSubject, MovingDoesNotLag) {
  const Rig rig = default_rig();
  CameraPicture camera(rig, 0, open_subject("figure"));
  SilhouetteSettings exact = settings();
  exact.approximate.tolerance = 0.0;
  exact.steadiness = 0.0;
  Silhouetter silhouetter, tracer;
  silhouetter.set(settings());
  tracer.set(exact);
  PictureLook look;
  look.screen = {{44, 168, 66}, 0.15};
  look.noise = 2.0;
  std::vector<std::uint8_t> rgba(1024 * 768 * 4);
  FrameView view;
  view.format = FrameFormat::rgba;
  view.width = 1024;
  view.height = 768;
  view.planes[0] = rgba.data();
  view.strides[0] = 4096;
  double most = 0.0;
  for (int n = 0; n < 8; ++n) {
    camera.set_time(1.0 + n / 25.0);
    camera.picture(look, static_cast<std::uint64_t>(n), false, rgba.data(), 4096);
    const Rings& contours = silhouetter.process(view);
    const Rings& line = tracer.process(view);
    for (const Vec2f p : contours.points) most = std::max(most, to_lines(p, line));
    for (const Vec2f p : line.points) most = std::max(most, to_lines(p, contours));
  }
  EXPECT_LE(most, 0.7 + 0.25);
}

}  // namespace
}  // namespace polyhull
