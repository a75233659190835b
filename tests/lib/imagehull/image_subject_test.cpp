// SPDX-License-Identifier: LGPL-2.1-or-later
// Subjects drawn from their silhouettes, beside the same drawn by their hull's triangles: body, shadow
// and mirror image.
#include "imagehull/image_subject.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>

#include "base/error.h"
#include "base/thread_pool.h"
#include "render/processor/processor_renderer.h"
#include "support/studio_mesh.h"
#include "support/synthetic.h"
#include "view/background.h"

namespace polyhull {
namespace {

using namespace polyhull::test;

constexpr int width = 640, height = 480;

SilhouetteSettings silhouettes() {
  SilhouetteSettings settings;
  settings.blur.sigma = 1.5;
  settings.approximate.tolerance = 0.7;
  settings.approximate.min_area = 100;
  return settings;
}

/// A figure in a room with a polished floor.
struct Stage {
  Mesh mesh;
  std::shared_ptr<const ImageSubject> image;
  RenderFrame frame;
  RenderSettings settings;
  Picture background{width, height, 4, std::vector<std::uint8_t>(width* height * 4)};
  ProcessorRenderer renderer;

  /// Made once: the pixels stay.
  static const StudioMesh& figure(int cameras) {
    static const StudioMesh four = studio_mesh(ring_rig(4), "figure", 1.0, silhouettes());
    static const StudioMesh five = studio_mesh(ring_rig(5), "figure", 1.0, silhouettes());
    return cameras == 4 ? four : five;
  }
  explicit Stage(int cameras)
      : mesh(figure(cameras).mesh),
        image(std::make_shared<const ImageSubject>(image_subject(mesh))) {
    frame.width = width;
    frame.height = height;
    frame.scene = std::make_shared<const Scene>(synthetic::small_room(true));
    frame.lights = frame.scene->lights;
    frame.exposure = frame.scene->exposure;
    look_from({1.2, 1.6, 3.4});
  }
  void look_from(const Vec3& eye) {
    frame.viewport = synthetic::look_at(eye, {0.0, 0.8, 0.0}, width, height, 50.0);
    static std::map<double, Picture> made;  // by the eye's x: the room's light takes a second
    Picture& known = made[eye.x];
    if (known.pixels.empty()) {
      Background room(*frame.scene);
      room.update(frame.viewport, frame.lights, frame.exposure);
      room.write(background.pixels.data(), 4 * width, 0);
      known = background;
    }
    background = known;
  }
  Picture draw(bool by_image, std::uint64_t content = 0) {
    frame.subjects = {{&mesh, {}, content, by_image ? image : nullptr}};
    Picture out = background;
    const RenderPlan plan = renderer.plan(frame, settings);
    renderer.render(frame, plan, settings, background.pixels.data(), 4 * width, out.pixels.data(),
                    4 * width);
    return out;
  }
};

void save(const Picture& picture, const char* name) {
  if (const char* folder = std::getenv("POLYHULL_PICTURES"))
    save_picture(picture, std::string(folder) + "/" + name + ".png");
}

/// The share of pixels that differ from the background in \p a or \p b by more than 8 levels and from
/// each other by more than \p levels.
double differing(const Picture& a, const Picture& b, const Picture& background, int levels) {
  std::size_t changed = 0, differ = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
    int from_background = 0, apart = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const int p = a.pixels[i + c], q = b.pixels[i + c], r = background.pixels[i + c];
      from_background = std::max({from_background, std::abs(p - r), std::abs(q - r)});
      apart = std::max(apart, std::abs(p - q));
    }
    changed += from_background > 8;
    differ += from_background > 8 && apart > levels;
  }
  EXPECT_GT(changed, a.pixels.size() / 200);
  return static_cast<double>(differ) / static_cast<double>(changed);
}

TEST(ImageSubjectTest, BodyShadowAndMirrorImageAreTheMeshs) {
  Stage stage(4);
  // Of one colour: what differs is where something is seen.
  std::vector<std::uint8_t> colour;
  for (const MeshView& view : stage.mesh.views)
    colour.resize(std::max(colour.size(), view.view.pixels.size()));
  for (std::size_t i = 0; i < colour.size(); ++i)
    colour[i] = std::array<std::uint8_t, 4>{230, 153, 26, 255}[i % 4];
  for (MeshView& view : stage.mesh.views)
    view.view.pixels = std::span(colour).first(view.view.pixels.size());
  stage.mesh.texturing->fill.clear();
  stage.mesh.texturing->untextured = Vec3f(230.0f, 153.0f, 26.0f) / 255.0f;
  stage.image = std::make_shared<const ImageSubject>(image_subject(stage.mesh));
  for (const Vec3& eye : {Vec3(1.2, 1.6, 3.4), Vec3(-2.2, 0.7, 1.5)}) {
    stage.look_from(eye);
    const Picture mesh = stage.draw(false);
    EXPECT_FALSE(stage.renderer.statistics().mirror_skipped);
    const Picture image = stage.draw(true);
    save(mesh, eye.x > 0.0 ? "plain-mesh-right" : "plain-mesh-left");
    save(image, eye.x > 0.0 ? "plain-image-right" : "plain-image-left");
    EXPECT_LT(differing(mesh, image, stage.background, 24), 0.002) << eye.x;
    EXPECT_LT(differing(mesh, image, stage.background, 4), 0.01) << eye.x;
  }
}

TEST(ImageSubjectTest, ColoursAreThoseOfTheMesh) {
  Stage stage(5);
  const Picture mesh = stage.draw(false), image = stage.draw(true);
  save(mesh, "mesh");
  save(image, "image");
  EXPECT_LT(differing(mesh, image, stage.background, 24), 0.05);
  EXPECT_LT(differing(mesh, image, stage.background, 64), 0.01);
}

TEST(ImageSubjectTest, SamplesSmoothItsEdges) {
  Stage stage(4);
  stage.settings.edge_samples = 1;
  const Picture hard = stage.draw(true);
  stage.settings.edge_samples = 8;
  const Picture smooth = stage.draw(true);
  stage.settings.edge_samples = 4;
  const Picture four = stage.draw(true);
  const double hard_off = differing(smooth, hard, stage.background, 24);
  EXPECT_GT(hard_off, 0.01);
  EXPECT_LT(differing(smooth, four, stage.background, 24), 0.3 * hard_off);
}

TEST(ImageSubjectTest, ThePictureIsTheSameHoweverItIsMade) {
  Stage stage(4);
  const Picture first = stage.draw(true, 7);
  EXPECT_EQ(stage.draw(true, 7).pixels, first.pixels);  // all that is kept is right
  EXPECT_TRUE(stage.renderer.statistics().mesh_reused);
  const Picture mesh = stage.draw(false, 7);
  EXPECT_FALSE(stage.renderer.statistics().mesh_reused);
  EXPECT_NE(mesh.pixels, first.pixels);
  EXPECT_EQ(stage.draw(true, 7).pixels, first.pixels);
  stage.settings.skip = false;
  EXPECT_EQ(stage.draw(true, 7).pixels, first.pixels);
  stage.settings.skip = true;
  set_pool_threads(1);
  const auto alone = std::make_shared<const ImageSubject>(image_subject(stage.mesh));
  EXPECT_EQ(alone->mesh.texturing->maps, stage.image->mesh.texturing->maps);
  EXPECT_EQ(stage.draw(true, 8).pixels, first.pixels);
  set_pool_threads(0);
}

TEST(ImageSubjectTest, NothingIsDrawnOfNothing) {
  Stage stage(4);
  stage.mesh.views[2].view.contours.clear();
  stage.image = std::make_shared<const ImageSubject>(image_subject(stage.mesh));
  EXPECT_TRUE(stage.image->hull.empty());
  EXPECT_EQ(stage.draw(true).pixels, stage.background.pixels);
  stage.mesh.views.clear();
  stage.image = std::make_shared<const ImageSubject>(image_subject(stage.mesh));
  EXPECT_EQ(stage.draw(true).pixels, stage.background.pixels);
}

TEST(ImageSubjectTest, RefusesContoursThatAreNotFinite) {
  Mesh mesh;
  for (const Camera& camera : ring_rig(3).cameras) {
    MeshView& view = mesh.views.emplace_back();
    view.calibration = camera;
    view.view.contours.points = {{400, 300}, {400, 500}, {600, 400}};
    view.view.contours.ends = {3};
  }
  EXPECT_FALSE(image_subject(mesh).hull.empty());
  mesh.views[1].view.contours.points[0].x = NAN;
  EXPECT_THROW(image_subject(mesh), Error);
  mesh.views[1].calibration.distortion = {-0.1, 0.02, 0.0, 0.0};
  EXPECT_THROW(image_subject(mesh), Error);
}

}  // namespace
}  // namespace polyhull
