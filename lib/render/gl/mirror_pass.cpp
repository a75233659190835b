// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>

#include "render/gl/passes.h"

namespace polyhull {
namespace {

/// The most that \p lamp gives in the middle of a subject, where mirrors show what is around.
double given_to_subjects(const Light& lamp, const RenderPlan& plan) {
  double most = 0.0;
  for (const PlacedSubject& subject : plan.subjects)
    most = std::max(most, light_given(lamp, 0.5 * (subject.bounds.min + subject.bounds.max)));
  return most;
}

}  // namespace

std::string lamps_define() {
  return "MAX_LIGHTS " + std::to_string(max_lamps);
}

void set_lamps(gl::Program& program, const PassInput& in) {
  const RenderFrame& frame = in.frame;
  std::vector<const Light*> lamps;
  for (const PassLight& light : in.lights) lamps.push_back(&light.light);
  for (const Light& light : frame.lights)
    if (std::find(lamps.begin(), lamps.end(), &light) == lamps.end()) lamps.push_back(&light);
  if (lamps.size() > max_lamps) {
    std::stable_sort(lamps.begin() + static_cast<std::ptrdiff_t>(in.lights.size()), lamps.end(),
                     [&](const Light* a, const Light* b) {
                       return given_to_subjects(*a, in.plan) > given_to_subjects(*b, in.plan);
                     });
    lamps.resize(max_lamps);
  }
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

/// Draws the subjects where \p seen is; the bound framebuffer's depth hides them.
void MirrorPass::draw_image(const PassInput& in, const SeenMirror& seen) {
  if (seen.sight == 0) return;
  const glm::vec4 plane(kept_side(mirror_of(*in.frame.scene, seen)));
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  // Turned by the framebuffer's direction and by each mirror.
  glFrontFace(seen.way.size() % 2 == 1 ? GL_CCW : GL_CW);
  skin_.draw(in, seen.sight, glm::mat4(in.plan.clip_from_scene * seen.turned), &plane);
  glDisable(GL_CULL_FACE);
}

void MirrorPass::draw(const PassInput& in, const SeenMirror& seen, GLuint background,
                      GLuint scene_depth) {
  const glm::mat4 direct(in.plan.clip_from_scene);
  const glm::mat4 mirrored(in.plan.clip_from_scene * seen.turned);
  const glm::vec4 plane(kept_side(mirror_of(*in.frame.scene, seen)));
  if (!clipped_depth_.made()) {
    clipped_depth_ = gl::Program("scene.vert", "depth.frag", {"CLIPPED"});
    scene_ = gl::Program("scene.vert", "mirrored_scene.frag", {lamps_define()},
                         {"material.glsl", "light.glsl", "lamps.glsl"});
  }
  std::vector<const SeenMirror*> outer;  // those that show it, the innermost first
  for (int i = seen.within; i >= 0; i = outer.back()->within)
    outer.push_back(&in.plan.mirrors[static_cast<std::size_t>(i)]);
  const Rectangle part = whole_tiles(seen.image, in.frame.width, in.frame.height);
  image_.resize(in.frame.width, in.frame.height, in.settings.edge_samples);

  image_.begin(part);
  stencil_.narrow(*in.frame.scene, in.scene, in.plan.clip_from_scene, seen.way,
                  [&](std::size_t i) { draw_image(in, *outer[outer.size() - 1 - i]); });
  // The mirrored scene hides the mirrored subject.
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  clipped_depth_.use();
  clipped_depth_.set("clip_from_scene", mirrored);
  clipped_depth_.set("plane", plane);
  in.scene.draw();

  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  if (!gl::is_embedded()) glEnable(GL_FRAMEBUFFER_SRGB);
  draw_image(in, seen);
  glDisable(GL_STENCIL_TEST);
  image_.resolve(part);
  if (!gl::is_embedded()) glDisable(GL_FRAMEBUFFER_SRGB);

  if (in.settings.mirror != MirrorMode::fresnel) return;
  shown_.resize(in.frame.width, in.frame.height);
  shown_.bind();
  gl::scissor(part);
  const Vec3f sky = glm::min(in.frame.sky * in.frame.exposure, Vec3f(1.0f));
  glClearColor(sky.x, sky.y, sky.z, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  environment_.draw(in, in.plan.clip_from_scene * seen.turned);
  scene_.use();
  scene_.set("clip_from_scene", mirrored);
  scene_.set("clip_from_scene_direct", direct);
  scene_.set("plane", plane);
  scene_.set("eye", glm::vec3(outer.empty() ? in.plan.eye : outer.front()->eye));
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
