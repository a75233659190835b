// SPDX-License-Identifier: LGPL-2.1-or-later
// One triangle over the whole target; the scissor cuts it to what is needed.
void main() {
  vec2 p = vec2(float((gl_VertexID & 1) << 2), float((gl_VertexID & 2) << 1));
  gl_Position = vec4(p - 1.0, 0.0, 1.0);
}
