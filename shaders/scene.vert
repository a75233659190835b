// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene's geometry, in scene coordinates. The same arithmetic in every pass, so that depths are
// equal to the bit where passes compare them.
invariant gl_Position;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texture_coordinate;
uniform mat4 clip_from_scene;
out vec3 world;
out vec3 world_normal;
out vec2 uv;

void main() {
  world = position;
  world_normal = normal;
  uv = texture_coordinate;
  gl_Position = clip_from_scene * vec4(position, 1.0);
}
