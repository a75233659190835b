// SPDX-License-Identifier: LGPL-2.1-or-later
// Depth only; with CLIPPED, nothing from behind a mirror's plane.
#ifdef CLIPPED
in vec3 world;
uniform vec4 plane;  // dot(plane.xyz, X) + plane.w > 0 is kept
#endif

void main() {
#ifdef CLIPPED
  if (dot(plane.xyz, world) + plane.w <= 0.0) discard;
#endif
}
