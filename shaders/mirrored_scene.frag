// SPDX-License-Identifier: LGPL-2.1-or-later
// The radiance that a mirror shows where the subject's image will stand, so that it can be taken out:
// a point of the scene that the background itself shows is looked up there; others are lit simply.
in vec3 world;
in vec3 world_normal;
in vec2 uv;

uniform vec4 plane;
uniform vec3 eye;
uniform float exposure;
uniform mat4 clip_from_scene_direct;    // of the viewport itself
uniform sampler2D background;           // sRGB-coded values
uniform bool translucent;               // it is looked up where it is opaque only
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
        vec4 seen = texture(background, at.xy);
        radiance = vec4(to_linear(seen.rgb), 1.0);
        if (!translucent || seen.a > 0.999) return;
      }
    }
  }
  vec3 normal = normalize(world_normal);
  vec3 mirrored_eye = eye - 2.0 * (dot(plane.xyz, eye) + plane.w) * plane.xyz;
  if (dot(normal, mirrored_eye - world) < 0.0) normal = -normal;
  vec3 sum = lamps_irradiance(world, normal, 0.0);
  radiance = vec4(min(diffuse_albedo(uv, dot(normal, normalize(mirrored_eye - world))) / PI * sum + emission * exposure, 1.0), 1.0);
}
