// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene's lamps, taken for points that nothing hides, and its even light. After light.glsl.
uniform int lights;
uniform vec3 light_position[MAX_LIGHTS];
uniform vec3 light_normal[MAX_LIGHTS];  // 0: a point light
uniform vec2 light_cone[MAX_LIGHTS];    // as light.glsl's
uniform vec3 light_power[MAX_LIGHTS];   // radiance * area, or intensity; times exposure
uniform vec3 ambient;                   // irradiance times exposure

// Each falls on the surface with a cosine of least at least.
vec3 lamps_irradiance(vec3 point, vec3 normal, float least) {
  vec3 sum = ambient;
  for (int i = 0; i < lights; ++i) {
    vec3 way = light_position[i] - point;
    float distance_2 = dot(way, way);
    vec3 direction = way * inversesqrt(distance_2);
    float exit = light_exit(light_normal[i], light_cone[i], direction);
    sum += light_power[i] * max(dot(normal, direction), least) * exit / distance_2;
  }
  return sum;
}
