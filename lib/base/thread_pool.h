// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The one pool of threads that all stages of a process share, of its own: docs/benchmarks.md says why.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace polyhull {

/// Sets how many threads one loop may use, 0: as many as the process has cores, which are also the
/// most that are used. Default 0.
void set_pool_threads(int threads);

/// How many threads one loop may use now, at least 1.
int pool_threads();

/// Calls body(begin, end) for disjoint pieces of [0, count) of \p grain elements (the last one may
/// have fewer), on at most \p max_threads threads, the caller's among them (0: as many as
/// pool_threads()), and waits. For one piece, or on one thread, it calls body(0, count) in place.
/// Which piece comes when, and on which thread, is left to chance: bodies must write to places of
/// their own. What a body throws comes out here once no piece is at work; pieces that had not begun
/// are left out.
void parallel_for(std::size_t count, std::size_t grain, int max_threads,
                  const std::function<void(std::size_t begin, std::size_t end)>& body);

/// As parallel_for(), but calls body(i) for each i of [0, count).
template <class Count, class Body>
void parallel_each(Count count, std::size_t grain, int max_threads, const Body& body) {
  parallel_for(static_cast<std::size_t>(count), grain, max_threads,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) body(static_cast<Count>(i));
               });
}

/// Watches the loops that the calling thread starts from the watch's making on.
class LoopWatch {
 public:
  /// How many threads had pieces of a loop, as the mean over the loops of more than one piece; 1
  /// where there was none.
  double threads() const;

  /// Of one thread, ever.
  struct Count {
    std::uint64_t loops = 0;
    std::uint64_t threads = 0;
  };

 private:
  static Count now();
  Count begin_ = now();
};

}  // namespace polyhull
