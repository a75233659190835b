// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Large arrays of which most of the time a part is looked at.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

namespace polyhull {

/// An array that is 0 wherever nobody has written, and takes memory only in those pages. It comes from the
/// system, which gets it back at once: an allocator would clear it, or keep it.
template <class T>
class SparseArray {
 public:
  static_assert(std::is_trivial_v<T>);
  /// Makes room for \p size elements. Where there is room they stay, else all become 0. Throws std::bad_alloc.
  void make_room(std::size_t size) {
    if (size == 0 || (values_ && size <= values_.get_deleter().size)) return;
    values_.reset();   // the memory first
    size += size / 2;  // for nothing, and what grows from frame to frame is not made anew each time
    void* const bytes = mmap(nullptr, size * sizeof(T), PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (bytes == MAP_FAILED) throw std::bad_alloc();
    values_ = {static_cast<T*>(bytes), {size}};
  }
  T* data() { return values_.get(); }
  const T* data() const { return values_.get(); }
  T& operator[](std::size_t i) { return values_.get()[i]; }
  const T& operator[](std::size_t i) const { return values_.get()[i]; }

 private:
  struct Unmap {
    std::size_t size = 0;
    void operator()(T* values) const { munmap(values, size * sizeof(T)); }
  };
  std::unique_ptr<T, Unmap> values_;
};

}  // namespace polyhull
