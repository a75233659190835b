// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Cases of a program of gst-check: each runs because it is there. Each has a process of its own, but for
/// CK_FORK=no in the environment (tests/run.sh): then they run one after the other in one process, a check
/// that fails leaves its case by longjmp, without destructors, and only the case's own thread may check.
#pragma once

#include <gst/check/gstcheck.h>

// The standard library has functions of this name.
#undef fail

/// A case, called \p name: ELEMENT_TEST(name) { ... }
#define ELEMENT_TEST(name)                                           \
  static void name();                                                \
  [[maybe_unused]] static const bool name##_is_there =               \
      ::polyhull::test::add_case({#name, __FILE__, __LINE__, name}); \
  static void name()

namespace polyhull::test {

struct ElementCase {
  const char* name;
  const char* file;
  int line;
  void (*run)();
};

/// Has the program run the case after those before it. True.
bool add_case(const ElementCase& added);

/// Has the program call \p prepare before the first case: what it makes, all cases have.
bool before_cases(void (*prepare)());

}  // namespace polyhull::test
