// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>

#include "render/gl/passes.h"

namespace polyhull {

std::string lamps_define() {
  return "MAX_LIGHTS " + std::to_string(max_lamps);
}

void set_lamps(gl::Program& program, const PassInput& in) {
  const RenderFrame& frame = in.frame;
  std::vector<const Light*> lamps;
  for (const PassLight& light : in.lights) lamps.push_back(&light.light);
  for (const Light& light : frame.lights)
    if (std::find(lamps.begin(), lamps.end(), &light) == lamps.end()) lamps.push_back(&light);
  std::stable_sort(
      lamps.begin() + static_cast<std::ptrdiff_t>(in.lights.size()), lamps.end(),
      [](const Light* a, const Light* b) { return light_strength(*a) > light_strength(*b); });
  lamps.resize(std::min(lamps.size(), max_lamps));
  std::vector<glm::vec3> positions, normals, powers;
  std::vector<glm::vec2> cones;
  for (const Light* lamp : lamps) {
    positions.push_back(lamp->centre);
    normals.push_back(light_normal(*lamp));
    cones.push_back(shader_cone(*lamp));
    powers.push_back(light_power(*lamp) * frame.exposure);
  }
  program.set("lights", static_cast<int>(positions.size()));
  program.set("light_position", std::span<const glm::vec3>(positions));
  program.set("light_normal", std::span<const glm::vec3>(normals));
  program.set("light_cone", std::span<const glm::vec2>(cones));
  program.set("light_power", std::span<const glm::vec3>(powers));
  program.set("ambient", frame.ambient * frame.exposure);
}

void MirrorPass::draw(const PassInput& in, GLuint background, GLuint scene_depth) {
  const Mirror& mirror = *mirror_of(in.frame, in.plan);
  const glm::mat4 direct(in.plan.clip_from_scene);
  const glm::mat4 mirrored(in.plan.clip_from_scene *
                           reflection(Vec3(mirror.normal), mirror.offset));
  const glm::vec4 plane(kept_side(mirror));
  if (!depth_.made()) {
    depth_ = gl::Program("scene.vert", "depth.frag");
    clipped_depth_ = gl::Program("scene.vert", "depth.frag", {"CLIPPED"});
    scene_ = gl::Program("scene.vert", "mirrored_scene.frag", {lamps_define()},
                         {"material.glsl", "light.glsl", "lamps.glsl"});
  }
  const Rectangle part = whole_tiles(in.plan.mirror, in.frame.width, in.frame.height);
  image_.resize(in.frame.width, in.frame.height, in.settings.edge_samples);

  // The visible part of the mirror: where its surface is the scene's nearest.
  image_.begin(part);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  depth_.use();
  depth_.set("clip_from_scene", direct);
  in.scene.draw();
  glEnable(GL_STENCIL_TEST);
  glStencilFunc(GL_ALWAYS, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  glDepthFunc(GL_EQUAL);
  in.scene.draw_mesh(mirror.mesh);

  // The mirrored scene hides the mirrored subject.
  glStencilFunc(GL_EQUAL, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  glDepthFunc(GL_LESS);
  glClear(GL_DEPTH_BUFFER_BIT);
  clipped_depth_.use();
  clipped_depth_.set("clip_from_scene", mirrored);
  clipped_depth_.set("plane", plane);
  in.scene.draw();

  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  glFrontFace(GL_CCW);  // turned once by the framebuffer's direction and once by the mirror
  if (!gl::is_embedded()) glEnable(GL_FRAMEBUFFER_SRGB);
  skin_.draw(in, 1, mirrored, &plane);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_CULL_FACE);
  image_.resolve(part);
  if (!gl::is_embedded()) glDisable(GL_FRAMEBUFFER_SRGB);

  if (in.settings.mirror != MirrorMode::fresnel) return;
  shown_.resize(in.frame.width, in.frame.height);
  shown_.bind();
  gl::scissor(part);
  const Vec3f sky = glm::min(in.frame.sky * in.frame.exposure, Vec3f(1.0f));
  glClearColor(sky.x, sky.y, sky.z, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  scene_.use();
  scene_.set("clip_from_scene", mirrored);
  scene_.set("clip_from_scene_direct", direct);
  scene_.set("plane", plane);
  scene_.set("eye", glm::vec3(in.plan.eye));
  scene_.set("exposure", in.frame.exposure);
  scene_.set("translucent", in.translucent);
  set_lamps(scene_, in);
  gl::bind_texture(0, GL_TEXTURE_2D, background);
  gl::bind_texture(1, GL_TEXTURE_2D, scene_depth);
  glBindSampler(2, 0);
  scene_.set("background", 0);
  scene_.set("scene_depth", 1);
  scene_.set("base_texture", 2);
  in.scene.draw_with_materials(*in.frame.scene, scene_, 2);
}

}  // namespace polyhull
