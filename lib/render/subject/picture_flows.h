// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far views' pictures are moved onto each other (PictureFlow) for an eye, for both renderers.
///
/// A surface beside the true one shows a thing at p_i in view i and at p_j in view j; an eye between
/// them, at the angles a_i and a_j, sees it at the place that divides the way from p_i to p_j as
/// a_i : a_j. So view i takes its colours from t_ij = a_i / (a_i + a_j) of its flow to j: nothing
/// from its own place, and since t_ij + t_ji = 1 both show the thing at one place from everywhere.
/// With the weights w of the views that are blended at a point
///   shift_i = sum over j != i of  w_j t_ij flow_ij / max(sum of w_k over k != i, sum of all w / 4),
/// which goes to 0 where the others do not count.
#pragma once

#include "mesh/mesh.h"

namespace polyhull {

/// t of \p flow for \p eye (mesh world coordinates), measured at the hull's middle; 0..1.
float flow_share(const Mesh& mesh, const PictureFlow& flow, const Vec3& eye);

}  // namespace polyhull
