// SPDX-License-Identifier: LGPL-2.1-or-later
// A scene material and the light that falls on it from small or large lights, unshadowed.
uniform vec3 base_colour;       // linear
uniform bool has_texture;
uniform sampler2D base_texture; // sRGB texture: linear when sampled
uniform float metallic;
uniform bool mirror;            // what it reflects is missing from what it scatters
uniform vec3 f0;
uniform vec3 emission;

// The part of light that is scattered evenly in all directions, seen at an angle of this cosine.
vec3 diffuse_albedo(vec2 uv, float cosine) {
  vec3 c = base_colour;
  if (has_texture) c *= texture(base_texture, uv).rgb;
  if (mirror) {
    vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0);
    c *= (1.0 - fresnel) * (1.0 - metallic);
  }
  return c;
}
