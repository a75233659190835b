// SPDX-License-Identifier: LGPL-2.1-or-later
// Counts what a piece of work takes from memory. Linking malloc_counter.cpp puts the program's
// malloc, and so operator new and the libraries' mallocs, under the count. The address sanitizer
// has its own malloc: there only operator new is counted.
#pragma once

#include <cstddef>
#include <functional>

namespace polyhull::test {

struct MallocCount {
  long taken = 0;           ///< how many pieces of memory
  std::size_t largest = 0;  ///< the largest piece, bytes
};

/// Runs `work` and counts, on all threads, while it runs. Not for two counts at once.
MallocCount count_mallocs(const std::function<void()>& work);

/// Whether malloc is counted (else operator new alone).
bool counts_malloc();

}  // namespace polyhull::test
