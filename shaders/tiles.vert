// SPDX-License-Identifier: LGPL-2.1-or-later
// Tiles of the picture, one an instance, drawn as strips of four corners: those of the list that the
// subjects may shade, or may not, or all. What shades a tile is known on the graphics processor only, so
// the list need not wait for it.
layout(location = 0) in uvec2 tile;
uniform sampler2D shaded;  // a texel a tile: up to 1 where subjects may shade it
uniform sampler2D also;    // the same, of what a mirror shows there
uniform int wanted;        // 1: tiles that have more than enough there, 0: the others, -1: all
uniform float enough;
uniform vec2 size;         // of the target, pixels
uniform float side;        // of a tile, pixels of the target

void main() {
  float may = max(texelFetch(shaded, ivec2(tile), 0).r, texelFetch(also, ivec2(tile), 0).r);
  bool drawn = wanted < 0 || (may > enough) == (wanted == 1);
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  vec2 at = min((vec2(tile) + corner) * side, size);
  gl_Position = drawn ? vec4(2.0 * at / size - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
