// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A viewport that mouse and keys turn, move and zoom around what it looks at.
#pragma once

#include <string_view>

#include "base/vector.h"

namespace polyhull {

/// Where a viewport is and where it looks. World units, y up.
struct ViewportPose {
  Vec3 eye{0.0, 1.5, 3.0};
  Vec3 target{0.0, 1.0, 0.0};
};

/// What the operator changed, on top of a pose that may itself move (a path, a controller):
/// dragging with button 1 turns around the target, with button 2 or 3 moves eye and target along
/// the picture's plane, the wheel comes nearer or goes away. Keys: Left, Right, Up, Down turn; w, s
/// (or plus, minus) nearer and away; a, d, q, e move left, right, down, up; Home takes everything
/// back. Positions of the mouse are in pixels of the picture.
class ViewportControl {
 public:
  /// A button, counted from 1, goes down at (\p x, \p y), or up.
  void press(int button, double x, double y);
  void release(int button);
  /// The mouse is now at (\p x, \p y), or the wheel has turned by \p steps (positive: nearer). True
  /// if the view changes.
  bool move(double x, double y, int picture_height);
  bool wheel(double steps);
  /// \p key as GstNavigation names it (X keysym names); false for keys without meaning here.
  bool key(std::string_view key);

  /// \p pose as the operator changed it.
  ViewportPose apply(const ViewportPose& pose) const;
  /// The same for who keeps the pose: the changes are forgotten, a button stays held.
  ViewportPose take(const ViewportPose& pose);

  bool changed() const { return yaw_ != 0 || pitch_ != 0 || nearness_ != 0 || shift_ != Vec3(0.0); }

 private:
  int button_ = 0;  // that is held, 0: none
  double x_ = 0, y_ = 0;
  double yaw_ = 0, pitch_ = 0;  // radians
  double nearness_ = 0;         // logarithm of the distance's factor
  Vec3 shift_{0.0};             // right, up, forward; in distances to the target
};

}  // namespace polyhull
