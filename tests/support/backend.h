// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Tests of rendering run once per backend: OpenGL, OpenGL ES, the processor.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "gl_context.h"
#include "render/gl/compositor.h"
#include "render/processor/processor_renderer.h"

namespace polyhull::testing {

enum class Backend { desktop, embedded, processor };

/// Prepares what the test's backend needs, and makes its renderers.
class BackendTest : public ::testing::TestWithParam<Backend> {
 public:
  static std::unique_ptr<Renderer> make_renderer() {
    if (processor()) return std::make_unique<ProcessorRenderer>();
    return std::make_unique<Compositor>();
  }
  static bool processor() { return GetParam() == Backend::processor; }

 protected:
  void SetUp() override {
    if (processor()) return;
    context_ = std::make_unique<HeadlessContext>(GetParam() == Backend::embedded);
    if (!context_->ready()) GTEST_SKIP() << context_->why();
    glGetError();  // whose own function libepoxy finds with the first call
    first_error = GL_NO_ERROR;
    get_error = epoxy_glGetError;
    epoxy_glGetError = noted;
  }
  void TearDown() override {
    if (!processor() && context_->ready()) {
      glGetError();
      epoxy_glGetError = get_error;
      EXPECT_EQ(first_error, static_cast<GLenum>(GL_NO_ERROR));
    }
  }

 private:
  /// glGetError, but what the renderer asks for is not lost for the test.
  static GLenum noted() {
    const GLenum error = get_error();
    if (first_error == GL_NO_ERROR) first_error = error;
    return error;
  }

  std::unique_ptr<HeadlessContext> context_;
  static inline PFNGLGETERRORPROC get_error = nullptr;
  static inline GLenum first_error = GL_NO_ERROR;
};

inline constexpr auto all_backends = {Backend::desktop, Backend::embedded, Backend::processor};

inline std::string backend_name(const ::testing::TestParamInfo<Backend>& info) {
  return info.param == Backend::desktop    ? "Desktop"
         : info.param == Backend::embedded ? "Embedded"
                                           : "Processor";
}

}  // namespace polyhull::testing
