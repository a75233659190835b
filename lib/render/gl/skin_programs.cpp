// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/passes.h"

namespace polyhull {
namespace {

gl::Program hull_program(bool distortion, bool clipped, const char* kind = nullptr) {
  std::vector<std::string> defines{"VIEW_SLOTS " + std::to_string(view_slots)};
  if (distortion) defines.emplace_back("DISTORTION");
  if (clipped) defines.emplace_back("CLIPPED");
  if (kind) defines.emplace_back(kind);
  gl::Program program("hull.vert", "hull.frag", defines);
  program.set_block("Views", 0);
  return program;
}

void place(const PassInput& in, std::size_t s, const glm::mat4& clip_from_scene,
           gl::Program& program) {
  const Mat4& local = in.plan.subjects[s].local_to_scene;
  program.set("clip_from_local", glm::mat4(Mat4(clip_from_scene) * local));
  program.set("scene_from_local", glm::mat4(local));
  program.set("pixel_size", static_cast<float>(in.plan.pixel_size / scale_of(in.plan.subjects[s])));
}

}  // namespace

void SkinPrograms::draw(const PassInput& in, std::size_t eye, const glm::mat4& clip_from_scene,
                        const glm::vec4* plane) {
  for (std::size_t s = 0; s < in.subjects.size(); ++s) {
    const bool distortion = in.subjects[s].has_distortion();
    gl::Program& program = distortion ? distorted_ : plain_;
    if (!program.made()) program = hull_program(distortion, plane != nullptr);
    program.use();
    place(in, s, clip_from_scene, program);
    if (plane) program.set("plane", *plane);
    in.subjects[s].draw_skin(eye, program);
    if (!in.subjects[s].has_wide(eye)) continue;
    gl::Program& wide = distortion ? distorted_wide_ : plain_wide_;
    if (!wide.made()) wide = hull_program(distortion, plane != nullptr, "WIDE");
    wide.use();
    place(in, s, clip_from_scene, wide);
    if (plane) wide.set("plane", *plane);
    in.subjects[s].draw_wide(eye, wide);
  }
}

void SkinPrograms::draw_ribbons(const PassInput& in, const glm::mat4& clip_from_scene) {
  const auto draw_all = [&] {
    for (std::size_t s = 0; s < in.subjects.size(); ++s) {
      const bool distortion = in.subjects[s].has_distortion();
      gl::Program& program = distortion ? distorted_ribbon_ : plain_ribbon_;
      if (!program.made()) program = hull_program(distortion, false, "RIBBON");
      program.use();
      place(in, s, clip_from_scene, program);
      in.subjects[s].draw_ribbons(program);
    }
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
