// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far a long work is, on standard error: one line that changes on a terminal, one line per
/// tenth elsewhere.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <string>

namespace polyhull {

class ProgressLine {
 public:
  explicit ProgressLine(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

  /// \p part: 0 to 1 of \p what.
  void operator()(const std::string& what, double part) {
    const int tenth = static_cast<int>(10.0 * part + 1e-9);
    if (quiet_ || (!terminal_ && what == what_ && tenth == tenth_)) return;
    if (terminal_)
      std::fprintf(stderr, "\r\033[K%s: %.0f %%%s", what.c_str(), 100.0 * part,
                   part >= 1.0 ? "\n" : "");
    else
      std::fprintf(stderr, "%s: %d %%\n", what.c_str(), 10 * tenth);
    std::fflush(stderr);
    what_ = what;
    tenth_ = tenth;
  }

 private:
  bool quiet_, terminal_;
  std::string what_;
  int tenth_ = -1;
};

}  // namespace polyhull
