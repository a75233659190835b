// SPDX-License-Identifier: LGPL-2.1-or-later
// Puts the layers together, in linear light: background - shadow - Fresnel * the mirror's view of the
// shadow + Fresnel * (mirror image of the subject - what the mirror showed there), then the subject over
// it. Where no layer has anything the background's bytes pass unchanged. Each tile of the picture is
// drawn with the layers that reach it: SHADOW, MIRROR_SHADOW (GRID_STEP: pixels of the picture a pixel of
// the shadow's grid), MIRROR, SUBJECT.
uniform sampler2D background;      // sRGB-coded values
#if defined(SHADOW) || defined(MIRROR_SHADOW)
uniform sampler2D surface;         // albedo / pi, 1/z; on the mirror -1/z
uniform vec3 light_power;          // radiance * area (point: intensity), times exposure
#endif
#ifdef SHADOW
uniform sampler2D taken;           // irradiance, 1/z, on the shadow's grid
#endif
#ifdef MIRROR_SHADOW
uniform sampler2D mirrored_surface;  // as surface and taken, of what the mirror shows
uniform sampler2D mirrored_taken;
#endif
#ifdef MIRROR
uniform sampler2D mirror;          // premultiplied subject, coverage
uniform sampler2D mirrored_scene;  // what the mirror showed
uniform float reflection_alpha;    // >= 0: this share instead of Fresnel's
#endif
#if defined(MIRROR) || defined(MIRROR_SHADOW)
uniform vec3 ray_x;                // world direction of the ray through pixel (x, y): x ray_x + y ray_y + ray_0
uniform vec3 ray_y;
uniform vec3 ray_0;
uniform vec3 mirror_normal;
uniform vec3 mirror_f0;
uniform bool only_mirrors;         // all light from there is what the mirror showed

// The share of light from there that the mirror reflects, by Schlick.
vec3 reflectance() {
  vec2 p = gl_FragCoord.xy - 0.5;
  float cosine = clamp(-dot(normalize(p.x * ray_x + p.y * ray_y + ray_0), mirror_normal), 0.0, 1.0);
  return mirror_f0 + (1.0 - mirror_f0) * pow(1.0 - cosine, 5.0);
}
#endif
#ifdef SUBJECT
uniform sampler2D subject;         // premultiplied, coverage
#endif
layout(location = 0) out vec4 colour;

#if defined(SHADOW) || defined(MIRROR_SHADOW)
// The light that is missing: from the grid's pixels around that lie on this pixel's surface.
vec3 missing(ivec2 pixel, sampler2D surfaces, sampler2D grid) {
  vec4 own = texelFetch(surfaces, pixel, 0);
#if GRID_STEP == 1
  float irradiance = texelFetch(grid, pixel, 0).x;
#else
  own.a = abs(own.a);
  vec2 at = vec2(pixel) / float(GRID_STEP);
  vec2 base = floor(at), f = at - base;
  ivec2 last = (textureSize(surfaces, 0) + GRID_STEP - 1) / GRID_STEP - 1;
  float sum = 0.0, weight = 0.0;
  for (int k = 0; k < 4; ++k) {
    ivec2 step_to = ivec2(k & 1, k >> 1);
    vec2 texel = texelFetch(grid, clamp(ivec2(base) + step_to, ivec2(0), last), 0).xy;
    vec2 linear = mix(1.0 - f, f, vec2(step_to));
    float difference = (texel.y - own.a) / (0.02 * own.a);
    float w = (linear.x * linear.y + 1e-3) * (exp(-difference * difference) + 1e-6);
    sum += w * texel.x;
    weight += w;
  }
  float irradiance = own.a > 0.0 ? sum / weight : 0.0;
#endif
  // Where nothing is taken the surface may not have been drawn.
  return irradiance > 0.0 ? own.rgb * light_power * irradiance : vec3(0.0);
}
#endif

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 coded = texelFetch(background, pixel, 0);
  vec3 gone = vec3(0.0);
  vec4 image = vec4(0.0), front = vec4(0.0);
#ifdef SHADOW
  gone = missing(pixel, surface, taken);
#endif
#ifdef MIRROR
  image = texelFetch(mirror, pixel, 0);
#endif
#ifdef MIRROR_SHADOW
  if (texelFetch(surface, pixel, 0).a < 0.0) {
    // Before the subject's image, which takes the place of what was there: of all, where the mirror
    // only mirrors, or of what it showed.
    float open = only_mirrors ? 1.0 : 1.0 - image.a;
    gone += open * reflectance() * missing(pixel, mirrored_surface, mirrored_taken);
  }
#endif
#ifdef SUBJECT
  front = texelFetch(subject, pixel, 0);
#endif
  // Less than a sixth of the smallest step of the darkest values is no change.
  if (front.a == 0.0 && image.a == 0.0 && all(lessThan(gone, vec3(4e-5)))) {
    colour = coded;
    return;
  }
  vec3 light = max(to_linear(coded.rgb) - gone, 0.0);
#ifdef MIRROR
  if (image.a > 0.0) {
    if (reflection_alpha >= 0.0) {
      light = mix(light, image.rgb / image.a, reflection_alpha * image.a);
    } else {
      vec3 fresnel = reflectance();
      vec3 shown = texelFetch(mirrored_scene, pixel, 0).rgb;
      // What it showed is known roughly only where the picture does not hold it; it was not more than
      // what is there.
      vec3 hidden = only_mirrors ? light : min(fresnel * shown, light);
      light += fresnel * image.rgb - image.a * hidden;
    }
  }
#endif
  light = light * (1.0 - front.a) + front.rgb;
  colour = vec4(to_srgb(light), mix(coded.a, 1.0, front.a));
}
