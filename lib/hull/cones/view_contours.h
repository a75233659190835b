// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One view's rings as a cone takes them: within the frame if that carves too, and in the picture
/// of the cone's camera.
#pragma once

#include "hull/cones/clean_region.h"
#include "hull/cones/cone.h"

namespace polyhull::hull {

/// The rings of \p input with the number of each point in them. With \p complement they are cut at
/// the frame's border, and that is added as a ring whose edges are numbered after the silhouette's
/// points. A view from the centre of \p camera, but with another calibration, is moved into its
/// picture. \throw Error naming the camera for points that are not finite.
Contours view_contours(const ConeInput& input, const ConeCamera& camera, bool complement);

}  // namespace polyhull::hull
