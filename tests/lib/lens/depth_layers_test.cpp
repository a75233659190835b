// SPDX-License-Identifier: LGPL-2.1-or-later
// How far away what is drawn from its silhouettes is, beside the same drawn by its triangles.
#include "render/lens/depth_layers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "render/processor/processor_renderer.h"
#include "support/studio_mesh.h"
#include "support/synthetic.h"

namespace polyhull {
namespace {

using namespace polyhull::test;

constexpr int width = 320, height = 240;

/// One figure twice: half before and beside the other.
struct Two {
  StudioMesh figure;
  std::shared_ptr<const ImageSubject> image;
  RenderFrame frame;
  ProcessorRenderer renderer;

  Two() : figure(studio_mesh(ring_rig(4), "figure", 1.0, settings())) {
    image = std::make_shared<const ImageSubject>(image_subject(figure.mesh));
    frame.width = width;
    frame.height = height;
    frame.scene = std::make_shared<const Scene>(synthetic::small_room(true));
    frame.lights = frame.scene->lights;
    frame.viewport = synthetic::look_at({0.6, 1.5, 4.0}, {0.0, 0.8, 0.0}, width, height, 50.0);
  }
  static SilhouetteSettings settings() {
    SilhouetteSettings settings;
    settings.blur.sigma = 1.5;
    settings.approximate.tolerance = 0.7;
    settings.approximate.min_area = 100;
    return settings;
  }
  /// \p near and \p far: whether they are drawn from their silhouettes.
  void set(DepthLayers& depths, bool near, bool far) {
    SubjectPlacement before, behind;
    before.translate = {0.4, 0.0, 1.2};
    behind.translate = {-0.1, 0.0, -1.0};
    frame.subjects = {{&figure.mesh, before, 0, near ? image : nullptr},
                      {&figure.mesh, behind, 0, far ? image : nullptr}};
    depths.set(frame, renderer.plan(frame, {}));
  }
};

TEST(DepthLayersTest, EachImageBasedSubjectHasItsOwnDepth) {
  Two two;
  DepthLayers mesh;
  two.set(mesh, false, false);
  for (const auto& [near, far] : {std::pair{true, true}, {true, false}, {false, true}}) {
    DepthLayers image;
    two.set(image, near, far);
    int seen = 0, at_near = 0, at_far = 0, apart = 0, uncovered = 0;
    for (std::size_t i = 0; i < mesh.subject().size(); ++i) {
      const float a = mesh.subject()[i], b = image.subject()[i];
      if (a == 0.0f && b == 0.0f) continue;
      ++seen;
      at_near += b > 1.0f / 3.6f;
      at_far += b > 0.0f && b < 1.0f / 4.4f;
      apart += std::abs(a - b) > 0.01f * std::max(a, b);
      uncovered += std::abs(mesh.coverage()[i] - image.coverage()[i]) > 0.3f;
    }
    EXPECT_NE(mesh.subject(), image.subject());  // by rays, in other roundings
    EXPECT_GT(at_near, 1000);
    EXPECT_GT(at_far, 500);
    EXPECT_LT(apart, 0.01 * seen) << near << far;
    EXPECT_LT(uncovered, 0.01 * seen) << near << far;
  }
}

// A lamp that moves does not move what is seen.
TEST(DepthLayersTest, TheScenesDepthIsKeptWhileSceneAndViewportStay) {
  Two two;
  DepthLayers depths;
  two.set(depths, false, false);
  EXPECT_FALSE(depths.scene_reused());
  two.frame.lights.front().centre.x += 0.1f;
  two.set(depths, false, false);
  EXPECT_TRUE(depths.scene_reused());
  two.frame.viewport.t.x += 0.1;
  two.set(depths, false, false);
  EXPECT_FALSE(depths.scene_reused());
  two.frame.scene = std::make_shared<const Scene>(synthetic::small_room(true));
  two.set(depths, false, false);
  EXPECT_FALSE(depths.scene_reused());
}

}  // namespace
}  // namespace polyhull
