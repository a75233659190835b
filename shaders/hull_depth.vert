// SPDX-License-Identifier: LGPL-2.1-or-later
// A hull's positions alone, for shadow maps.
layout(location = 0) in vec3 position;
uniform mat4 clip_from_local;

void main() {
  gl_Position = clip_from_local * vec4(position, 1.0);
}
