// SPDX-License-Identifier: LGPL-2.1-or-later
// How tests/run.sh runs a test.
#ifndef POLYHULL_TESTS_SUPPORT_RUN_KIND_H
#define POLYHULL_TESTS_SUPPORT_RUN_KIND_H

#include <cstdlib>

namespace polyhull::test {

/// Whether the libraries beneath this program are sanitized, which the program itself need not be
/// (tests/sanitized.sh): then they take their time, and hold back the memory that is freed.
inline bool sanitized() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return true;
#else
  return std::getenv("POLYHULL_SANITIZED") != nullptr;
#endif
}

/// Whether all cases are asked for (tests/run.sh --long), and no sanitizer slows them down.
inline bool at_length() {
  return std::getenv("POLYHULL_LONG") != nullptr && !sanitized();
}

}  // namespace polyhull::test

#endif  // POLYHULL_TESTS_SUPPORT_RUN_KIND_H
