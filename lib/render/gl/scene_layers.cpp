// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/scene_layers.h"

#include "render/gl/tiles.h"

namespace polyhull {
Vec2 inverse_from_depth(const Mat4& clip) {
  const auto row = [&](int r) { return Vec4(clip[0][r], clip[1][r], clip[2][r], clip[3][r]); };
  // Clip z = a w + b, and 2 depth - 1 = a + b / w.
  const Vec4 z = row(2), w = row(3);
  const double a = glm::dot(Vec3(z), Vec3(w)) / glm::dot(Vec3(w), Vec3(w)), b = z.w - a * w.w;
  return {2.0 / b, -(1.0 + a) / b};
}

ShadowGrid::ShadowGrid(const RenderFrame& frame, int every)
    : step(every),
      width((frame.width + step - 1) / step),
      height((frame.height + step - 1) / step) {}

Rectangle ShadowGrid::under(const Rectangle& part, int border) const {
  const int x0 = part.x / step - border, x1 = (part.x + part.width + step - 1) / step + border;
  const int y0 = part.y / step - border, y1 = (part.y + part.height + step - 1) / step + border;
  return intersection({x0, y0, x1 - x0, y1 - y0}, {0, 0, width, height});
}

LayerView direct_view(const RenderFrame& frame, const RenderPlan& plan) {
  const PixelRays rays(resized(frame.viewport, frame.width, frame.height));
  return {plan.clip_from_scene, plan.eye, rays};
}

LayerView view_in_mirror(const RenderPlan& plan, const SeenMirror& seen) {
  return {plan.clip_from_scene * seen.turned, seen.eye, seen.rays, seen.way, plan.clip_from_scene};
}

void MirrorStencil::narrow(const Scene& scene, const SceneBuffers& buffers,
                           const Mat4& clip_from_scene, const std::vector<std::size_t>& way,
                           const std::function<void(std::size_t)>& hide) {
  if (!depth_.made()) {
    depth_ = gl::Program("scene.vert", "depth.frag");
    clipped_depth_ = gl::Program("scene.vert", "depth.frag", {"CLIPPED"});
  }
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_STENCIL_TEST);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  Mat4 clip = clip_from_scene;
  for (std::size_t i = 0; i < way.size(); ++i) {
    // A mirror is seen where it is the nearest of what the one before shows.
    const auto before = static_cast<GLint>(i);
    const auto use = [&] {
      gl::Program& program = i == 0 ? depth_ : clipped_depth_;
      program.use();
      program.set("clip_from_scene", glm::mat4(clip));
      if (i > 0) program.set("plane", glm::vec4(kept_side(scene.mirrors[way[i - 1]])));
    };
    use();
    glStencilFunc(GL_EQUAL, before, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    glDepthFunc(GL_LESS);
    buffers.draw();
    if (hide && i > 0) {
      hide(i - 1);
      use();
    }
    glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
    glDepthFunc(GL_EQUAL);
    buffers.draw_mirror(way[i]);
    glClear(GL_DEPTH_BUFFER_BIT);
    const Mirror& mirror = scene.mirrors[way[i]];
    clip = clip * reflection(Vec3(mirror.normal), mirror.offset);
  }
  glStencilFunc(GL_EQUAL, static_cast<GLint>(way.size()), 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  glDepthFunc(GL_LESS);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

bool SceneLayers::draw(const RenderFrame& frame, bool skip, const LayerView& view,
                       const Rectangle& seen, int step, const SceneBuffers& scene) {
  // The tiles beside the shadow's are asked, too.
  const Rectangle tiles = whole_tiles(seen, frame.width, frame.height);
  constexpr int around = 8;
  const Rectangle part = intersection(
      {tiles.x - around, tiles.y - around, tiles.width + 2 * around, tiles.height + 2 * around},
      {0, 0, frame.width, frame.height});
  const Key key{frame.scene, view.clip_from_scene, frame.width, frame.height,
                step > 0 ? ShadowGrid(frame, step) : ShadowGrid()};
  view_ = view;
  if (skip && key_ == key && intersection(part, part_) == part) return true;
  // Of the same view, what was asked for before is asked for again as subjects move to and fro.
  part_ = skip && key_ == key ? bounding(part, part_) : part;
  key_ = key;
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  ++generation_;
  layer_.resize(frame.width, frame.height, 2, !view.way.empty());
  layer_.bind();
  gl::scissor(part_);
  if (step > 0) {
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
    if (!view.way.empty()) stencil_.narrow(*frame.scene, scene, view.viewport_from_scene, view.way);
    draw_surfaces(frame, scene);
    glDisable(GL_STENCIL_TEST);
    return false;
  }
  if (!depth_.made()) depth_ = gl::Program("scene.vert", "depth.frag");
  depth_.use();
  depth_.set("clip_from_scene", glm::mat4(view.clip_from_scene));
  glClear(GL_DEPTH_BUFFER_BIT);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  scene.draw();
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  return false;
}

void SceneLayers::draw_surfaces(const RenderFrame& frame, const SceneBuffers& scene) {
  const bool clipped = !view_.way.empty();
  gl::Program& program = clipped ? clipped_surface_ : surface_;
  if (!program.made()) {
    const std::vector<std::string> defines(clipped ? 1 : 0, "CLIPPED");
    program = gl::Program("scene.vert", "scene_layer.frag", defines, {"material.glsl"});
  }
  program.use();
  program.set("clip_from_scene", glm::mat4(view_.clip_from_scene));
  program.set("eye", glm::vec3(view_.eye));
  if (clipped) program.set("plane", glm::vec4(kept_side(frame.scene->mirrors[view_.way.back()])));
  program.set("base_texture", 0);
  glBindSampler(0, 0);
  scene.draw_with_materials(*frame.scene, program, 0);
}

void SceneLayers::set_places(gl::Program& program, int unit) {
  program.set("ray_x", view_.rays.x);
  program.set("ray_y", view_.rays.y);
  program.set("ray_0", view_.rays.origin);
  program.set("eye", glm::vec3(view_.eye));
  program.set("place_from_depth", glm::vec2(inverse_from_depth(view_.clip_from_scene)));
  program.set("grid_step", key_->grid.step);
  program.set("depth", unit);
  program.set("surface", unit + 1);
  gl::bind_texture(unit, GL_TEXTURE_2D, layer_.depth());
  gl::bind_texture(unit + 1, GL_TEXTURE_2D, layer_.colour(1));
}

}  // namespace polyhull
