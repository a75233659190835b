// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Scenes in special position, one by one and by name: what a program in plain floating point gets
/// wrong. Rotations and centres are exact in binary, so that what should coincide does so exactly.
#pragma once

#include <string>
#include <vector>

#include "hull_scene.h"

namespace polyhull::test {

struct DegenerateScene {
  std::string name;
  HullScene scene;
  /// Rings are simple and disjoint (they may be too small or collinear), so that the winding rules
  /// of the conventions hold.
  bool simple = true;
};

/// All of them, in a fixed order.
std::vector<DegenerateScene> degenerate_scenes();

/// A camera at \p centre that looks along axis 0..5 (-x +x -y +y -z +z), exact in binary: 1024x768,
/// principal point (512, 384).
Camera axis_camera(const std::string& name, const Vec3& centre, int axis, double focal = 1024);

/// The convex outline of \p points in \p camera, oriented as the conventions have it, at 1/16 px.
std::vector<Vec2f> outline_of(const std::vector<Vec3>& points, const Camera& camera);

/// The eight corners of the box.
std::vector<Vec3> corners_of(const Bounds& box);

}  // namespace polyhull::test
