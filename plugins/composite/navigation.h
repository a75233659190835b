// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Mouse and keys move composite's viewport: dragging with the left button turns it around its
/// target, with the right button moves it sideways, the wheel goes near and far; the arrow keys
/// turn, + and - go near and far.
#pragma once

#include <gst/gst.h>

#include "plugins/composite/properties.h"

namespace polyhull::element {

class ViewportControl {
 public:
  /// Applies a navigation event to \p settings; true: the viewport moved. The caller holds the lock
  /// that protects \p settings.
  bool apply(GstEvent* event, CompositeSettings& settings);

 private:
  int button_ = 0;  // held down
  double x_ = 0.0, y_ = 0.0;
};

}  // namespace polyhull::element
