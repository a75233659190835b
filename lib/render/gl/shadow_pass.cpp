// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "render/gl/passes.h"

namespace polyhull {
namespace {

constexpr int static_map_size = 1024;

std::vector<glm::mat4> to_float(const std::vector<LightView>& views) {
  std::vector<glm::mat4> out;
  for (const LightView& view : views) out.emplace_back(view.map_from_scene);
  return out;
}

/// The half picture's pixels under \p part, with one more around for the blur.
Rectangle half_part(const Rectangle& part, int width, int height) {
  const int x0 = part.x / 2 - 2, x1 = (part.x + part.width + 1) / 2 + 2;
  const int y0 = part.y / 2 - 2, y1 = (part.y + part.height + 1) / 2 + 2;
  return intersection({x0, y0, x1 - x0, y1 - y0}, {0, 0, width, height});
}

GLuint make_sampler(gl::Sampler& sampler, bool compare, bool smooth = false) {
  if (!sampler.made()) {
    const GLuint name = sampler.get();
    const GLint filter = compare || smooth ? GL_LINEAR : GL_NEAREST;
    glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER, filter);
    glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, filter);
    glSamplerParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    if (compare) {
      glSamplerParameteri(name, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
      glSamplerParameteri(name, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    }
  }
  return sampler.get();
}

}  // namespace

gl::Program& ShadowPass::receiver(ShadowQuality quality) {
  gl::Program& program = receivers_[static_cast<int>(quality)];
  if (!program.made()) {
    const bool soft = quality == ShadowQuality::fast;
    program = gl::Program("scene.vert", "shadow.frag",
                          {"MAX_LIGHT_SAMPLES " + std::to_string(max_light_samples),
                           soft ? "BLOCKER_TAPS 4" : "BLOCKER_TAPS 0", "FILTER_TAPS 4"},
                          {});
  }
  return program;
}

void ShadowPass::draw_maps(const PassInput& in) {
  const Light& light = in.frame.lights[static_cast<std::size_t>(in.plan.light)];
  const int wanted = in.settings.shadow == ShadowQuality::hard ? 1
                     : in.settings.shadow == ShadowQuality::best
                         ? max_light_samples
                         : std::clamp(in.settings.light_samples, 1, max_light_samples);
  const std::vector<Vec3> cells = light_cells(light, wanted);
  const int side = std::max(1, static_cast<int>(std::lround(std::sqrt(cells.size()))));
  Bounds everything = in.scene.bounds();
  std::vector<Vec3f> points;
  for (const PlacedSubject& subject : in.plan.subjects)
    points.insert(points.end(), subject.points.begin(), subject.points.end());
  const Bounds people = bounds_of(points);
  everything.min = glm::min(everything.min, people.min);
  everything.max = glm::max(everything.max, people.max);

  if (!depth_of_hull_.made()) depth_of_hull_ = gl::Program("hull_depth.vert", "depth.frag");
  if (!depth_of_scene_.made()) depth_of_scene_ = gl::Program("scene.vert", "depth.frag");
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);

  views_.clear();
  subject_maps_.resize(std::clamp(in.settings.shadow_map_size, 16, 4096),
                       static_cast<int>(cells.size()));
  depth_of_hull_.use();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    double far = 1.0;
    for (const Vec3& corner : corners(everything))
      far = std::max(far, 1.05 * glm::distance(cells[i], corner));
    views_.push_back(view_of_points(light, cells[i], side, points, far));
    subject_maps_.begin(static_cast<int>(i));
    for (std::size_t s = 0; s < in.subjects.size(); ++s) {
      depth_of_hull_.set("clip_from_local", glm::mat4(views_.back().clip_from_scene *
                                                      in.plan.subjects[s].local_to_scene));
      in.subjects[s].draw_shape();
    }
  }

  const StaticKey key{in.frame.scene, light, cells.size()};
  static_reused_ = in.settings.skip && static_key_ == key;
  if (static_reused_) return;
  static_key_ = key;
  static_views_.clear();
  // The scene's alone: subjects move, and these maps stay.
  const Vec3 middle = 0.5 * (in.scene.bounds().min + in.scene.bounds().max);
  static_maps_.resize(static_map_size, static_cast<int>(cells.size()));
  depth_of_scene_.use();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    double far = 1.0;
    for (const Vec3& corner : corners(in.scene.bounds()))
      far = std::max(far, 1.05 * glm::distance(cells[i], corner));
    static_views_.push_back(wide_view(light, cells[i], middle, far));
    static_maps_.begin(static_cast<int>(i));
    depth_of_scene_.set("clip_from_scene", glm::mat4(static_views_.back().clip_from_scene));
    in.scene.draw();
  }
}

void ShadowPass::draw_irradiance(const PassInput& in) {
  const Light& light = in.frame.lights[static_cast<std::size_t>(in.plan.light)];
  const int count = static_cast<int>(views_.size());
  const int stride = count % 4 == 0 ? 4 : 1;
  std::vector<glm::vec3> positions;
  std::vector<glm::vec2> inverse;
  std::vector<glm::vec4> kernels;
  std::vector<float> nearest;
  for (const LightView& view : views_) {
    positions.emplace_back(view.position);
    inverse.emplace_back(view.inverse_from_depth);
    kernels.emplace_back(view.kernel);
    nearest.push_back(static_cast<float>(view.inverse_from_depth.y));  // depth 0: the near plane
  }
  // Pixel (i, j) of the half picture covers the full one's (2i, 2j) to (2i + 1, 2j + 1), also where
  // the full size is odd.
  const int width = (in.frame.width + 1) / 2, height = (in.frame.height + 1) / 2;
  const double sx = in.frame.width / (2.0 * width), sy = in.frame.height / (2.0 * height);
  Mat4 fit(1.0);
  fit[0][0] = sx;
  fit[3][0] = sx - 1.0;
  fit[1][1] = sy;
  fit[3][1] = sy - 1.0;
  const glm::mat4 clip(fit * in.plan.clip_from_scene);
  half_.resize(width, height);
  half_.bind();
  gl::scissor(half_part(in.plan.shadow, width, height));
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  depth_of_scene_.use();
  depth_of_scene_.set("clip_from_scene", clip);
  in.scene.draw();
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);

  gl::Program& program = receiver(in.settings.shadow);
  program.use();
  program.set("clip_from_scene", clip);
  program.set("samples", count);
  program.set("stride", stride);
  program.set("share", static_cast<float>(stride) / static_cast<float>(count));
  program.set("light_position", std::span<const glm::vec3>(positions));
  program.set("subject_from_scene", std::span<const glm::mat4>(to_float(views_)));
  program.set("static_from_scene", std::span<const glm::mat4>(to_float(static_views_)));
  program.set("inverse_from_depth", std::span<const glm::vec2>(inverse));
  program.set("kernel", std::span<const glm::vec4>(kernels));
  program.set("nearest", std::span<const float>(nearest));
  program.set("light_normal", light_normal(light));
  program.set("static_bias", 2.0f * 2.0f * 3.732f / static_map_size);
  program.set("eye", glm::vec3(in.plan.eye));
  gl::bind_texture(0, GL_TEXTURE_2D_ARRAY, subject_maps_.texture(), make_sampler(nearest_, false));
  gl::bind_texture(1, GL_TEXTURE_2D_ARRAY, subject_maps_.texture(), make_sampler(compare_, true));
  gl::bind_texture(2, GL_TEXTURE_2D_ARRAY, static_maps_.texture(), make_sampler(compare_, true));
  program.set("subject_depth", 0);
  program.set("subject_test", 1);
  program.set("static_test", 2);
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_EQUAL);
  in.scene.draw();
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  for (int unit = 0; unit < 3; ++unit) glBindSampler(static_cast<GLuint>(unit), 0);
}

void ShadowPass::blur(const PassInput& in) {
  const int width = (in.frame.width + 1) / 2, height = (in.frame.height + 1) / 2;
  gathered_.resize(width, height);
  gathered_.bind();
  gl::scissor(half_part(in.plan.shadow, width, height));
  glDisable(GL_DEPTH_TEST);
  if (!blur_.made()) blur_ = gl::Program("fullscreen.vert", "shadow_blur.frag");
  blur_.use();
  gl::bind_texture(0, GL_TEXTURE_2D, half_.colour());
  blur_.set("taken", 0);
  glBindVertexArray(nothing_.get());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
}

void ShadowPass::draw(const PassInput& in, gl::LightLayer& light_layer) {
  const Light& light = in.frame.lights[static_cast<std::size_t>(in.plan.light)];
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  draw_irradiance(in);
  blur(in);

  if (!apply_.made())
    apply_ = gl::Program("scene.vert", "shadow_apply.frag", {}, {"material.glsl"});
  light_layer.bind();
  gl::scissor(in.plan.shadow);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_EQUAL);
  apply_.use();
  apply_.set("clip_from_scene", glm::mat4(in.plan.clip_from_scene));
  apply_.set("eye", glm::vec3(in.plan.eye));
  apply_.set("light_power", light_power(light) * in.frame.exposure);
  apply_.set("half_size", glm::vec2((in.frame.width + 1) / 2, (in.frame.height + 1) / 2));
  gl::bind_texture(0, GL_TEXTURE_2D, gathered_.colour(), make_sampler(smooth_, false, true));
  apply_.set("taken", 0);
  apply_.set("base_texture", 1);
  glBindSampler(1, 0);
  in.scene.draw_with_materials(*in.frame.scene, apply_, 1);
  glBindSampler(0, 0);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
}

}  // namespace polyhull
