// SPDX-License-Identifier: LGPL-2.1-or-later
// Puts the layers together, in linear light: background - shadow + Fresnel * (mirror image of the
// subject - what the mirror showed there), then the subject over it. Where no layer has anything the
// background's bytes pass unchanged.
uniform sampler2D background;      // sRGB-coded values
uniform bool has_shadow;
uniform bool has_mirror;
uniform bool has_subject;
uniform sampler2D shadow;          // light taken away
uniform sampler2D mirror;          // premultiplied subject, coverage
uniform sampler2D mirrored_scene;  // what the mirror showed
uniform sampler2D subject;         // premultiplied, coverage
uniform vec3 ray_x;                // world direction of the ray through pixel (x, y): x ray_x + y ray_y + ray_0
uniform vec3 ray_y;
uniform vec3 ray_0;
uniform vec3 mirror_normal;
uniform vec3 mirror_f0;
uniform bool only_mirrors;         // all light from there is what the mirror showed
uniform float reflection_alpha;    // >= 0: this share instead of Fresnel's
layout(location = 0) out vec4 colour;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 coded = texelFetch(background, pixel, 0);
  vec3 taken = has_shadow ? texelFetch(shadow, pixel, 0).rgb : vec3(0.0);
  vec4 image = has_mirror ? texelFetch(mirror, pixel, 0) : vec4(0.0);
  vec4 front = has_subject ? texelFetch(subject, pixel, 0) : vec4(0.0);
  // Less than a sixth of the smallest step of the darkest values is no change.
  if (front.a == 0.0 && image.a == 0.0 && all(lessThan(taken, vec3(4e-5)))) {
    colour = coded;
    return;
  }
  vec3 light = max(to_linear(coded.rgb) - taken, 0.0);
  if (image.a > 0.0) {
    vec2 p = gl_FragCoord.xy - 0.5;
    float cosine = clamp(-dot(normalize(p.x * ray_x + p.y * ray_y + ray_0), mirror_normal), 0.0, 1.0);
    if (reflection_alpha >= 0.0) {
      light = mix(light, image.rgb / image.a, reflection_alpha * image.a);
    } else {
      vec3 fresnel = mirror_f0 + (1.0 - mirror_f0) * pow(1.0 - cosine, 5.0);
      vec3 shown = texelFetch(mirrored_scene, pixel, 0).rgb;
      // What it showed is known roughly only where the picture does not hold it; it was not more than
      // what is there.
      vec3 gone = only_mirrors ? light : min(fresnel * shown, light);
      light += fresnel * image.rgb - image.a * gone;
    }
  }
  light = light * (1.0 - front.a) + front.rgb;
  colour = vec4(to_srgb(light), mix(coded.a, 1.0, front.a));
}
