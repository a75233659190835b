// SPDX-License-Identifier: LGPL-2.1-or-later
// The light that is missing from the picture: albedo / pi times the irradiance taken, brought from half
// to full resolution without crossing from one surface to another.
in vec3 world;
in vec3 world_normal;
in vec2 uv;
uniform sampler2D taken;   // half resolution: irradiance, 1 / depth; linear filter
uniform vec2 half_size;    // of its used part, texels
uniform vec3 eye;
uniform vec3 light_power;  // radiance * area (point: intensity), times exposure
layout(location = 0) out vec4 missing;

void main() {
  vec2 at = 0.5 * gl_FragCoord.xy;
  vec2 smooth_value = texture(taken, at / vec2(textureSize(taken, 0))).xy;
  if (smooth_value.x == 0.0) discard;  // the layer is cleared to 0
  float depth = gl_FragCoord.w;
  float irradiance = smooth_value.x;
  if (abs(smooth_value.y - depth) > 0.01 * depth) {
    // Near an edge: only those of the four texels around that lie on this surface.
    vec2 base = floor(at - 0.5);
    vec2 f = at - 0.5 - base;
    float sum = 0.0, weight = 0.0;
    for (int k = 0; k < 4; ++k) {
      ivec2 step_to = ivec2(k & 1, k >> 1);
      vec2 texel = texelFetch(taken, clamp(ivec2(base) + step_to, ivec2(0), ivec2(half_size) - 1), 0).xy;
      vec2 linear = mix(1.0 - f, f, vec2(step_to));
      float w = linear.x * linear.y + 1e-3;
      float difference = (texel.y - depth) / (0.02 * depth);
      w *= exp(-difference * difference) + 1e-6;
      sum += w * texel.x;
      weight += w;
    }
    irradiance = sum / weight;
  }
  float cosine = abs(dot(normalize(world_normal), normalize(eye - world)));
  missing = vec4(diffuse_albedo(uv, cosine) / PI * light_power * irradiance, 1.0);
}
