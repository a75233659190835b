// SPDX-License-Identifier: LGPL-2.1-or-later
// The light that the subject takes away from the scene's surface: the part of a light's
// irradiance (for radiance * area = 1) that the subject blocks and the scene itself does not. Drawn on a
// grid of half the picture's resolution (of the whole for a hard shadow), which composite.frag brings to
// full, in the tiles that subjects may shade.
//
// Interleaved sampling (Keller and Heidrich 2001): each pixel of a block of 2 x 2 asks every fourth
// sample only, and shadow_blur.frag gathers the block.
//
// The light is cut into `samples` cells, each with a depth map of the subject and one of the scene
// seen from its centre. Within a cell, penumbrae follow from percentage-closer soft shadows (Fernando
// 2005): the mean depth of blockers gives the width of the filter. All depths are compared as inverse
// distances, which are linear in the depth buffer and in which the filter's width is
// cell * (1/z_blocker - 1/z_receiver), as the cell is seen from the receiver.
uniform int samples;
uniform vec3 light_position[MAX_LIGHT_SAMPLES];
uniform mat4 subject_from_scene[MAX_LIGHT_SAMPLES];  // to map coordinates and depth, 0..1
uniform mat4 static_from_scene[MAX_LIGHT_SAMPLES];
uniform vec2 inverse_from_depth[MAX_LIGHT_SAMPLES];  // scale, offset: subject map depth to 1/z
uniform vec4 kernel[MAX_LIGHT_SAMPLES];              // half cells u, v in map coordinates times depth,
uniform vec4 ahead[MAX_LIGHT_SAMPLES];               // and their depths (zw), from map coordinates (xy)
uniform float nearest[MAX_LIGHT_SAMPLES];            // largest 1/z of the subject
uniform vec3 light_normal;  // 0: a point light
uniform vec2 light_cone;    // as light.glsl's
uniform float share;        // of the light that a sample that is asked stands for
uniform vec3 power;         // the light's, as a share of all that are added up
uniform int stride;         // 4: interleaved, 1: every sample
uniform float static_bias;  // scene units per unit of distance

uniform sampler2DArray subject_depth;
uniform highp sampler2DArrayShadow subject_test;
uniform highp sampler2DArrayShadow static_test;

layout(location = 0) out vec4 taken;  // irradiance times power, 1 / view depth

// Even samples of the square [-1, 1]^2 (Roberts' R2 sequence).
vec2 tap(int i, float start) {
  return fract(vec2(0.7548776662, 0.5698402910) * float(i) + start) * 2.0 - 1.0;
}

float blocked_by_subject(int j, vec3 coordinate, float inverse_receiver) {
  float layer = float(j);
#if BLOCKER_TAPS > 0
  vec2 across = coordinate.xy - ahead[j].xy;
  vec2 u = kernel[j].xy - across * ahead[j].z, v = kernel[j].zw - across * ahead[j].w;
  float widest = max(nearest[j] - inverse_receiver, 0.0);
  float sum = 0.0, count = 0.0;
  for (int i = 0; i < BLOCKER_TAPS; ++i) {
    vec2 t = tap(i, 0.5);
    vec2 offset = (u * t.x + v * t.y) * widest;
    float depth = texture(subject_depth, vec3(coordinate.xy + offset, layer)).r;
    float hit = step(depth, coordinate.z);
    sum += hit * depth;
    count += hit;
  }
  if (count == 0.0) return 0.0;
  float inverse_blocker = sum / count * inverse_from_depth[j].x + inverse_from_depth[j].y;
  float width = max(inverse_blocker - inverse_receiver, 0.0);
  float lit = 0.0;
  for (int i = 0; i < FILTER_TAPS; ++i) {
    vec2 t = tap(i, 0.25);
    vec2 offset = (u * t.x + v * t.y) * width;
    lit += texture(subject_test, vec4(coordinate.xy + offset, layer, coordinate.z));
  }
  return 1.0 - lit / float(FILTER_TAPS);
#else
  return 1.0 - texture(subject_test, vec4(coordinate.xy, layer, coordinate.z));
#endif
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 there = surface_at(pixel);
  vec3 normal = there.xyz;
  vec3 world = place(pixel);
  float irradiance = 0.0;
  int first = stride == 1 ? 0 : (pixel.x & 1) + 2 * (pixel.y & 1);
  for (int j = first; j < samples; j += stride) {
    vec4 map = subject_from_scene[j] * vec4(world, 1.0);
    if (map.w <= 0.0) continue;
    vec3 coordinate = map.xyz / map.w;
    if (any(lessThan(coordinate.xy, vec2(0.0))) || any(greaterThan(coordinate.xy, vec2(1.0)))) continue;
    vec3 way = light_position[j] - world;
    float distance_2 = dot(way, way);
    vec3 direction = way * inversesqrt(distance_2);
    float incidence = dot(normal, direction);
    float exit = light_exit(light_normal, light_cone, direction);
    if (incidence <= 0.0 || exit <= 0.0) continue;
    float blocked = blocked_by_subject(j, coordinate, 1.0 / map.w);
    if (blocked == 0.0) continue;
    vec3 lifted = world + normal * (static_bias * sqrt(distance_2));
    vec4 at = static_from_scene[j] * vec4(lifted, 1.0);
    vec3 c = at.xyz / at.w;
    float open = 1.0;
    if (at.w > 0.0 && all(greaterThan(c, vec3(0.0))) && all(lessThan(c, vec3(1.0))))
      open = texture(static_test, vec4(c.xy, float(j), c.z));
    irradiance += blocked * open * incidence * exit / distance_2;
  }
  taken = vec4(irradiance * share * power, there.a);
}
