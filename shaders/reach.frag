// SPDX-License-Identifier: LGPL-2.1-or-later
// Where the places that a tile of the picture shows lie in the light's map (lib/render/light_reach.h):
// kept as long as the view and the light stay. A little more than the tile, because shadow_blur.frag and
// composite.frag take from beside it.
uniform int side;             // of a tile, pixels of the grid
uniform vec3 light_centre;
uniform vec3 light_right;
uniform vec3 light_down;
uniform vec3 light_forward;
layout(location = 0) out vec4 extent;  // of the tangents: least, greatest
layout(location = 1) out vec4 nearest; // red: the least 1/z from the light

const int border = 2;
const float most = 6e4;  // of a half float

void main() {
  ivec2 tile = ivec2(gl_FragCoord.xy);
  ivec2 first = max(tile * side - border, ivec2(0));
  ivec2 end = min((tile + 1) * side + border, (textureSize(surface, 0) + grid_step - 1) / grid_step);
  vec2 low = vec2(most), high = vec2(-most);
  float least = most;
  for (int y = first.y; y < end.y; ++y) {
    for (int x = first.x; x < end.x; ++x) {
      ivec2 pixel = ivec2(x, y);
      if (surface_at(pixel).a == 0.0) continue;
      vec3 way = place(pixel) - light_centre;
      float z = dot(way, light_forward);
      if (z <= 1e-3) continue;  // behind the light, or in its plane
      vec2 tangents = clamp(vec2(dot(way, light_right), dot(way, light_down)) / z, -most, most);
      low = min(low, tangents);
      high = max(high, tangents);
      least = min(least, 1.0 / z);
    }
  }
  // Half floats round by less than a thousandth.
  extent = vec4(low - 1e-3 * abs(low), high + 1e-3 * abs(high));
  nearest = vec4(0.999 * least, 0.0, 0.0, 1.0);
}
