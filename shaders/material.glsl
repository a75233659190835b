// SPDX-License-Identifier: LGPL-2.1-or-later
// A scene material and the light that falls on it from small or large lights, unshadowed.
uniform vec3 base_colour;       // linear
uniform bool has_texture;
uniform sampler2D base_texture; // sRGB texture: linear when sampled
uniform float metallic;
uniform vec3 emission;

// The part of light that is scattered evenly in all directions.
vec3 diffuse_albedo(vec2 uv) {
  vec3 c = base_colour;
  if (has_texture) c *= texture(base_texture, uv).rgb;
  return c * (1.0 - metallic);
}
