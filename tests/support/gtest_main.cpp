// SPDX-License-Identifier: LGPL-2.1-or-later
// main() of the GoogleTest programs. Where all that would run was skipped, for want of data or of a
// graphics driver, meson is told so (77), instead of a test that passed.
#include <gtest/gtest.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const int failed = RUN_ALL_TESTS();
  const testing::UnitTest& tests = *testing::UnitTest::GetInstance();
  const bool skipped = tests.skipped_test_count() > 0 && tests.successful_test_count() == 0;
  return failed == 0 && skipped ? 77 : failed;
}
