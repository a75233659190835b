// SPDX-License-Identifier: LGPL-2.1-or-later
// A textured hull. Every triangle has up to four views that may colour it (candidates), or, WIDE, a list
// of more (lib/render/subject/hull_vertices.h), so that each fragment can choose among them. Centroid: a sliver is sampled inside itself, not at the pixel's middle
// beside it, where its numbers mean nothing.
layout(location = 0) in vec3 position;   // hull coordinates, relative to its origin
layout(location = 1) in vec4 weight;     // of the candidates, at this vertex; WIDE: this corner's own place
layout(location = 2) in uvec4 candidate; // view slots, the same at the triangle's three vertices; WIDE: its list
layout(location = 3) in vec4 fill;       // the colour where no view counts, linear
#ifdef RELIT
layout(location = 4) in vec3 form;       // by what colours are multiplied (lib/render/light_lattice.h)
centroid out vec3 relit;
#endif

struct View {
  mat4 map_from_local;  // rows: map u * z, map v * z, camera depth z, map depth (0..1)
  vec4 colour_from_map; // scale, offset: map coordinates to picture coordinates (undistorted)
  vec4 pixel_from_map;  // scale, offset: map coordinates to pinhole pixels
  vec4 intrinsics;      // fx, fy, cx, cy
  vec4 skew_and_size;   // skew, what the rim counts, and pixels to picture coordinates: one pixel's width and height
  vec4 origin;          // real pixel at picture coordinate (0, 0)
  vec4 lens[3];         // k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4
  vec4 limits;          // the largest picture and map coordinates that are the view's own
  mat3 colour;          // what linear colours are multiplied by
  vec4 flows;           // of two flows (lib/render/subject/picture_flows.h): the other view's slot or -1, t
};
layout(std140) uniform Views { View views[VIEW_SLOTS]; };

uniform mat4 clip_from_local;
uniform mat4 scene_from_local;

#ifdef WIDE
centroid out vec3 place;
centroid out vec3 shares;
flat out uint list;
#else
centroid out vec4 in_map_0;
centroid out vec4 in_map_1;
centroid out vec4 in_map_2;
centroid out vec4 in_map_3;
centroid out vec4 weights;
flat out uvec4 slots;
flat out vec4 colour_0;
flat out vec4 colour_1;
flat out vec4 colour_2;
flat out vec4 colour_3;
flat out vec4 focals;
#endif
centroid out vec3 world;
centroid out vec3 filling;

void main() {
  vec4 local = vec4(position, 1.0);
#ifdef WIDE
  place = position;
  shares = weight.xyz;
  list = candidate.x | candidate.y << 8u | candidate.z << 16u | candidate.w << 24u;
#else
  in_map_0 = views[candidate.x].map_from_local * local;
  in_map_1 = views[candidate.y].map_from_local * local;
  in_map_2 = views[candidate.z].map_from_local * local;
  in_map_3 = views[candidate.w].map_from_local * local;
  colour_0 = views[candidate.x].colour_from_map;
  colour_1 = views[candidate.y].colour_from_map;
  colour_2 = views[candidate.z].colour_from_map;
  colour_3 = views[candidate.w].colour_from_map;
  focals = vec4(views[candidate.x].intrinsics.x, views[candidate.y].intrinsics.x, views[candidate.z].intrinsics.x,
                views[candidate.w].intrinsics.x);
  weights = weight;
  slots = candidate;
#endif
  filling = fill.rgb;
#ifdef RELIT
  relit = form;
#endif
  world = (scene_from_local * local).xyz;
  gl_Position = clip_from_local * local;
}
