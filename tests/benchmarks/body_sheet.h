// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Surfaces and the truth side by side, to be looked at.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "support/body_scenes.h"

namespace polyhull::benchmark {

/// Pictures of one scene from half way between its first two cameras, in two rows: plaster above,
/// colours below.
class BodySheet {
 public:
  /// \p hull: of the scene, which says what the pictures hold. Both outlive the sheet.
  BodySheet(const test::BodyScene& scene, const Hull& hull);

  /// A column.
  void add(const Hull& surface);

  /// Adds the truth as the last column and writes the sheet. Throws Error as save_picture().
  void save(const std::string& path);

 private:
  const test::BodyScene& scene_;
  const Camera& camera_;
  Rectangle region_;
  std::vector<std::array<Picture, 2>> columns_;
};

}  // namespace polyhull::benchmark
