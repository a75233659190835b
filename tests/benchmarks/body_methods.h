// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The ways from silhouettes to a surface that the body's benchmark compares.
#pragma once

#include <functional>
#include <vector>

#include "support/body_scenes.h"

namespace polyhull::benchmark {

/// A way from a scene to a surface. It is given the scene's hull, which its time does not count.
struct Method {
  const char* name;
  std::function<Hull(const test::BodyScene& scene, const Hull& hull)> surface;
  bool always = true;  ///< false: only where asked for by name
};

/// All of them; they keep what they like from call to call, but for their results' sake. A new
/// method is a line in body_methods.cpp.
std::vector<Method> body_methods(int threads);

}  // namespace polyhull::benchmark
