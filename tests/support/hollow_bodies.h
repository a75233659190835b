// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Bodies with hollows that no silhouette shows, of one shade to the next as stone is: what cameras'
/// colours say beyond their silhouettes.
#pragma once

#include <vector>

#include "support/body_scenes.h"

namespace polyhull::test {

/// "dented": a post with five dents of 10 cm; "armchair": a seat between a back and two arms.
std::vector<Body> hollow_bodies();

}  // namespace polyhull::test
