// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The studio's surfaces and the distances between them, under the tests' name.
#pragma once

#include "studio/plan/surface.h"

namespace polyhull::test {

using polyhull::distance_between, polyhull::TriangleSurface, polyhull::surface_of,
    polyhull::SurfaceDistance, polyhull::volume_of;

}  // namespace polyhull::test
