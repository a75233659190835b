// SPDX-License-Identifier: LGPL-2.1-or-later
// The places of the scene that the pixels of the shadow's grid show.
uniform sampler2D depth;
uniform vec2 place_from_depth;  // scale, offset: depth to 1/z
uniform vec3 eye;
uniform vec3 ray_x;               // through pixel (x, y) of the picture: x ray_x + y ray_y + ray_0, of depth 1
uniform vec3 ray_y;
uniform vec3 ray_0;
uniform float grid_step;          // pixels of the picture a pixel of the grid

vec3 place(ivec2 pixel, float inverse) {
  vec2 p = (vec2(pixel) + 0.5) * grid_step - 0.5;
  return eye + (p.x * ray_x + p.y * ray_y + ray_0) / inverse;
}

float inverse_at(ivec2 pixel) {
  return texelFetch(depth, pixel, 0).r * place_from_depth.x + place_from_depth.y;
}
