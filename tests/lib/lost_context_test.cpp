// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenGL that fails while it draws: said as an Error, before anything of the picture is written.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "backend.h"
#include "base/error.h"
#include "figure_stage.h"
#include "gl_errors.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

using Stage = synthetic::FigureStage;
using testing::SayGlError;

class LostContextTest : public testing::BackendTest {};

void draw(Renderer& renderer, const Stage& stage, Picture& picture) {
  const RenderPlan plan = renderer.plan(stage.frame, {});
  renderer.render(stage.frame, plan, {}, stage.background.pixels.data(), 4 * stage.frame.width,
                  picture.pixels.data(), 4 * stage.frame.width);
}

TEST_P(LostContextTest, IsAnErrorThatLeavesThePictureAsItWas) {
  Stage stage(160, 90);
  stage.fill_background(90);
  Compositor compositor;
  Picture right = stage.background;
  draw(compositor, stage, right);
  ASSERT_NE(right.pixels, stage.background.pixels);
  const struct {
    GLenum error;
    const char* words;
  } cases[] = {{GL_OUT_OF_MEMORY, "memory is not enough"}, {GL_CONTEXT_LOST, "context is lost"}};
  for (const auto& c : cases) {
    Picture picture = stage.background;
    const SayGlError said(c.error, 1);  // after what others have left
    test::expect_refused([&] { draw(compositor, stage, picture); }, c.words);
    EXPECT_EQ(picture.pixels, stage.background.pixels);
  }
  Picture again = stage.background;
  draw(compositor, stage, again);
  EXPECT_EQ(again.pixels, right.pixels);
}

TEST_P(LostContextTest, OthersErrorsDoNotCount) {
  Stage stage(160, 90);
  stage.fill_background(90);
  Compositor compositor;
  Picture picture = stage.background;
  const SayGlError said(GL_OUT_OF_MEMORY, 0);
  EXPECT_NO_THROW(draw(compositor, stage, picture));
}

int deleted = 0;
PFNGLDELETETEXTURESPROC delete_textures = nullptr;

// Without a context no function of OpenGL may be called, those that delete included.
TEST_P(LostContextTest, IsAbandonedWithoutOpenGl) {
  Stage stage(160, 90);
  stage.fill_background(90);
  auto lost = std::make_unique<Compositor>(), kept = std::make_unique<Compositor>();
  Picture picture = stage.background;
  draw(*lost, stage, picture);
  draw(*kept, stage, picture);
  delete_textures = epoxy_glDeleteTextures;
  epoxy_glDeleteTextures = [](GLsizei count, const GLuint* names) {
    ++deleted;
    delete_textures(count, names);
  };
  deleted = 0;
  lost->abandon();
  lost.reset();
  EXPECT_EQ(deleted, 0);
  kept.reset();
  EXPECT_GT(deleted, 0);
  epoxy_glDeleteTextures = delete_textures;
}

INSTANTIATE_TEST_SUITE_P(Context, LostContextTest,
                         ::testing::Values(testing::Backend::desktop, testing::Backend::embedded),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
