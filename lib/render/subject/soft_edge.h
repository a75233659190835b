// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Outlines as soft as the mattes: hair is not a polygon.
///
/// A hull ends at the half level of the mattes; what they have beyond it, and that they are not yet full
/// before it, is lost. For a soft edge (RenderSettings::soft_edges) the hull is drawn in by `edge_inset`
/// camera pixels, and along its outline as the eye sees it stands a ribbon from as far within that to
/// `edge_reach` beyond the outline, straight across the line of sight:
///
///            eye               of a point X of the ribbon, alpha is the least over the nearest
///             |                views k of  1 - q_k (1 - a_k),  a_k = n_k m_k + (1 - n_k) min(2 m_k, 1)
///     ........|........        with m_k the view's matte at X,
///   --|--   hull    --|--      n_k how near the view is to the eye, 1 for the nearest,
///     |_______________|        q_k = 0..1 for n_k = .05...25
///
/// after the opacity hull (Matusik et al., Image-based 3D photography using opacity hulls, 2002),
/// whose rays are held against the point of the outline instead of all along. Where a camera stands,
/// this is its own matte; elsewhere the outline is the rim of several cones, so each view must show
/// something there, but only the nearest how much. The hull's other parts stay closed: ribbons add
/// only where it, drawn in, leaves the picture free.
#pragma once

#include <cstddef>
#include <vector>

#include "render/subject/hull_vertices.h"

namespace polyhull {

inline constexpr double edge_inset = 2.0;   ///< camera pixels
inline constexpr double edge_reach = 14.0;  ///< camera pixels

/// The length of edge_reach at the mesh's farthest point from its cameras, world units.
double longest_reach(const Mesh& mesh);

/// How far behind \p map a point may lie for having been drawn in, as a share of the map's depths;
/// \p focal: of its camera.
double inset_depth(const OcclusionMap& map, double focal);

/// By view: what the rim of what it sees still counts where views are blended. Little, so that it
/// smears nothing along the outlines of other eyes; but more the nearer \p eye is to the camera: its
/// rim then is the eye's own. Without \p soft little everywhere.
std::vector<float> rim_shares(const Mesh& mesh, const Vec3& eye, bool soft);

/// Moves the vertices of \p drawing from \p first on into the hull by edge_inset.
void draw_in(const Mesh& mesh, std::size_t first, HullDrawing& drawing);

/// Adds the ribbons of \p mesh as the eye at \p eye (mesh world coordinates) sees it, with
/// the weights of the nearest views. Either side may face the eye.
void add_ribbons(const Mesh& mesh, const Vec3& eye, HullDrawing& drawing);

}  // namespace polyhull
