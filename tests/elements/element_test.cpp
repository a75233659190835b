// SPDX-License-Identifier: LGPL-2.1-or-later
// main() of the gst-check programs.
#include "element_test.h"

#include <errno.h>

#include <vector>

#include "support/run_kind.h"

namespace polyhull::test {
namespace {

/// Not a plain variable: cases of other files are added before this one's variables are made.
std::vector<ElementCase>& cases() {
  static std::vector<ElementCase> all;
  return all;
}

std::vector<void (*)()>& preparations() {
  static std::vector<void (*)()> all;
  return all;
}

/// As GST_START_TEST and GST_END_TEST have it.
void run_case(int number) {
  const ElementCase& it = cases()[static_cast<std::size_t>(number)];
  tcase_fn_start(it.name, it.file, it.line);
  it.run();
  gst_task_cleanup_all();
}

}  // namespace

bool add_case(const ElementCase& added) {
  cases().push_back(added);
  return true;
}

bool before_cases(void (*prepare)()) {
  preparations().push_back(prepare);
  return true;
}

}  // namespace polyhull::test

int main(int argc, char** argv) {
  using namespace polyhull::test;
  gst_check_init(&argc, &argv);
  for (void (*prepare)() : preparations()) prepare();
  Suite* suite = suite_create(program_invocation_short_name);
  TCase* general = tcase_create("general");
  // Seconds for each case that has a process of its own: a hang is told before meson ends the program
  // (meson.build, tests/run.sh). With CK_FORK=no nothing but meson ends it.
  tcase_set_timeout(general, sanitized() ? 1190 : 290);
  suite_add_tcase(suite, general);
  const int count = static_cast<int>(cases().size());
  for (int i = 0; i < count; ++i)
    _tcase_add_test(general, run_case, cases()[static_cast<std::size_t>(i)].name, 0, 0, i, i + 1);
  return gst_check_run_suite(suite, program_invocation_short_name, __FILE__);
}
