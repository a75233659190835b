// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The cones of a set of views, kept from call to call: only those that have changed are made anew.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "hull/cones/cone.h"
#include "hull/hull.h"

namespace polyhull::hull {

/// What of a view decides its part of the hull, kept to compare with the next call's.
struct ViewCopy {
  Camera camera;
  Rings rings;
  bool same(const Silhouette& view) const { return camera == *view.camera && rings == *view.rings; }
  void copy(const Silhouette& view) { camera = *view.camera, rings = *view.rings; }
};

class ConeCache {
 public:
  /// Sets \p used to the cones of the views in an order that depends on their content alone; views
  /// of one centre share a cone. \p cameras: those of the views. The cones stay valid until the
  /// next call. \throw Error as build_cone().
  void prepare(std::span<const Silhouette> views, std::span<const ConeCamera> cameras,
               const Lattice& lattice, Unseen unseen, int threads, std::vector<const Cone*>& used);

  void clear() { cones_.clear(); }

 private:
  /// A cone with what it was made from.
  struct CachedCone {
    Cone cone;
    std::vector<ViewCopy> from;
    std::vector<std::int32_t> views;
    Lattice lattice;
    Unseen unseen = Unseen::carve;
  };
  std::vector<std::unique_ptr<CachedCone>> cones_;
};

}  // namespace polyhull::hull
