// SPDX-License-Identifier: LGPL-2.1-or-later
// Gathers the interleaved samples of shadow.frag: 1 2 1 in both directions weighs all four places of a
// block the same. Neighbours on another surface (1/depth jumps) are replaced by the pixel itself.
uniform sampler2D taken;  // irradiance by channel, 1 / depth
layout(location = 0) out vec4 gathered;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(taken, 0) - 1;
  vec4 own = texelFetch(taken, pixel, 0);
  vec3 sum = vec3(0.0);
  float weight = 0.0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      vec4 other = texelFetch(taken, clamp(pixel + ivec2(i, j), ivec2(0), last), 0);
      float w = float((2 - abs(i)) * (2 - abs(j)));
      // A neighbour of the same plane differs little in 1/depth, however the plane leans.
      w *= step(abs(other.a - own.a), 0.05 * own.a);
      sum += w * other.rgb;
      weight += w;
    }
  }
  gathered = vec4(weight > 0.0 ? sum / weight : own.rgb, own.a);
}
