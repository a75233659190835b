// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What tests of imported calibrations share.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include "base/error.h"
#include "builtin/default_rig.h"
#include "rig/import.h"
#include "support/refusal.h"
#include "text_file.h"

namespace polyhull {

/// A folder of the running test, empty.
inline std::string empty_folder() {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "polyhull_rig_import" /
      ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path);
  return path.string();
}

using test::expect_refused;

/// \p text with each \p from in it made \p to.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  std::size_t at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  for (; at != text.npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
  return text;
}

/// Names, sizes and poses.
inline void expect_same(const Rig& found, const Rig& wanted, double tolerance = 1e-9) {
  ASSERT_EQ(found.cameras.size(), wanted.cameras.size());
  for (std::size_t i = 0; i < wanted.cameras.size(); ++i) {
    const Camera &a = found.cameras[i], &b = wanted.cameras[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.width, b.width);
    EXPECT_LT(glm::length(a.t - b.t), tolerance);
    for (int j = 0; j < 3; ++j) {
      EXPECT_LT(glm::length(a.K[j] - b.K[j]), tolerance * 1000);
      EXPECT_LT(glm::length(a.R[j] - b.R[j]), tolerance);
    }
  }
}

/// default_rig() with distortion.
inline Rig with_lenses() {
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) camera.distortion = {-0.1, 0.02, 0.001, 0.002};
  return rig;
}

/// The vector of rotation_of().
inline Vec3 rodrigues(const Mat3& R) {
  const double angle = std::acos((R[0][0] + R[1][1] + R[2][2] - 1) / 2);
  return angle / (2 * std::sin(angle)) *
         Vec3(R[1][2] - R[2][1], R[2][0] - R[0][2], R[0][1] - R[1][0]);
}

}  // namespace polyhull
