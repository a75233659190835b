// SPDX-License-Identifier: LGPL-2.1-or-later
// The depth of what a background shows, where its maker tells it; nothing where that is nothing.
uniform highp sampler2D inverse;  // 1/z, of a picture that shows the same in other pixels
uniform vec2 size;                // of the picture that is drawn
uniform vec2 depth_from_inverse;  // scale, offset: 1/z to depth
uniform float nearness;           // 1/z is taken so many times

void main() {
  ivec2 own = textureSize(inverse, 0);
  ivec2 at = min((2 * ivec2(gl_FragCoord.xy) + 1) * own / (2 * ivec2(size)), own - 1);
  float found = texelFetch(inverse, at, 0).r;
  if (!(found > 0.0)) discard;
  gl_FragDepth = found * nearness * depth_from_inverse.x + depth_from_inverse.y;
}
