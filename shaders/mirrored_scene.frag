// SPDX-License-Identifier: LGPL-2.1-or-later
// The radiance that a mirror shows where the subject's image will stand, so that it can be taken out:
// a point of the scene that the background itself shows is looked up there; others are lit simply.
in vec3 world;
in vec3 world_normal;
in vec2 uv;

uniform vec4 plane;
uniform vec3 eye;
uniform int lights;
uniform vec3 light_position[MAX_LIGHTS];
uniform vec3 light_normal[MAX_LIGHTS];  // 0: a point light
uniform vec3 light_power[MAX_LIGHTS];   // radiance * area, or intensity; times exposure
uniform vec3 ambient;                   // irradiance times exposure
uniform float exposure;
uniform mat4 clip_from_scene_direct;    // of the viewport itself
uniform sampler2D background;           // sRGB-coded values
uniform sampler2D scene_depth;
uniform bool look_up;                   // off for mirrors: they look different from elsewhere
layout(location = 0) out vec4 radiance;

void main() {
  if (dot(plane.xyz, world) + plane.w <= 0.0) discard;
  if (look_up) {
    vec4 clip = clip_from_scene_direct * vec4(world, 1.0);
    vec3 at = clip.xyz / clip.w * 0.5 + 0.5;
    if (clip.w > 0.0 && all(greaterThan(at, vec3(0.0))) && all(lessThan(at, vec3(1.0)))) {
      float depth = texture(scene_depth, at.xy).r;
      // Depth is 1/z-like: a relative difference of 1/z of half a percent counts as the same point.
      if (abs(depth - at.z) < 0.005 * (1.0 - at.z)) {
        radiance = vec4(to_linear(texture(background, at.xy).rgb), 1.0);
        return;
      }
    }
  }
  vec3 normal = normalize(world_normal);
  vec3 mirrored_eye = eye - 2.0 * (dot(plane.xyz, eye) + plane.w) * plane.xyz;
  if (dot(normal, mirrored_eye - world) < 0.0) normal = -normal;
  vec3 sum = ambient;
  for (int i = 0; i < lights; ++i) {
    vec3 way = light_position[i] - world;
    float distance_2 = dot(way, way);
    vec3 direction = way * inversesqrt(distance_2);
    float exit = light_normal[i] == vec3(0.0) ? 1.0 : max(-dot(light_normal[i], direction), 0.0);
    sum += light_power[i] * max(dot(normal, direction), 0.0) * exit / distance_2;
  }
  radiance = vec4(min(diffuse_albedo(uv, dot(normal, normalize(mirrored_eye - world))) / PI * sum + emission * exposure, 1.0), 1.0);
}
