// SPDX-License-Identifier: LGPL-2.1-or-later
// main() of the GoogleTest programs: PROGRAM [NAME] runs all cases, or those of NAME_test.cpp. Where all that would
// run was skipped, for want of data or of a graphics driver, meson is told so (77), instead of a test that passed.
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

namespace {

/// The filter's patterns of the cases of \p name_test.cpp, each with a colon after it.
std::string cases_of(const std::string& name) {
  const std::string file = "/" + name + "_test.cpp";
  const testing::UnitTest& tests = *testing::UnitTest::GetInstance();
  std::string out;
  for (int s = 0; s < tests.total_test_suite_count(); ++s) {
    const testing::TestSuite& suite = *tests.GetTestSuite(s);
    for (int i = 0; i < suite.total_test_count(); ++i)
      if (std::string(suite.GetTestInfo(i)->file()).ends_with(file))
        out += std::string(suite.name()) + "." + suite.GetTestInfo(i)->name() + ":";
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc > 1) {
    const std::string cases = cases_of(argv[1]), filter = GTEST_FLAG_GET(filter);
    if (cases.empty()) {
      // As on a processor for whose instructions all cases are.
      std::fprintf(stderr, "SKIPPED: no case of this program is of %s_test.cpp\n", argv[1]);
      return 77;
    }
    // What is left out by a filter of GoogleTest, after its "-", stays left out; what one names has been chosen by hand.
    const std::size_t left_out = filter.find('-');
    if (filter == "*" || filter.starts_with("*-") || left_out == 0)
      GTEST_FLAG_SET(filter,
                     cases + (left_out == std::string::npos ? "" : filter.substr(left_out)));
  }
  const int failed = RUN_ALL_TESTS();
  const testing::UnitTest& tests = *testing::UnitTest::GetInstance();
  const bool skipped = tests.skipped_test_count() > 0 && tests.successful_test_count() == 0;
  return failed == 0 && skipped ? 77 : failed;
}
