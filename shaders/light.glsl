// SPDX-License-Identifier: LGPL-2.1-or-later
// The share of a light's power that it sends in the direction away from -direction (to the light), as
// light_exit() of render/light_samples.h.
// normal: 0 for a point light; cone: a spot's scale and offset (scene/spot_cone.h), 0 and 1 for others.
float light_exit(vec3 normal, vec2 cone, vec3 direction) {
  if (normal == vec3(0.0)) return 1.0;
  float cosine = max(-dot(normal, direction), 0.0);
  float share = clamp(cone.x * cosine + cone.y, 0.0, 1.0);
  return cone.x > 0.0 ? share * share : cosine;
}
