// SPDX-License-Identifier: LGPL-2.1-or-later
// What is seen of the environment where nothing of the scene is (lib/environment/environment.h).
uniform mat4 scene_from_clip;
uniform vec2 size;              // of the picture, pixels
uniform sampler2D environment;  // radiance
uniform float turn;             // of a whole one
uniform vec3 sky;               // by what the radiance becomes a picture value
layout(location = 0) out vec4 radiance;

void main() {
  vec2 at = 2.0 * gl_FragCoord.xy / size - 1.0;
  vec4 near = scene_from_clip * vec4(at, -1.0, 1.0);
  vec4 far = scene_from_clip * vec4(at, 1.0, 1.0);
  vec3 way = normalize(far.xyz / far.w - near.xyz / near.w);
  vec2 place = vec2(atan(way.z, way.x) / (2.0 * PI) + 0.5 + turn, acos(clamp(way.y, -1.0, 1.0)) / PI);
  radiance = vec4(min(sky * texture(environment, place).rgb, 1.0), 0.0);
}
