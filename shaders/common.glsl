// SPDX-License-Identifier: LGPL-2.1-or-later
// Put before every shader; the loader adds the #version line and the defines.

const float PI = 3.14159265358979;

// sRGB (IEC 61966-2-1), 0..1.
vec3 to_linear(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

vec3 to_srgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
