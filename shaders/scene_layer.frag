// SPDX-License-Identifier: LGPL-2.1-or-later
// What of the scene's surfaces the shadow asks for, kept as long as the view stays. With NORMALS their
// normals, to the eye's side; else what they scatter evenly, albedo / pi. And 1/z of both.
in vec3 world;
in vec3 world_normal;
in vec2 uv;
uniform vec3 eye;
layout(location = 0) out vec4 surface;

void main() {
  vec3 normal = normalize(world_normal);
#ifdef NORMALS
  if (dot(normal, eye - world) < 0.0) normal = -normal;
  surface = vec4(normal, gl_FragCoord.w);
#else
  float cosine = abs(dot(normal, normalize(eye - world)));
  surface = vec4(diffuse_albedo(uv, cosine) / PI, gl_FragCoord.w);
#endif
}
