// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Says which input an aggregator waits for, when it waits for seconds: an element that gets
/// nothing is not called, so a clock looks after it.
#pragma once

#include <gst/gst.h>

namespace polyhull::element {

/// For an aggregator whose sink pads are live pads. Each silent pad is named in one warning, again
/// only after something has come there.
class InputWatch {
 public:
  /// Where silence is worth a word: an element may have its own words for live inputs.
  enum class In { files, all_streams };

  explicit InputWatch(GstElement* element, In in = In::all_streams) : element_(element), in_(in) {}
  ~InputWatch() { stop(); }
  InputWatch(const InputWatch&) = delete;
  InputWatch& operator=(const InputWatch&) = delete;

  /// From the state PAUSED on, and no longer.
  void start();
  void stop();

 private:
  GstElement* element_;
  In in_;
  GstClockID id_ = nullptr;
};

}  // namespace polyhull::element
