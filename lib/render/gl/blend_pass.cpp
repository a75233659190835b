// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/passes.h"

namespace polyhull {
namespace {

/// What of the picture's tiles is drawn with the same layers.
struct BlendTiles {
  bool mirror = false, subject = false;
  std::vector<Tile> tiles;
};

/// The tiles that the plan's layers touch, by the layers; those that only the shadow may touch last.
std::vector<BlendTiles> blend_tiles(const PassInput& in, const BlendLayers& layers) {
  const int width = in.frame.width, height = in.frame.height;
  const Rectangle whole{0, 0, width, height};
  constexpr int side = small_tile_side;
  TileMask subject(width, height, side), mirror(width, height, side), shadow(width, height, side);
  if (layers.front) shadow.add(in.plan.shadow);
  if (layers.seen) shadow.add(layers.seen->shadow);
  for (const PlacedSubject& placed : in.plan.subjects) {
    if (layers.front)
      subject.add(placed, in.plan.clip_from_scene, intersection(in.plan.subject, whole),
                  placed.beyond);
    if (layers.seen)
      mirror.add(placed, in.plan.clip_from_scene * layers.seen->turned,
                 intersection(layers.seen->image, whole));
  }
  std::vector<BlendTiles> out = {{true, true, {}}, {true, false, {}}, {false, true, {}}, {}};
  for (int y = 0; y < subject.rows(); ++y)
    for (int x = 0; x < subject.columns(); ++x)
      for (BlendTiles& kind : out)
        if (kind.mirror == mirror.has(x, y) && kind.subject == subject.has(x, y) &&
            (kind.mirror || kind.subject || shadow.has(x, y)))
          kind.tiles.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)});
  return out;
}

/// What the mirror reflects.
void set_mirror(const PassInput& in, const SeenMirror& seen, gl::Program& blend) {
  std::vector<glm::vec3> normals, f0;
  for (const MirrorSurface& surface : surfaces_of(*in.frame.scene, seen)) {
    normals.push_back(surface.normal);
    f0.push_back(surface.f0);
  }
  blend.set("mirrors", static_cast<int>(normals.size()));
  blend.set("mirror_normal", std::span<const glm::vec3>(normals));
  blend.set("mirror_f0", std::span<const glm::vec3>(f0));
  blend.set("only_mirrors", only_mirrors(*in.frame.scene, seen));
  blend.set("reflection_alpha",
            in.settings.mirror == MirrorMode::plain ? in.settings.reflection_alpha : -1.0f);
}

}  // namespace

gl::Program& BlendPass::program(const Kind& kind, int step) {
  gl::Program& program =
      programs_[kind.shadow][kind.mirror_shadow][kind.mirror][kind.subject][kind.fill][step - 1];
  if (program.made()) return program;
  std::vector<std::string> defines{"GRID_STEP " + std::to_string(step)};
  if (kind.shadow) defines.emplace_back("SHADOW");
  if (kind.mirror_shadow) defines.emplace_back("MIRROR_SHADOW");
  if (kind.mirror) defines.emplace_back("MIRROR");
  if (kind.subject) defines.emplace_back("SUBJECT");
  std::vector<std::string> includes;
  if (kind.fill) {
    defines.emplace_back("FILL");
    defines.push_back(lamps_define());
    includes = {"light.glsl", "lamps.glsl"};
  }
  return program = gl::Program("tiles.vert", "composite.frag", defines, includes);
}

void BlendPass::set_layers(const PassInput& in, const BlendLayers& layers, const Kind& kind,
                           gl::Program& blend) {
  const auto bind = [&](int unit, const char* sampler, GLuint texture) {
    gl::bind_texture(unit, GL_TEXTURE_2D, texture);
    blend.set(sampler, unit);
  };
  bind(0, "background", layers.background);
  if (kind.shadow || kind.mirror_shadow) blend.set("power", in.power);
  if (kind.shadow) {
    bind(1, "surface", layers.direct.albedo());
    bind(2, "taken", layers.shadow.taken());
  }
  if (kind.mirror) {
    bind(3, "mirror", layers.mirror->image());
    bind(4, "mirrored_scene", layers.mirror->shown());
  }
  if (kind.subject) bind(5, "subject", layers.subject);
  if (kind.mirror_shadow) {
    bind(8, "mirrored_surface", layers.in_mirror->layers.albedo());
    bind(9, "mirrored_taken", layers.in_mirror->shadow.taken());
  }
  if (kind.mirror || kind.mirror_shadow) set_mirror(in, *layers.seen, blend);
  const bool lit = kind.fill && kind.shadow;
  if (kind.mirror || kind.mirror_shadow || lit) {
    const PixelRays rays(resized(in.frame.viewport, in.frame.width, in.frame.height));
    blend.set("ray_x", rays.x);
    blend.set("ray_y", rays.y);
    blend.set("ray_0", rays.origin);
  }
  if (kind.fill) blend.set("premultiplied", in.settings.alpha == AlphaCoding::premultiplied);
  if (!lit) return;
  set_lamps(blend, in);
  blend.set("eye", glm::vec3(in.plan.eye));
  bind(10, "normals", layers.direct.normals());
}

void BlendPass::draw(const PassInput& in, const BlendLayers& layers) {
  glViewport(0, 0, in.frame.width, in.frame.height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_BLEND);
  gl::scissor(in.plan.changed());
  const bool seen = layers.front && !in.plan.shadow.empty();
  const bool mirrored = layers.seen && !layers.seen->shadow.empty();
  const bool has_shadow = seen || mirrored;
  const GLuint in_mirror = mirrored ? layers.in_mirror->shadow.touched() : 0;
  const GLuint may = seen ? layers.shadow.touched() : in_mirror;
  for (const BlendTiles& kind : blend_tiles(in, layers)) {
    if (kind.tiles.empty()) continue;
    for (const bool shaded : {true, false}) {
      if (shaded ? !has_shadow : !kind.mirror && !kind.subject) continue;
      if (!shaded && has_shadow && !may) continue;  // all tiles count as shaded
      const Kind layered{shaded && seen, shaded && mirrored, kind.mirror, kind.subject,
                         in.translucent};
      gl::Program& blend = program(layered, shaded ? layers.direct.grid().step : 1);
      blend.use();
      set_layers(in, layers, layered, blend);
      // What alone would change nothing may do so together.
      const bool alone = !kind.mirror && !kind.subject && !(seen && mirrored);
      drawing_.draw(blend, kind.tiles, in.frame.width, in.frame.height, small_tile_side, 6,
                    {may, shaded, in_mirror, alone ? 0.6f : 0.1f});
    }
  }
}

}  // namespace polyhull
