// SPDX-License-Identifier: LGPL-2.1-or-later
// Colours a hull from its views: per fragment the best of the candidates, weighted by the vertex
// weights, the view's fade (silhouette and occlusion edges) and its depth map. Light is blended
// linearly: the pictures and the target are sRGB textures.
#ifdef WIDE
centroid in vec3 place;   // hull coordinates, relative to its origin
centroid in vec3 shares;  // of the triangle's three corners
flat in uint list;        // where its views begin in `lists`
#else
centroid in vec4 in_map_0;
centroid in vec4 in_map_1;
centroid in vec4 in_map_2;
centroid in vec4 in_map_3;
centroid in vec4 weights;
flat in uvec4 slots;
flat in vec4 colour_0;
flat in vec4 colour_1;
flat in vec4 colour_2;
flat in vec4 colour_3;
flat in vec4 focals;
#endif
centroid in vec3 world;
centroid in vec3 filling;
#ifdef RELIT
centroid in vec3 relit;
#endif

struct View {
  mat4 map_from_local;
  vec4 colour_from_map;
  vec4 pixel_from_map;
  vec4 intrinsics;
  vec4 skew_and_size;
  vec4 origin;
  vec4 lens[3];
  vec4 limits;
  mat3 colour;
  vec4 flows;
};
layout(std140) uniform Views { View views[VIEW_SLOTS]; };

uniform sampler2DArray pictures;
uniform sampler2DArray maps;  // red: depth 0..1, green: fade
uniform sampler2DArray flows;  // two layers for each view: x, y
uniform bool use_maps;
uniform bool use_flows;
uniform float depth_tolerance;  // of the map's 0..1
uniform int best;               // blend this many
uniform float pixel_size;       // of the picture at depth 1, in the mesh's units
uniform float fill_range;       // the sum of weights below which the fill shows
uniform bool shaded;            // by the scene's light (lib/render/subject_light.h)
uniform sampler3D light;         // by what colours are multiplied
uniform vec3 light_scale;       // from scene coordinates to the texture's
uniform vec3 light_offset;
uniform bool graded;            // lib/render/grade.h
uniform vec3 slope;
uniform vec3 offset;
uniform vec3 power;
uniform float saturation;
#ifdef CLIPPED
uniform vec4 plane;
#endif
#ifdef WIDE
uniform usampler2D lists;  // in rows of 1024
#endif
layout(location = 0) out vec4 colour;

float visibility(vec4 in_map, uint slot, float weight) {
  if (weight <= 0.0 || in_map.z <= 0.0) return 0.0;
  if (!use_maps) return weight;
  // Beyond the view's own map its layer holds older ones.
  vec2 at = min(in_map.xy / in_map.z, views[slot].limits.zw);
  vec4 map = texture(maps, vec3(at, float(slot)));
  float behind = in_map.w - map.r;
  return weight * (map.g + views[slot].skew_and_size.y) * (1.0 - smoothstep(depth_tolerance, 2.0 * depth_tolerance, behind));
}

// How far the view's picture is moved towards what others show, in map coordinates; by the weights of
// those of its two flows and of all but itself, of a sum of all (lib/render/subject/picture_flows.h).
vec2 shift_of(vec4 in_map, uint slot, float first, float second, float others, float total) {
  if (!use_flows || others <= 0.0) return vec2(0.0);
  vec2 size = vec2(textureSize(maps, 0).xy);
  vec2 texel = 0.5 * (min(in_map.xy / in_map.z, views[slot].limits.zw) * size - 0.5);
  vec2 at = (texel + 0.5) / vec2(textureSize(flows, 0).xy);
  vec2 shift = first * views[slot].flows.y * texture(flows, vec3(at, float(2u * slot))).xy +
               second * views[slot].flows.w * texture(flows, vec3(at, float(2u * slot + 1u))).xy;
  return shift * (127.0 / 16.0) / (max(others, 0.25 * total) * size);
}

vec2 picture_coordinate(vec4 in_map, uint slot, vec4 from_map, vec2 shift) {
  vec2 map = in_map.xy / in_map.z + shift;
#ifdef DISTORTION
  vec4 k = views[slot].intrinsics;
  vec2 pixel = map * views[slot].pixel_from_map.xy + views[slot].pixel_from_map.zw;
  vec2 p;
  p.y = (pixel.y - k.w) / k.y;
  p.x = (pixel.x - k.z - views[slot].skew_and_size.x * p.y) / k.x;
  vec4 a = views[slot].lens[0];
  vec4 b = views[slot].lens[1];
  vec4 c = views[slot].lens[2];
  float r2 = dot(p, p);
  float radial = (1.0 + r2 * (a.x + r2 * (a.y + r2 * b.x))) / (1.0 + r2 * (b.y + r2 * (b.z + r2 * b.w)));
  vec2 d = p * radial;
  d.x += 2.0 * a.z * p.x * p.y + a.w * (r2 + 2.0 * p.x * p.x) + r2 * (c.x + r2 * c.y);
  d.y += a.z * (r2 + 2.0 * p.y * p.y) + 2.0 * a.w * p.x * p.y + r2 * (c.z + r2 * c.w);
  vec2 real = vec2(k.x * d.x + views[slot].skew_and_size.x * d.y + k.z, k.y * d.y + k.w);
  return (real - views[slot].origin.xy) * views[slot].skew_and_size.zw;
#else
  return map * from_map.xy + from_map.zw;
#endif
}

// Where the subject is drawn smaller than the view saw it: a mix of two of its smaller pictures
// (lib/render/subject/view_picture.h), by how many of its pixels a pixel here spans.
vec4 colour_of(vec4 in_map, uint slot, vec4 from_map, float focal, vec2 shift) {
  float spans = max(pixel_size * focal / (gl_FragCoord.w * in_map.z), 1.0);
  float whole = floor(log2(spans));
  float level = whole + spans * exp2(-whole) - 1.0;
  vec2 at = min(picture_coordinate(in_map, slot, from_map, shift), views[slot].limits.xy);
  vec4 seen = textureLod(pictures, vec3(at, float(slot)), level);
  return vec4(clamp(views[slot].colour * seen.rgb, 0.0, 1.0), min(seen.a, 1.0));
}

#ifdef RIBBON
// What a view of relative weight `near` leaves of a ribbon where its matte is `matte`
// (lib/render/subject/soft_edge.h).
float own_alpha(float near, float matte) {
  float counts = clamp((near - 0.05) * 5.0, 0.0, 1.0);
  float inside = min(2.0 * matte, 1.0);
  return 1.0 - counts * (1.0 - mix(inside, matte, near));
}
#endif

// The weight of the first camera that is left out is taken off the others: what enters and leaves the
// chosen few does so at weight zero, and the blend stays continuous (lib/render/processor/loops/loops.h).
float taken_off(float left_out, float largest) {
  return min(left_out, 0.999 * largest);
}

#ifdef WIDE
uvec4 listed(uint index) {
  return texelFetch(lists, ivec2(int(index & 1023u), int(index >> 10)), 0);
}

vec4 blended() {
  int count = int(listed(list).x);
  float w[VIEW_SLOTS];
  float all = 0.0, largest = 0.0;
  for (int i = 0; i < count; ++i) {
    uvec4 view = listed(list + 1u + uint(i));
    float weight = dot(shares, vec3(view.xyz)) * (1.0 / 65535.0);
    w[i] = visibility(views[view.w].map_from_local * vec4(place, 1.0), view.w, weight);
    all += w[i];
    largest = max(largest, w[i]);
  }
  float left_out = 0.0;  // the one that `best` others come before
  for (int i = 0; best < count && i < count; ++i) {
    int before = 0;
    for (int j = 0; j < count; ++j)
      before += w[j] > w[i] || (w[j] == w[i] && j < i) ? 1 : 0;
    if (before == best) left_out = w[i];
  }
  float off = taken_off(left_out, largest);
  vec3 sum = vec3(0.0);
  float total = 0.0;
  for (int i = 0; i < count; ++i) {
    w[i] = max(w[i] - off, 0.0);
    total += w[i];
  }
  for (int i = 0; i < count; ++i) {
    if (w[i] <= 0.0) continue;
    uint slot = listed(list + 1u + uint(i)).w;
    vec4 in_map = views[slot].map_from_local * vec4(place, 1.0);
    float first = 0.0, second = 0.0;
    for (int j = 0; use_flows && j < count; ++j) {
      float other = float(listed(list + 1u + uint(j)).w);
      first += other == views[slot].flows.x ? w[j] : 0.0;
      second += other == views[slot].flows.z ? w[j] : 0.0;
    }
    vec2 shift = shift_of(in_map, slot, first, second, total - w[i], total);
    sum += w[i] * colour_of(in_map, slot, views[slot].colour_from_map, views[slot].intrinsics.x, shift).rgb;
  }
  vec3 textured = total > 0.0 ? sum / total : filling;
  return vec4(mix(filling, textured, smoothstep(0.0, fill_range, all)), 1.0);
}
#else
// shift_of() by the weights of the others of the four.
vec2 shift_among(vec4 in_map, uint slot, vec4 others, float total) {
#ifdef RIBBON
  return vec2(0.0);  // the mattes stay where they are
#else
  float first = dot(others, vec4(equal(vec4(slots), vec4(views[slot].flows.x))));
  float second = dot(others, vec4(equal(vec4(slots), vec4(views[slot].flows.z))));
  return shift_of(in_map, slot, first, second, others.x + others.y + others.z + others.w, total);
#endif
}

vec4 blended() {
  vec4 w = vec4(visibility(in_map_0, slots.x, weights.x), visibility(in_map_1, slots.y, weights.y),
                visibility(in_map_2, slots.z, weights.z), visibility(in_map_3, slots.w, weights.w));
#ifdef RIBBON
  w += 1e-3 * weights;  // what no view sees free of the hull takes the nearest one's colours
#endif
  float all = w.x + w.y + w.z + w.w;

  // high: the winners of two pairs, low: the losers.
  vec2 high = max(w.xy, w.zw);
  vec2 low = min(w.xy, w.zw);
  float second = max(min(high.x, high.y), max(low.x, low.y));
  float third = min(min(high.x, high.y), max(low.x, low.y));
  float fourth = min(low.x, low.y);
  float left_out = best == 1 ? second : best == 2 ? third : best == 3 ? fourth : 0.0;
  vec4 chosen = max(w - taken_off(left_out, max(high.x, high.y)), 0.0);

  vec3 sum = vec3(0.0);
  float total = chosen.x + chosen.y + chosen.z + chosen.w;
#ifdef RIBBON
  // Hidden or not, a view knows where the subject ends.
  vec4 wanted = weights;
  vec4 near = weights / max(max(weights.x, weights.y), max(weights.z, weights.w));
  float alpha = 1.0;
#else
  vec4 wanted = chosen;
#endif
  if (wanted.x > 0.0) {
    vec4 own = colour_of(in_map_0, slots.x, colour_0, focals.x,
                         shift_among(in_map_0, slots.x, vec4(0.0, chosen.yzw), total));
    sum += chosen.x * own.rgb;
#ifdef RIBBON
    alpha = min(alpha, own_alpha(near.x, own.a));
#endif
  }
  if (wanted.y > 0.0) {
    vec4 own = colour_of(in_map_1, slots.y, colour_1, focals.y,
                         shift_among(in_map_1, slots.y, vec4(chosen.x, 0.0, chosen.zw), total));
    sum += chosen.y * own.rgb;
#ifdef RIBBON
    alpha = min(alpha, own_alpha(near.y, own.a));
#endif
  }
  if (wanted.z > 0.0) {
    vec4 own = colour_of(in_map_2, slots.z, colour_2, focals.z,
                         shift_among(in_map_2, slots.z, vec4(chosen.xy, 0.0, chosen.w), total));
    sum += chosen.z * own.rgb;
#ifdef RIBBON
    alpha = min(alpha, own_alpha(near.z, own.a));
#endif
  }
  if (wanted.w > 0.0) {
    vec4 own = colour_of(in_map_3, slots.w, colour_3, focals.w,
                         shift_among(in_map_3, slots.w, vec4(chosen.xyz, 0.0), total));
    sum += chosen.w * own.rgb;
#ifdef RIBBON
    alpha = min(alpha, own_alpha(near.w, own.a));
#endif
  }
  vec3 textured = total > 0.0 ? sum / total : filling;
#ifdef RIBBON
  float sure = smoothstep(0.0, 1e-6, all);  // ribbons show what little they have
#else
  float sure = smoothstep(0.0, fill_range, all);
#endif
  vec4 result = vec4(mix(filling, textured, sure), 1.0);
#ifdef RIBBON
  result *= alpha;
#endif
  return result;
}
#endif

vec3 grade(vec3 linear) {
  vec3 v = clamp(slope * linear + offset, 0.0, 1.0);
  v = mix(pow(v, power), v, equal(power, vec3(1.0)));
  return clamp(mix(vec3(dot(vec3(0.2126, 0.7152, 0.0722), v)), v, saturation), 0.0, 1.0);
}

void main() {
#ifdef CLIPPED
  if (dot(plane.xyz, world) + plane.w <= 0.0) discard;
#endif
  colour = blended();
#ifdef RELIT
  colour.rgb *= relit;
#endif
  if (shaded) colour.rgb *= texture(light, world * light_scale + light_offset).rgb;
  if (graded) colour.rgb = colour.a * grade(colour.rgb / max(colour.a, 1e-6));
}
