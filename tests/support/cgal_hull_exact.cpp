// SPDX-License-Identifier: LGPL-2.1-or-later
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include "support/cgal_hull_impl.h"

namespace polyhull::test {

CgalHull cgal_hull_exact(std::span<const Silhouette> silhouettes,
                         const std::optional<Bounds>& bounds, double near, double far) {
  try {
    return cgal_hull<CGAL::Exact_predicates_exact_constructions_kernel>(silhouettes, bounds, near,
                                                                        far);
  } catch (const CGAL::Failure_exception&) {
    return {};  // a cone that is not what CGAL takes
  }
}

}  // namespace polyhull::test
