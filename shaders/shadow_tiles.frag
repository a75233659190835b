// SPDX-License-Identifier: LGPL-2.1-or-later
// Which tiles of the picture subjects may shade: whether anything of them lies in the light's map around
// the tile's own extent there, by the map's summed areas (lib/render/light_reach.h: LightReach::may_shade).
uniform sampler2D extents;     // reach.frag
uniform sampler2D nearest;
uniform highp isampler2D sums; // filled texels above and left of each corner
uniform vec2 map_low;          // texel = (tangent - low) * scale
uniform vec2 map_scale;
uniform vec2 reach;            // of the light, half, in tangents per 1/z
uniform float subject_nearest; // largest 1/z of the subjects
uniform vec2 around;           // what the shadow maps' texels spread, in tangents
uniform bool everywhere;
uniform bool behind;           // behind the light's plane, too
layout(location = 0) out vec4 shaded;

void main() {
  ivec2 tile = ivec2(gl_FragCoord.xy);
  vec4 extent = texelFetch(extents, tile, 0);
  bool empty = extent.x > extent.z;
  bool may = everywhere && (behind || !empty);
  if (!everywhere && !empty) {
    float between = subject_nearest - texelFetch(nearest, tile, 0).r;
    vec2 aside = reach * between + around;
    float texels = float(textureSize(sums, 0).x - 1);
    vec2 first = (extent.xy - aside - map_low) * map_scale - 1.0;
    vec2 last = (extent.zw + aside - map_low) * map_scale + 1.0;
    if (between > 0.0 && all(greaterThanEqual(last, vec2(0.0))) && all(lessThanEqual(first, vec2(texels)))) {
      ivec2 a = ivec2(clamp(first, 0.0, texels)), b = ivec2(clamp(last + 1.0, 0.0, texels));
      may = texelFetch(sums, b, 0).r - texelFetch(sums, ivec2(b.x, a.y), 0).r -
            texelFetch(sums, ivec2(a.x, b.y), 0).r + texelFetch(sums, a, 0).r > 0;
    }
  }
  shaded = vec4(may ? 1.0 : 0.0, 0.0, 0.0, 1.0);
}
