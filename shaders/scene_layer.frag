// SPDX-License-Identifier: LGPL-2.1-or-later
// What of the scene's surfaces the shadow asks for, kept as long as the view stays: what they scatter
// evenly, albedo / pi, and their normals, to the eye's side; and 1/z of both. With CLIPPED, what a mirror
// shows: nothing from behind its plane.
in vec3 world;
in vec3 world_normal;
in vec2 uv;
uniform vec3 eye;
#ifdef CLIPPED
uniform vec4 plane;  // dot(plane.xyz, X) + plane.w > 0 is kept
#endif
layout(location = 0) out vec4 albedo;
layout(location = 1) out vec4 surface;

void main() {
#ifdef CLIPPED
  if (dot(plane.xyz, world) + plane.w <= 0.0) discard;
#endif
  vec3 normal = normalize(world_normal);
  vec3 way = eye - world;
  if (dot(normal, way) < 0.0) normal = -normal;
  albedo = vec4(diffuse_albedo(uv, dot(normal, normalize(way))) / PI, gl_FragCoord.w);
  surface = vec4(normal, gl_FragCoord.w);
}
