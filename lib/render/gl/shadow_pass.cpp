// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/gl/passes.h"

namespace polyhull {
namespace {

/// The tiles that \p part of the picture touches.
Rectangle tiles_of(const Rectangle& part) {
  const int x0 = part.x / tile_side, y0 = part.y / tile_side;
  return {x0, y0, tiles_along(part.x + part.width) - x0, tiles_along(part.y + part.height) - y0};
}

}  // namespace

gl::Program& ShadowPass::receiver(int taps) {
  gl::Program& program = programs_.receivers[taps];
  if (!program.made()) {
    program =
        gl::Program("tiles.vert", "shadow.frag",
                    {"MAX_LIGHT_SAMPLES " + std::to_string(max_light_samples),
                     "BLOCKER_TAPS " + std::to_string(taps), "FILTER_TAPS " + std::to_string(taps)},
                    {"place.glsl", "light.glsl"});
  }
  return program;
}

/// Where the tiles' places lie in the light's map, unless that is known.
void ShadowPass::find_extents(const PassInput& in, const LightReach::Map& map, SceneLayers& layers,
                              LightTiles& own) {
  const ReachKey key{layers.generation(), map.centre, map.forward};
  if (own.key == key) return;
  own.key = key;
  gl::Program& program = programs_.reach;
  if (!program.made()) program = gl::Program("fullscreen.vert", "reach.frag", {}, {"place.glsl"});
  own.extents.resize(tiles_along(in.frame.width), tiles_along(in.frame.height), 2);
  own.extents.bind();
  gl::scissor(tiles_of(layers.part()));
  program.use();
  layers.set_places(program, 0);
  program.set("side", tile_side / layers.grid().step);
  program.set("light_centre", map.centre);
  program.set("light_right", map.right);
  program.set("light_down", map.down);
  program.set("light_forward", map.forward);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

/// Makes \p layer, a texel a tile, 0.
void ShadowPass::clear_tiles(gl::LightLayer& layer, const PassInput& in) {
  layer.resize(tiles_along(in.frame.width), tiles_along(in.frame.height));
  layer.bind();
  glDisable(GL_SCISSOR_TEST);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT);
}

/// Asks the light's map which tiles of the part subjects may shade, and adds them to all lights'.
void ShadowPass::find_tiles(const PassInput& in, ShadowMaps& maps, SceneLayers& layers,
                            LightTiles& own) {
  const LightReach::Map& map = maps.reach();
  find_extents(in, map, layers, own);
  clear_tiles(own.may, in);
  gl::scissor(tiles_of(part_));
  gl::Program& program = programs_.tiles;
  if (!program.made()) program = gl::Program("fullscreen.vert", "shadow_tiles.frag");
  program.use();
  program.set("extents", 0);
  program.set("nearest", 1);
  program.set("sums", 2);
  gl::bind_texture(0, GL_TEXTURE_2D, own.extents.colour(0));
  gl::bind_texture(1, GL_TEXTURE_2D, own.extents.colour(1));
  gl::bind_texture(2, GL_TEXTURE_2D, maps.reach_sums());
  program.set("map_low", map.low);
  program.set("map_scale", map.scale);
  program.set("reach", in.hard() ? Vec2f(0.0f) : map.extent);
  program.set("subject_nearest", map.nearest);
  // A cell's maps look towards the subjects and not along the light's normal: off that axis a texel
  // is wider in the light's map.
  const Vec2f high = map.low + static_cast<float>(LightReach::texels) / map.scale;
  const Vec2f most = glm::max(glm::abs(map.low), glm::abs(high));
  program.set("around", Vec2f(1.5f * maps.texel() * (1.0f + glm::dot(most, most))));
  program.set("everywhere", map.everywhere);
  program.set("behind", map.point);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  may_.bind();
  gl::scissor(tiles_of(part_));
  glEnable(GL_BLEND);
  glBlendEquation(GL_MAX);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBlendEquation(GL_FUNC_ADD);
  glDisable(GL_BLEND);
}

/// Makes \p layer 0 where it is asked for, and beside it.
void ShadowPass::clear(gl::LightLayer& layer, const PassInput& in, const ShadowGrid& grid) {
  layer.resize(grid.width, grid.height);
  layer.bind();
  gl::scissor(grid.under(whole_tiles(cleared_, in.frame.width, in.frame.height), 2));
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT);
}

/// Adds up what is taken of all lights.
void ShadowPass::draw_irradiance(const PassInput& in, LightMaps& maps, SceneLayers& layers) {
  const ShadowGrid& grid = layers.grid();
  clear(asked_, in, grid);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glBlendEquationSeparate(GL_FUNC_ADD, GL_MAX);
  for (const PassLight& light : in.lights) {
    gl::Program& program = receiver(light.recipe.taps);
    program.use();
    maps[light.planned.light].set(program, light, programs_);
    layers.set_places(program, 3);
    drawing_.draw(program, shadowed_, grid.width, grid.height, tile_side / grid.step, 5,
                  {skips_ ? tiles_[light.planned.light].may.colour() : 0});
  }
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_ONE, GL_ZERO);
  glDisable(GL_BLEND);
  for (int unit = 0; unit < 3; ++unit) glBindSampler(static_cast<GLuint>(unit), 0);
}

/// Gathers the samples of neighbouring pixels.
void ShadowPass::blur(const PassInput& in, const ShadowGrid& grid) {
  clear(gathered_, in, grid);
  gl::Program& program = programs_.blur;
  if (!program.made()) program = gl::Program("tiles.vert", "shadow_blur.frag");
  program.use();
  gl::bind_texture(0, GL_TEXTURE_2D, asked_.colour());
  program.set("taken", 0);
  drawing_.draw(program, shadowed_, grid.width, grid.height, tile_side / grid.step, 1, shaded());
}

/// Looks which small tiles lose light.
void ShadowPass::find_touched(const PassInput& in, const ShadowGrid& grid) {
  constexpr int side = small_tile_side;
  touched_.resize(tiles_along(in.frame.width, side), tiles_along(in.frame.height, side));
  touched_.bind();
  glDisable(GL_SCISSOR_TEST);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  gl::Program& program = programs_.touched;
  if (!program.made()) program = gl::Program("tiles.vert", "shadow_touched.frag");
  program.use();
  gl::bind_texture(0, GL_TEXTURE_2D, taken_);
  program.set("taken", 0);
  program.set("span", side / grid.step);
  program.set("beyond", grid.step - 1);
  // Where composite.frag leaves the background as it is, whatever the albedo, which is at most 1.
  const float most =
      std::max({in.power.x, in.power.y, in.power.z, 1e-30f}) / std::numbers::pi_v<float>;
  program.set("least", 0.99f * 4e-5f / most);
  drawing_.draw(program, shadowed_, tiles_along(in.frame.width, side),
                tiles_along(in.frame.height, side), tile_side / side, 1, shaded());
}

void ShadowPass::draw(const PassInput& in, LightMaps& maps, SceneLayers& layers,
                      const Rectangle& part, const Rectangle& cleared) {
  skips_ = in.settings.skip;
  part_ = part;
  cleared_ = cleared;
  const Rectangle tiles = tiles_of(part_);
  shadowed_.clear();
  for (int y = tiles.y; y < tiles.y + tiles.height; ++y)
    for (int x = tiles.x; x < tiles.x + tiles.width; ++x)
      shadowed_.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)});
  glDisable(GL_DEPTH_TEST);
  glBindVertexArray(nothing_.get());
  clear_tiles(may_, in);
  for (const PassLight& light : in.lights)
    find_tiles(in, maps[light.planned.light], layers, tiles_[light.planned.light]);
  draw_irradiance(in, maps, layers);
  if (!in.hard()) blur(in, layers.grid());
  taken_ = in.hard() ? asked_.colour() : gathered_.colour();
  if (skips_) find_touched(in, layers.grid());
}

}  // namespace polyhull
