// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The lock that every GstObject has, for as long as a scope lasts. It protects an element's
/// settings; no pad is called while it is held.
#pragma once

#include <gst/gst.h>

#include <tuple>

namespace polyhull::element {

/// Holds the object lock of one GstObject.
class ObjectLock {
 public:
  explicit ObjectLock(gpointer object) : object_(object) { GST_OBJECT_LOCK(object_); }
  ~ObjectLock() { GST_OBJECT_UNLOCK(object_); }
  ObjectLock(const ObjectLock&) = delete;
  ObjectLock& operator=(const ObjectLock&) = delete;

 private:
  gpointer object_;
};

/// A copy of \p value taken under the object lock of \p object.
template <class T>
T snapshot(gpointer object, const T& value) {
  const ObjectLock lock(object);
  return value;
}

/// Copies of \p values of one moment.
template <class... T>
std::tuple<T...> snapshots(gpointer object, const T&... values) {
  const ObjectLock lock(object);
  return {values...};
}

}  // namespace polyhull::element
