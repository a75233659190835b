// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// References to what GObject and GStreamer count, given back with their scope.
#pragma once

#include <gst/gst.h>

#include <memory>

namespace polyhull::element {

/// Gives a reference back. A mini object is no GObject: each kind that is owned needs its own line.
struct Unref {
  void operator()(GstMemory* memory) const { gst_memory_unref(memory); }
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
  void operator()(GstMiniObject*) const = delete;
  void operator()(GstEvent*) const = delete;
  void operator()(GstMessage*) const = delete;
  void operator()(GstQuery*) const = delete;
  void operator()(GstSample*) const = delete;
  void operator()(gpointer object) const { g_object_unref(object); }
};

/// Owns a reference.
template <class T>
using Ref = std::unique_ptr<T, Unref>;

}  // namespace polyhull::element
