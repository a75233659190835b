// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/passes.h"

namespace polyhull {
namespace {

gl::Program hull_program(bool distortion, bool clipped) {
  std::vector<std::string> defines{"VIEW_SLOTS " + std::to_string(view_slots)};
  if (distortion) defines.emplace_back("DISTORTION");
  if (clipped) defines.emplace_back("CLIPPED");
  gl::Program program("hull.vert", "hull.frag", defines);
  program.set_block("Views", 0);
  return program;
}

}  // namespace

void SkinPrograms::draw(const PassInput& in, std::size_t eye, const glm::mat4& clip_from_scene,
                        const glm::vec4* plane) {
  for (std::size_t s = 0; s < in.subjects.size(); ++s) {
    const bool distortion = in.subjects[s].has_distortion();
    gl::Program& program = distortion ? distorted_ : plain_;
    if (!program.made()) program = hull_program(distortion, plane != nullptr);
    program.use();
    const Mat4& local = in.plan.subjects[s].local_to_scene;
    program.set("clip_from_local", glm::mat4(Mat4(clip_from_scene) * local));
    program.set("scene_from_local", glm::mat4(local));
    program.set("pixel_size",
                static_cast<float>(in.plan.pixel_size / scale_of(in.plan.subjects[s])));
    if (plane) program.set("plane", *plane);
    in.subjects[s].draw_skin(eye, program);
  }
}

}  // namespace polyhull
