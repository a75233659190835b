// SPDX-License-Identifier: LGPL-2.1-or-later
// The places of the scene that the shadow's grid shows: its pixel (i, j) is the picture's (i, j) *
// grid_step.
uniform sampler2D depth;
uniform vec2 place_from_depth;  // scale, offset: depth to 1/z
uniform vec3 eye;
uniform vec3 ray_x;               // through pixel (x, y) of the picture: x ray_x + y ray_y + ray_0, of depth 1
uniform vec3 ray_y;
uniform vec3 ray_0;
uniform int grid_step;
uniform sampler2D surface;        // scene_layer.frag: normal, 1/z; 0 where nothing is

vec4 surface_at(ivec2 at) {
  return texelFetch(surface, at * grid_step, 0);
}

vec3 place(ivec2 at) {
  ivec2 pixel = at * grid_step;
  float inverse = texelFetch(depth, pixel, 0).r * place_from_depth.x + place_from_depth.y;
  return eye + (float(pixel.x) * ray_x + float(pixel.y) * ray_y + ray_0) / inverse;
}
