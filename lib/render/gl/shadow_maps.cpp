// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "render/gl/passes.h"
#include "scene/drawable.h"

namespace polyhull {
namespace {

/// Half of what a map shows, in tangents: the wider of both directions.
float half_width(const LightView& view) {
  const Mat4& clip = view.clip_from_scene;
  const Vec3 across(clip[0][0], clip[1][0], clip[2][0]), down(clip[0][1], clip[1][1], clip[2][1]);
  const Vec3 forward(clip[0][3], clip[1][3], clip[2][3]);
  // Rows of a clip matrix: the scaled axis, and the forward axis times how far the view is shifted.
  const double x = glm::length(across - glm::dot(across, forward) * forward);
  const double y = glm::length(down - glm::dot(down, forward) * forward);
  return static_cast<float>(std::max(1.0 / x, 1.0 / y));
}

double farthest(const Vec3& from, const Bounds& bounds) {
  double far = 1.0;
  for (const Vec3& corner : corners(bounds))
    far = std::max(far, 1.05 * glm::distance(from, corner));
  return far;
}

std::vector<glm::mat4> to_float(const std::vector<LightView>& views) {
  std::vector<glm::mat4> out;
  for (const LightView& view : views) out.emplace_back(view.map_from_scene);
  return out;
}

/// Its middle alone.
Light at_middle(Light light) {
  light.u = light.v = Vec3f(0.0f);
  return light;
}

int cells_per_side(std::size_t cells) {
  return std::max(1, static_cast<int>(std::lround(std::sqrt(cells))));
}

/// As PassLight::scale.
float irradiance_scale(const Light& light, const Bounds& scene) {
  constexpr double near = 32.0;  // metres
  const Vec3 centre(light.centre);
  const double distance = glm::distance(centre, glm::clamp(centre, scene.min, scene.max));
  return distance < near ? 1.0f
                         : static_cast<float>(std::exp2(std::floor(2.0 * std::log2(distance))));
}

GLuint make_sampler(gl::Sampler& sampler, bool compare) {
  if (!sampler.made()) {
    const GLuint name = sampler.get();
    const GLint filter = compare ? GL_LINEAR : GL_NEAREST;
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

void set_lights(PassInput& in) {
  const auto power_of = [&](const Light& light) {
    return light_power(light) * (in.frame.exposure / irradiance_scale(light, in.scene.bounds()));
  };
  for (const std::size_t light : in.plan.blocked_lights)
    in.power += power_of(in.frame.lights[light]);
  for (const ShadowLight& planned : in.plan.lights) {
    const Light& light = in.frame.lights[planned.light];
    in.lights.push_back({light, planned, shadow_recipe(in.settings, light, planned.share),
                         irradiance_scale(light, in.scene.bounds()),
                         share_of(power_of(light), in.power)});
  }
}

/// What the light's map shows of the subjects.
void ShadowMaps::find_reach(const Light& light, const SubjectsShape& shape) {
  reach_.build(light, shape.points, shape.triangles);
  if (!reach_.map().everywhere) {
    constexpr int side = LightReach::texels + 1;
    gl::bind_texture(0, GL_TEXTURE_2D, sums_.get());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R32I, side, side, 0, GL_RED_INTEGER, GL_INT,
                 reach_.sums().data());
    gl::texture_parameters(GL_TEXTURE_2D, GL_NEAREST);
  }
}

/// What a \p cell of the light sees of the scene. The maps are of the scene alone: subjects move, and these
/// maps stay. A hard shadow's is as fine as the subjects' own, of what lies before and behind them.
LightView ShadowMaps::scene_view(const PassInput& in, const PassLight& light, const Vec3& cell,
                                 std::span<const Vec3f> subjects, double far) const {
  const Bounds& scene = in.scene.bounds();
  // So far from the scene that a wide map would show it in a few texels.
  const bool sun = is_beyond(light.light, scene, 4.0);
  if (light.recipe.hard)
    return view_of_points(at_middle(light.light), cell, 1, subjects, far, sun ? far / 2.0 : 0.02);
  if (!sun)
    return wide_view(light.light, cell, 0.5 * (scene.min + scene.max), farthest(cell, scene));
  const std::vector<Vec3> box = corners(scene);
  const std::vector<Vec3f> whole(box.begin(), box.end());
  return view_of_points(light.light, cell, cells_per_side(views_.size()), whole,
                        farthest(cell, scene));
}

void ShadowMaps::draw(const PassInput& in, const PassLight& light, const SubjectsShape& shape,
                      ShadowPrograms& programs) {
  const Light casting = light.recipe.hard ? at_middle(light.light) : light.light;
  const std::vector<Vec3> cells = light_cells(casting, light.recipe.cells);
  find_reach(light.light, shape);
  Bounds everything = in.scene.bounds();
  const Bounds people = bounds_of(shape.points);
  everything.min = glm::min(everything.min, people.min);
  everything.max = glm::max(everything.max, people.max);

  gl::Program& program = programs.depth_of_hull;
  if (!program.made()) program = gl::Program("hull_depth.vert", "depth.frag");
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  views_.clear();
  subject_maps_.resize(light.recipe.map_size, static_cast<int>(cells.size()));
  program.use();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    views_.push_back(view_of_points(casting, cells[i], cells_per_side(cells.size()), shape.points,
                                    farthest(cells[i], everything)));
    subject_maps_.begin(static_cast<int>(i));
    for (std::size_t s = 0; s < in.subjects.size(); ++s) {
      program.set("clip_from_local",
                  glm::mat4(views_.back().clip_from_scene * in.plan.subjects[s].local_to_scene));
      in.subjects[s].draw_shape();
    }
  }
  static_views_.clear();
  for (const Vec3& cell : cells)
    static_views_.push_back(scene_view(in, light, cell, shape.points, farthest(cell, everything)));
  draw_static_maps(in, light, programs);
}

void ShadowMaps::draw_static_maps(const PassInput& in, const PassLight& light,
                                  ShadowPrograms& programs) {
  StaticKey key{in.frame.scene, light.recipe.scene_map_size, {}};
  for (const LightView& view : static_views_) key.views.push_back(view.clip_from_scene);
  static_reused_ = in.settings.skip && static_key_ == key;
  if (static_reused_) return;
  static_key_ = key;
  static_maps_.resize(key.size, static_cast<int>(key.views.size()));
  gl::Program& program = programs.depth_of_scene;
  if (!program.made()) program = gl::Program("scene.vert", "depth.frag");
  program.use();
  for (std::size_t i = 0; i < key.views.size(); ++i) {
    static_maps_.begin(static_cast<int>(i));
    program.set("clip_from_scene", glm::mat4(key.views[i]));
    in.scene.draw();
  }
}

float ShadowMaps::texel() const {
  float texel = 0.0f;
  for (const LightView& view : views_)
    texel = std::max(texel, 2.0f * half_width(view) / static_cast<float>(subject_maps_.size()));
  return texel;
}

void ShadowMaps::set(gl::Program& program, const PassLight& light, ShadowPrograms& programs) {
  const int count = static_cast<int>(views_.size());
  const int stride = count % 4 == 0 ? 4 : 1;
  std::vector<glm::vec3> positions;
  std::vector<glm::vec2> inverse;
  std::vector<glm::vec4> kernels, ahead;
  std::vector<float> nearest;
  for (const LightView& view : views_) {
    positions.emplace_back(view.position);
    inverse.emplace_back(view.inverse_from_depth);
    kernels.emplace_back(view.kernel);
    ahead.emplace_back(view.ahead);
    nearest.push_back(static_cast<float>(view.inverse_from_depth.y));  // depth 0: the near plane
  }
  program.set("samples", count);
  program.set("stride", stride);
  const float share = static_cast<float>(stride) / static_cast<float>(count);
  program.set("share", share * light.scale);
  program.set("power", light.power);
  program.set("light_position", std::span<const glm::vec3>(positions));
  program.set("subject_from_scene", std::span<const glm::mat4>(to_float(views_)));
  program.set("static_from_scene", std::span<const glm::mat4>(to_float(static_views_)));
  program.set("inverse_from_depth", std::span<const glm::vec2>(inverse));
  program.set("kernel", std::span<const glm::vec4>(kernels));
  program.set("ahead", std::span<const glm::vec4>(ahead));
  program.set("nearest", std::span<const float>(nearest));
  program.set("light_normal", light_normal(light.light));
  program.set("light_cone", shader_cone(light.light));
  // Two texels.
  const float static_texel =
      2.0f * half_width(static_views_[0]) / static_cast<float>(static_maps_.size());
  program.set("static_bias", 2.0f * static_texel);
  gl::bind_texture(0, GL_TEXTURE_2D_ARRAY, subject_maps_.texture(),
                   make_sampler(programs.nearest, false));
  gl::bind_texture(1, GL_TEXTURE_2D_ARRAY, subject_maps_.texture(),
                   make_sampler(programs.compare, true));
  gl::bind_texture(2, GL_TEXTURE_2D_ARRAY, static_maps_.texture(),
                   make_sampler(programs.compare, true));
  program.set("subject_depth", 0);
  program.set("subject_test", 1);
  program.set("static_test", 2);
}

}  // namespace polyhull
