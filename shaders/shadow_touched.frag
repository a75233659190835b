// SPDX-License-Identifier: LGPL-2.1-or-later
// How much light is missing in small tiles of the picture, so that composite.frag runs over those only
// that lose any: a texel a tile.
uniform sampler2D taken;  // irradiance by channel, on the shadow's grid
uniform int span;         // of a tile, pixels of the grid
uniform int beyond;       // pixels of the grid after these that composite.frag looks at
uniform float least;      // less changes nothing where there is nothing else
layout(location = 0) out vec4 touched;  // 0: none, 0.25: less than that, 1

void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * span;
  ivec2 end = min(first + span + beyond, textureSize(taken, 0));
  float most = 0.0;
  for (int y = first.y; y < end.y; ++y)
    for (int x = first.x; x < end.x; ++x) {
      vec3 lost = texelFetch(taken, ivec2(x, y), 0).rgb;
      most = max(most, max(lost.r, max(lost.g, lost.b)));
    }
  touched = vec4(most >= least ? 1.0 : most > 0.0 ? 0.25 : 0.0, 0.0, 0.0, 1.0);
}
