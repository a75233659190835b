// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The figure's skeleton and its motion.
///
/// Metres, y up, floor at y = 0; at rest the figure looks along +z with its arms held away from the
/// body, so +x is its left. A pose is one rigid motion per bone, from rest to the posed place:
/// X = rotation * X_rest + translation.
#pragma once

#include <array>

#include "base/vector.h"

namespace polyhull {

enum Bone : int {
  bone_pelvis,
  bone_waist,
  bone_chest,
  bone_neck,
  bone_head,
  bone_ponytail,
  bone_left_upper_arm,
  bone_left_forearm,
  bone_left_hand,
  bone_right_upper_arm,
  bone_right_forearm,
  bone_right_hand,
  bone_left_thigh,
  bone_left_shin,
  bone_left_foot,
  bone_right_thigh,
  bone_right_shin,
  bone_right_foot,
  bone_count
};

/// Rest positions of the joints. Those of the limbs are the left ones; the right ones mirror x.
namespace rest {
inline constexpr Vec3f pelvis{0.0f, 0.95f, 0.0f};
inline constexpr Vec3f waist{0.0f, 1.06f, 0.0f};
inline constexpr Vec3f chest{0.0f, 1.20f, -0.005f};
inline constexpr Vec3f neck{0.0f, 1.455f, -0.018f};
inline constexpr Vec3f head{0.0f, 1.535f, -0.005f};
inline constexpr Vec3f ponytail{0.0f, 1.70f, -0.105f};
inline constexpr Vec3f shoulder{0.172f, 1.400f, -0.012f};
inline constexpr Vec3f elbow{0.356f, 1.182f, -0.014f};
inline constexpr Vec3f wrist{0.516f, 0.990f, 0.0f};
inline constexpr Vec3f hip{0.088f, 0.915f, 0.0f};
inline constexpr Vec3f knee{0.104f, 0.500f, 0.012f};
inline constexpr Vec3f ankle{0.112f, 0.085f, -0.022f};
inline constexpr double shoe_tip = 0.160;    ///< z where the sole leaves the floor in front
inline constexpr double shoe_heel = -0.070;  ///< z where it leaves the floor behind
}  // namespace rest

/// \p joint of the right side.
constexpr Vec3f mirrored(const Vec3f& joint) {
  return {-joint.x, joint.y, joint.z};
}

/// A rigid motion.
struct RigidMotion {
  Mat3 rotation{1.0};
  Vec3 translation{0.0};
  Vec3 operator()(const Vec3& X) const { return rotation * X + translation; }
};

using Pose = std::array<RigidMotion, bone_count>;

/// Seconds after which the motion repeats.
inline constexpr double motion_period = 10.0;

/// The pose at \p seconds, a smooth periodic function: the figure turns, walks one round of a small
/// circle with its feet planted, faces the front with its hands on its hips, waves, and rests.
Pose pose_at(double seconds);

}  // namespace polyhull
