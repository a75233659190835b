// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Working memory of threads. Internal.
#pragma once

namespace polyhull::silhouette {

/// Memory that a thread keeps, one for each type. Not inlined: loops would find its address again
/// and again.
template <class Memory>
[[gnu::noinline]] Memory& kept_by_thread() {
  static thread_local Memory memory;
  return memory;
}

}  // namespace polyhull::silhouette
