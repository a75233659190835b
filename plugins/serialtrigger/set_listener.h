// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Hearing of it when a set has left an element: by the signal `composited`, which composite has, or
/// by the buffers that leave any other.
#pragma once

#include <gst/gst.h>

#include <functional>
#include <string>

namespace polyhull::element {

class SetListener {
 public:
  ~SetListener() { stop(); }

  /// Calls \p heard, on the other element's thread, for each set that leaves the element \p name of
  /// the pipeline around \p seeker; an empty name is the only composite there. Throws Error where
  /// there is no such element.
  void start(GstElement* seeker, const std::string& name, std::function<void()> heard);

  /// Hears no more; nothing where it did not start.
  void stop();

 private:
  GstElement* element_ = nullptr;  // a reference
  GstPad* pad_ = nullptr;          // a reference, where a probe listens
  gulong handle_ = 0;              // of the signal's handler or the probe
};

}  // namespace polyhull::element
