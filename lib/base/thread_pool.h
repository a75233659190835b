// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The one pool of threads that all stages of a process share (oneTBB underneath).
#pragma once

#include <cstddef>
#include <functional>

namespace polyhull {

/// Sets how many threads the pool may use, 0: as many as the machine has cores, which are also the
/// most that are used. Default 0.
void set_pool_threads(int threads);

/// How many threads the pool may use now, at least 1.
int pool_threads();

/// Calls body(begin, end) for disjoint pieces of [0, count) of at most \p grain elements, on at most
/// \p max_threads threads of the pool (0: all of it), and waits. On one thread it calls body(0, count)
/// in place. The pieces do not depend on the number of threads' timing, but their order does: bodies
/// must write to places of their own.
void parallel_for(std::size_t count, std::size_t grain, int max_threads,
                  const std::function<void(std::size_t begin, std::size_t end)>& body);

}  // namespace polyhull
