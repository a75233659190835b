// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Says which input an aggregator waits for, when it waits for seconds: an element that gets nothing
/// is not called, so a clock looks after it.
#pragma once

#include <gst/gst.h>

namespace polyhull::element {

/// For an element whose sink pads are live pads. Each silent pad is named in one warning, again
/// only after something has come there.
class InputWatch {
 public:
  explicit InputWatch(GstElement* element) : element_(element) {}
  ~InputWatch() { stop(); }
  InputWatch(const InputWatch&) = delete;
  InputWatch& operator=(const InputWatch&) = delete;

  /// From the state PAUSED on, and no longer.
  void start();
  void stop();

 private:
  GstElement* element_;
  GstClockID id_ = nullptr;
};

}  // namespace polyhull::element
