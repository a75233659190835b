// SPDX-License-Identifier: LGPL-2.1-or-later
// Puts the layers together, in linear light: background - shadow - Fresnel * the mirror's view of the
// shadow + Fresnel * (mirror image of the subject - what the mirror showed there), then the subject over
// it. Where no layer has anything the background's bytes pass unchanged. Each tile of the picture is
// drawn with the layers that reach it: SHADOW, MIRROR_SHADOW (GRID_STEP: pixels of the picture a pixel of
// the shadow's grid), MIRROR, SUBJECT. With FILL the background may be not opaque, and becomes the fill
// and key of lib/render/fill.h there.
uniform sampler2D background;      // sRGB-coded values
#if defined(SHADOW) || defined(MIRROR_SHADOW)
uniform vec3 power;                // of all lights that cast shadows, times exposure
#endif
#ifdef SHADOW
uniform sampler2D surface;         // albedo / pi, 1/z
uniform sampler2D taken;           // irradiance per power, 1/z, on the shadow's grid
#endif
#ifdef MIRROR_SHADOW
uniform sampler2D mirrored_surface;  // as surface and taken, of what the mirror shows where it is seen
uniform sampler2D mirrored_taken;
#endif
#ifdef MIRROR
uniform sampler2D mirror;          // premultiplied subject, coverage
uniform sampler2D mirrored_scene;  // what the mirror showed
uniform float reflection_alpha;    // >= 0: this share instead of Fresnel's
#endif
#if defined(MIRROR) || defined(MIRROR_SHADOW) || defined(FILL)
uniform vec3 ray_x;                // world direction of the ray through pixel (x, y): x ray_x + y ray_y + ray_0
uniform vec3 ray_y;
uniform vec3 ray_0;
#endif
#if defined(MIRROR) || defined(MIRROR_SHADOW)
uniform int mirrors;               // on the way, one seen in the other
uniform vec3 mirror_normal[4];
uniform vec3 mirror_f0[4];
uniform bool only_mirrors;         // all light from there is what the mirrors showed

// The share of light from there that the mirrors reflect, by Schlick.
vec3 reflectance() {
  vec2 p = gl_FragCoord.xy - 0.5;
  vec3 way = normalize(p.x * ray_x + p.y * ray_y + ray_0), share = vec3(1.0);
  for (int i = 0; i < mirrors; ++i) {
    float cosine = clamp(-dot(way, mirror_normal[i]), 0.0, 1.0);
    share *= mirror_f0[i] + (1.0 - mirror_f0[i]) * pow(1.0 - cosine, 5.0);
  }
  return share;
}
#endif
#ifdef SUBJECT
uniform sampler2D subject;         // premultiplied, coverage
#endif
layout(location = 0) out vec4 colour;

#if defined(SHADOW) || defined(MIRROR_SHADOW)
// The light that is missing: from the grid's pixels around that lie on this pixel's surface. And its
// irradiance, per power.
vec3 missing(ivec2 pixel, sampler2D surfaces, sampler2D grid, out vec3 irradiance) {
  vec4 own = texelFetch(surfaces, pixel, 0);
#if GRID_STEP == 1
  irradiance = texelFetch(grid, pixel, 0).rgb;
#else
  vec2 at = vec2(pixel) / float(GRID_STEP);
  vec2 base = floor(at), f = at - base;
  ivec2 last = (textureSize(surfaces, 0) + GRID_STEP - 1) / GRID_STEP - 1;
  vec3 sum = vec3(0.0);
  float weight = 0.0;
  for (int k = 0; k < 4; ++k) {
    ivec2 step_to = ivec2(k & 1, k >> 1);
    vec4 texel = texelFetch(grid, clamp(ivec2(base) + step_to, ivec2(0), last), 0);
    vec2 linear = mix(1.0 - f, f, vec2(step_to));
    float difference = (texel.a - own.a) / (0.02 * own.a);
    float w = (linear.x * linear.y + 1e-3) * (exp(-difference * difference) + 1e-6);
    sum += w * texel.rgb;
    weight += w;
  }
  irradiance = own.a > 0.0 ? sum / weight : vec3(0.0);
#endif
  // Where nothing is taken the surface may not have been drawn.
  return irradiance != vec3(0.0) ? own.rgb * power * irradiance : vec3(0.0);
}
#endif

// The light behind the subject: with its image in the mirror in the place of what that showed.
vec3 mirrored(vec3 light, ivec2 pixel, vec4 image) {
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
  return light;
}

#ifdef FILL
uniform bool premultiplied;
#ifdef SHADOW
uniform vec3 eye;
uniform sampler2D normals;  // and 1/z

// The share of all light there that is missing where this irradiance, per power, is.
float share_taken(ivec2 pixel, vec3 taken) {
  vec4 own = texelFetch(surface, pixel, 0);
  // Metal scatters nothing, so the shadow is not seen on it.
  if (own.a == 0.0 || own.rgb == vec3(0.0) || taken == vec3(0.0)) return 0.0;
  vec3 way = (float(pixel.x) * ray_x + float(pixel.y) * ray_y + ray_0) / own.a;
  vec3 normal = normalize(texelFetch(normals, pixel, 0).xyz);
  // Of a grey surface: on a coloured one it is the same, and black alone has no colour to say more.
  const vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
  const float indirect = 0.25;  // where a lamp hardly shines, others' light is what there is
  float all = dot(luminance, lamps_irradiance(eye + way, normal, indirect));
  return min(dot(luminance, taken * power) / max(all, 1e-30), 1.0);
}
#endif

float mean(vec3 v) {
  return (v.x + v.y + v.z) / 3.0;
}

const vec3 greys = vec3(64.0, 128.0, 192.0) / 255.0;
const float middle = greys.y;

vec3 rounded(vec3 code) {
  return floor(255.0 * code + 0.5) / 255.0;
}

// The least key, in steps of 1 / 255, with which a fill of 0..1 makes that code of the middle grey.
float least_key(vec3 code) {
  vec3 need = max(1.0 - code / middle, (code - middle) / (1.0 - middle));
  return ceil(255.0 * max(max(need.x, need.y), max(need.z, 0.0)) - 1e-3) / 255.0;
}

// As fill_of(), in codes of 0..1. Lost of the background's opaque share, of light in its transparent
// share, and in the mirror.
vec4 fill(ivec2 pixel, vec4 coded, vec3 lost, float share, vec3 lost_in_mirror, vec4 image,
          vec4 front) {
  vec3 own_part = premultiplied ? coded.rgb : coded.a * coded.rgb;
  vec3 level[3], light = vec3(0.0);
  for (int k = 0; k < 3; ++k) {
    vec3 there = to_linear(min(own_part + (1.0 - coded.a) * greys[k], 1.0));
    there = max(there - coded.a * lost - (1.0 - coded.a) * share * there - lost_in_mirror, 0.0);
    there = mirrored(there, pixel, image);
    level[k] = to_srgb(there);
    if (k == 1) light = there;
  }
  bool touched = image.a > 0.0 || any(greaterThan(lost + lost_in_mirror, vec3(4e-5)));
  float key = coded.a;
  if (touched) {
    key = clamp(1.0 - mean(level[2] - level[0]) / (greys.z - greys.x), 0.0, 1.0);
    float least = least_key(rounded(level[1]));
    // Where nothing of the picture below is seen the key is 1.
    if (least >= key - 2.5 / 255.0 && rounded(level[0]) != rounded(level[2])) key = least;
  }
  vec3 whole = level[1];
  if (front.a > 0.0) {
    whole = to_srgb(light * (1.0 - front.a) + front.rgb);
    vec3 own = to_srgb(front.rgb / front.a) - level[1];
    const float coverage_counts = 16.0 * 16.0 / (255.0 * 255.0);
    float subject_key = (dot(own, whole - level[1]) + coverage_counts * front.a) /
                        (dot(own, own) + coverage_counts);
    subject_key = front.a < 1.0 ? clamp(subject_key, 0.0, 1.0) : 1.0;
    key = 1.0 - (1.0 - key) * (1.0 - subject_key);
  }
  whole = rounded(whole);
  key = min(max(floor(255.0 * key + 0.5) / 255.0, least_key(whole)), 1.0);
  vec3 part = min(whole - (1.0 - key) * middle, key);
  part *= step(0.5 / 255.0, part);  // what is less is rounding: shadows are black
  return vec4(premultiplied || key == 0.0 ? part : part / key, key);
}
#endif

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 coded = texelFetch(background, pixel, 0);
  vec3 gone = vec3(0.0), gone_in_mirror = vec3(0.0), irradiance = vec3(0.0);
  vec4 image = vec4(0.0), front = vec4(0.0);
#ifdef SHADOW
  gone = missing(pixel, surface, taken, irradiance);
#endif
#ifdef MIRROR
  image = texelFetch(mirror, pixel, 0);
#endif
#ifdef MIRROR_SHADOW
  if (texelFetch(mirrored_surface, pixel, 0).a > 0.0) {
    // Before the subject's image, which takes the place of what was there: of all, where the mirror
    // only mirrors, or of what it showed.
    float open = only_mirrors ? 1.0 : 1.0 - image.a;
    vec3 unasked;
    gone_in_mirror = open * reflectance() * missing(pixel, mirrored_surface, mirrored_taken, unasked);
  }
#endif
#ifdef SUBJECT
  front = texelFetch(subject, pixel, 0);
#endif
#ifdef FILL
  vec3 lost = gone;
#endif
  gone += gone_in_mirror;
  // Less than a sixth of the smallest step of the darkest values is no change.
  if (front.a == 0.0 && image.a == 0.0 && all(lessThan(gone, vec3(4e-5)))) {
    colour = coded;
    return;
  }
#ifdef FILL
  if (coded.a < 1.0) {
    float share = 0.0;
#ifdef SHADOW
    share = share_taken(pixel, irradiance);
#endif
    colour = fill(pixel, coded, lost, share, gone_in_mirror, image, front);
    return;
  }
#endif
  vec3 light = mirrored(max(to_linear(coded.rgb) - gone, 0.0), pixel, image);
  light = light * (1.0 - front.a) + front.rgb;
  colour = vec4(to_srgb(light), mix(coded.a, 1.0, front.a));
}
