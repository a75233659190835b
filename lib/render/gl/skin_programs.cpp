// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/passes.h"

namespace polyhull {
namespace {

/// Above those that SubjectBuffers binds.
constexpr int light_unit = 4;

}  // namespace

/// Has the program for subject \p s and triangles of \p kind (null: the narrow ones) ready for them.
gl::Program& SkinPrograms::use(const PassInput& in, std::size_t s, const glm::mat4& clip_from_scene,
                               bool clipped, const char* kind) {
  std::vector<std::string> defines{"VIEW_SLOTS " + std::to_string(view_slots)};
  if (in.subjects[s].has_distortion()) defines.emplace_back("DISTORTION");
  if (in.subjects[s].is_relit()) defines.emplace_back("RELIT");
  if (clipped) defines.emplace_back("CLIPPED");
  if (kind) defines.emplace_back(kind);
  gl::Program& program = programs_[defines];
  if (!program.made()) {
    program = gl::Program("hull.vert", "hull.frag", defines);
    program.set_block("Views", 0);
  }
  program.use();
  place(in, s, clip_from_scene, program);
  return program;
}

void SkinPrograms::place(const PassInput& in, std::size_t s, const glm::mat4& clip_from_scene,
                         gl::Program& program) {
  const PlacedSubject& subject = in.plan.subjects[s];
  const Mat4& local = subject.local_to_scene;
  program.set("clip_from_local", glm::mat4(Mat4(clip_from_scene) * local));
  program.set("scene_from_local", glm::mat4(local));
  program.set("pixel_size", static_cast<float>(in.plan.pixel_size / scale_of(subject)));
  const Grade& grade = subject.grade;
  program.set("graded", !grade.neutral());
  if (!grade.neutral()) {
    program.set("slope", grade.slope);
    program.set("offset", grade.offset);
    program.set("power", grade.power);
    program.set("saturation", grade.saturation);
  }
  program.set("shaded", subject.shade != nullptr);
  program.set("light", light_unit);
  if (!subject.shade) return;
  const LightLattice& light = *subject.shade;
  const Vec3f size(static_cast<float>(light.size[0]), static_cast<float>(light.size[1]),
                   static_cast<float>(light.size[2]));
  const Vec3f scale = 1.0f / (light.cell * size);
  program.set("light_scale", scale);
  program.set("light_offset", 0.5f / size - light.origin * scale);
  if (lights_.size() <= s) lights_.resize(s + 1);
  auto& [texture, held] = lights_[s];
  gl::bind_texture(light_unit, GL_TEXTURE_3D, texture.get());
  if (held == subject.shade) return;
  held = subject.shade;
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_RGB16F, light.size[0], light.size[1], light.size[2], 0, GL_RGB,
               GL_FLOAT, light.factors.data());
  gl::texture_parameters(GL_TEXTURE_3D, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
}

void SkinPrograms::draw(const PassInput& in, std::size_t eye, const glm::mat4& clip_from_scene,
                        const glm::vec4* plane) {
  for (std::size_t s = 0; s < in.subjects.size(); ++s) {
    gl::Program& program = use(in, s, clip_from_scene, plane != nullptr, nullptr);
    if (plane) program.set("plane", *plane);
    in.subjects[s].draw_skin(eye, program);
    if (!in.subjects[s].has_wide(eye)) continue;
    gl::Program& wide = use(in, s, clip_from_scene, plane != nullptr, "WIDE");
    if (plane) wide.set("plane", *plane);
    in.subjects[s].draw_wide(eye, wide);
  }
}

void SkinPrograms::draw_ribbons(const PassInput& in, const glm::mat4& clip_from_scene) {
  const auto draw_all = [&] {
    for (std::size_t s = 0; s < in.subjects.size(); ++s)
      in.subjects[s].draw_ribbons(use(in, s, clip_from_scene, false, "RIBBON"));
  };
  // First which ribbon is the nearest; then it alone, under what is there.
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  draw_all();
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthFunc(GL_EQUAL);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
  draw_all();
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
}

}  // namespace polyhull
