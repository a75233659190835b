// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/skeleton.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

namespace polyhull {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double step_time = 0.5;       // from one footfall to the next
constexpr double circle_radius = 0.36;  // of the walk
constexpr double swing_share = 0.45;    // of a foot's cycle of two steps that it is in the air

double smooth(double from, double to, double x) {
  x = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return x * x * x * (x * (x * 6.0 - 15.0) + 10.0);
}

/// Rises over [a, b], falls over [c, d].
double plateau(double a, double b, double c, double d, double x) {
  return smooth(a, b, x) - smooth(c, d, x);
}

double wrap(double seconds) {
  const double t = std::fmod(seconds, motion_period);
  return t < 0.0 ? t + motion_period : t;
}

/// Distance along the circle as an angle: one round between 0.8 s and 5.6 s, at even speed inside.
double circle_angle(double t) {
  constexpr double begin = 0.8, end = 5.6, ramp = 0.7;
  const double length = end - begin - ramp;
  const double x = std::clamp(t - begin, 0.0, end - begin);
  const auto eased = [](double s) { return s < ramp ? 0.5 * s * s / ramp : s - 0.5 * ramp; };
  const double total = end - begin;
  const double distance =
      x < total - ramp ? eased(x) : length - 0.5 * (total - x) * (total - x) / ramp;
  return 2.0 * pi * distance / length;
}

double walking(double t) {
  return plateau(0.7, 1.3, 5.0, 5.7, t);
}

double heading(double t) {
  return circle_angle(t) + 0.5 * pi * plateau(0.2, 1.2, 5.2, 6.3, t);
}

Vec3 root_position(double t) {
  const double a = circle_angle(t);
  return {circle_radius * std::sin(a), 0.0, circle_radius * std::cos(a)};
}

Mat3 turn_y(double angle) {
  return Mat3(glm::mat3_cast(glm::angleAxis(angle, Vec3(0, 1, 0))));
}
Mat3 turn_x(double angle) {
  return Mat3(glm::mat3_cast(glm::angleAxis(angle, Vec3(1, 0, 0))));
}
Mat3 turn_z(double angle) {
  return Mat3(glm::mat3_cast(glm::angleAxis(angle, Vec3(0, 0, 1))));
}

RigidMotion about(const Vec3& joint, const Mat3& rotation, const RigidMotion& parent) {
  const Mat3 R = parent.rotation * rotation;
  return {R, parent(joint) - R * joint};
}

/// Columns: along the bone, the hinge's axis, their cross product.
Mat3 frame(const Vec3& along, const Vec3& hinge) {
  const Vec3 u = glm::normalize(along);
  const Vec3 h = glm::normalize(hinge - u * glm::dot(hinge, u));
  return Mat3(u, h, glm::cross(u, h));
}

struct Limb {
  RigidMotion upper, lower;
  Vec3 middle, end;
};

/// Two bones from joint a (posed at \p from) over b to c so that c reaches \p target as far as the
/// bones are long and b lies towards \p pole; at rest b bends towards \p rest_pole.
Limb reach(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& rest_pole, const Vec3& from,
           const Vec3& target, const Vec3& pole) {
  const double l1 = glm::length(b - a), l2 = glm::length(c - b);
  const Vec3 line = target - from;
  const double length = std::clamp(glm::length(line), std::abs(l1 - l2) + 1e-3, (l1 + l2) * 0.9995);
  const Vec3 u = glm::normalize(line);
  const Vec3 side = glm::normalize(pole - u * glm::dot(pole, u));
  const double along = (l1 * l1 - l2 * l2 + length * length) / (2.0 * length);
  const double height = std::sqrt(std::max(l1 * l1 - along * along, 0.0));
  Limb limb;
  limb.middle = from + u * along + side * height;
  limb.end = from + u * length;
  const Vec3 rest_hinge = glm::cross(c - a, rest_pole), hinge = glm::cross(u, side);
  limb.upper.rotation = frame(limb.middle - from, hinge) * glm::transpose(frame(b - a, rest_hinge));
  limb.upper.translation = from - limb.upper.rotation * a;
  limb.lower.rotation =
      frame(limb.end - limb.middle, hinge) * glm::transpose(frame(c - b, rest_hinge));
  limb.lower.translation = limb.middle - limb.lower.rotation * b;
  return limb;
}

struct Footprint {
  Vec3 position;  // of the ankle's foot point, on the floor
  double yaw;
};

/// Where the foot of \p side (+1 left) stands that comes down with step number \p step.
Footprint footprint(int step, double side) {
  // The body passes over the foot in the middle of its stance.
  const double t = wrap((step + (1.0 - swing_share)) * step_time);
  const double yaw = heading(t);
  return {root_position(t) + turn_y(yaw) * Vec3(side * rest::ankle.x, 0.0, 0.0), yaw};
}

struct FootState {
  RigidMotion motion;
  Vec3 ankle;
};

FootState foot_at(double t, double side) {
  // The left foot comes down with even steps, the right one with odd steps.
  const double cycle = t / step_time - (side > 0 ? 0.0 : 1.0);
  const double number = std::floor(cycle / 2.0);
  const double phase = cycle / 2.0 - number;  // 0: comes down
  const int step = static_cast<int>(number) * 2 + (side > 0 ? 0 : 1);
  const Footprint now = footprint(step, side);
  Footprint next = footprint(step + 2, side);
  next.yaw -= 2.0 * pi * std::round((next.yaw - now.yaw) / (2.0 * pi));
  const double stride =
      glm::length(next.position - now.position) + 0.12 * std::abs(next.yaw - now.yaw);
  const double reach_of_step = std::clamp(stride / 0.35, 0.0, 1.0);
  const double stance = 1.0 - swing_share;
  const double s = std::max((phase - stance) / swing_share, 0.0);
  const double moved = s * s * (3.0 - 2.0 * s);
  const Vec3 position = glm::mix(now.position, next.position, moved);
  const double yaw = glm::mix(now.yaw, next.yaw, moved);
  const double lift = 0.085 * reach_of_step * std::pow(std::sin(pi * std::min(s, 1.0)), 2.0);
  // The heel leaves the floor at the end of the stance and the toes point up before the foot lands.
  const double heel = smooth(stance - 0.20, stance + 0.05, phase) *
                      (1.0 - smooth(stance + 0.05, stance + 0.30, phase));
  const double toe = smooth(stance + 0.2, 0.97, phase) * (1.0 - smooth(0.97, 1.0, phase));
  const double pitch = reach_of_step * (0.55 * heel - 0.18 * toe);
  FootState state;
  state.motion.rotation = turn_y(yaw) * turn_x(pitch);
  Vec3 ankle = rest::ankle;
  ankle.x *= side;
  // Turned about the tip of the shoe or the heel, whichever stays low, which then lifts.
  const Vec3 pivot(ankle.x, 0.0, pitch > 0.0 ? rest::shoe_tip : rest::shoe_heel);
  const Vec3 base = position + Vec3(0, lift, 0) + turn_y(yaw) * (pivot - Vec3(ankle.x, 0, 0));
  state.motion.translation = base - state.motion.rotation * pivot;
  state.ankle = state.motion(ankle);
  return state;
}

Mat3 blend(const Mat3& a, const Mat3& b, double s) {
  if (s <= 0.0) return a;
  return Mat3(glm::mat3_cast(glm::slerp(glm::quat_cast(a), glm::quat_cast(b), s)));
}

void pose_arm(double t, double side, const RigidMotion& chest, const RigidMotion& pelvis,
              Pose& pose) {
  const bool left = side > 0;
  const auto sided = [&](const Vec3& v) { return Vec3(v.x * side, v.y, v.z); };
  const Vec3 shoulder = sided(rest::shoulder), elbow = sided(rest::elbow),
             wrist = sided(rest::wrist);
  const double walk = walking(t);
  const double gait = pi * t / step_time;  // the left foot lands at multiples of 2 pi
  const double swing = -std::cos(gait - 0.2) * side * walk;
  const double akimbo = left ? plateau(5.9, 6.7, 9.2, 9.95, t) : plateau(5.9, 6.7, 7.3, 7.9, t);
  const double wave = left ? 0.0 : plateau(7.3, 8.0, 9.2, 9.95, t);

  const Vec3 hanging = shoulder + sided(Vec3(0.085, 0.0, 0.035)) +
                       Vec3(0.0, -0.512 + 0.03 * std::abs(swing), 0.17 * swing + 0.03 * walk);
  const Vec3 on_hip = sided(Vec3(0.212, 1.032, -0.005));
  const double beat = std::sin(2.0 * pi * 1.5 * (t - 7.7));
  const Vec3 waving = sided(Vec3(0.40 + 0.09 * beat, 1.735 - 0.02 * beat * beat, 0.06));
  Vec3 target = glm::mix(chest(hanging), pelvis(on_hip), akimbo);
  target = glm::mix(target, chest(waving), wave);
  // On the way between places the wrist keeps clear of the body.
  const double way = std::max(4.0 * wave * (1.0 - wave), 2.0 * akimbo * (1.0 - akimbo));
  target += chest.rotation * sided(Vec3(0.12, 0.0, 0.07)) * way;
  const Vec3 pole = chest.rotation *
                    sided(glm::mix(glm::mix(Vec3(0.18, 0.0, -1.0), Vec3(1.0, -0.1, -0.5), akimbo),
                                   Vec3(0.75, -0.75, -0.25), wave));
  const Limb arm = reach(shoulder, elbow, wrist, Vec3(0, 0, -1), chest(shoulder), target, pole);

  pose[left ? bone_left_upper_arm : bone_right_upper_arm] = arm.upper;
  pose[left ? bone_left_forearm : bone_right_forearm] = arm.lower;
  // At rest the fingers go on from the forearm with the palm towards the body.
  const Vec3 fingers = wrist - elbow;
  const Vec3 palm(-side * 0.766, -0.643, 0.0);
  const Mat3 rest_frame = glm::transpose(frame(fingers, palm));
  const Mat3 hip_hand = pelvis.rotation *
                        frame(sided(Vec3(-0.42, -0.42, 0.80)), sided(Vec3(-0.9, -0.1, -0.35))) *
                        rest_frame;
  const Mat3 wave_hand = chest.rotation * turn_z(-side * 0.35 * beat) *
                         frame(sided(Vec3(0.12, 1.0, 0.05)), Vec3(0.0, 0.0, 1.0)) * rest_frame;
  Mat3 hand = arm.lower.rotation;
  hand = blend(hand, hip_hand, akimbo);
  hand = blend(hand, wave_hand, wave);
  pose[left ? bone_left_hand : bone_right_hand] = {hand, arm.end - hand * wrist};
}

void pose_leg(double t, double side, const RigidMotion& pelvis, Pose& pose) {
  const bool left = side > 0;
  const auto sided = [&](const Vec3& v) { return Vec3(v.x * side, v.y, v.z); };
  const FootState foot = foot_at(t, side);
  const Vec3 forward = glm::normalize(pelvis.rotation * Vec3(0, 0, 1) +
                                      foot.motion.rotation * Vec3(0.15 * side, 0, 1));
  const Limb leg = reach(sided(rest::hip), sided(rest::knee), sided(rest::ankle), Vec3(0, 0, 1),
                         pelvis(sided(rest::hip)), foot.ankle, forward);
  pose[left ? bone_left_thigh : bone_right_thigh] = leg.upper;
  pose[left ? bone_left_shin : bone_right_shin] = leg.lower;
  pose[left ? bone_left_foot : bone_right_foot] = foot.motion;
}

}  // namespace

Pose pose_at(double seconds) {
  const double t = wrap(seconds);
  const double walk = walking(t);
  const double gait = pi * t / step_time;
  const double akimbo = plateau(5.9, 6.7, 9.2, 9.95, t);
  const double wave = plateau(7.3, 8.0, 9.2, 9.95, t);
  const double breath = std::sin(2.0 * pi * t / 2.5);

  Pose pose;
  RigidMotion root{turn_y(heading(t)), root_position(t)};
  const double bob = walk * (-0.012 - 0.010 * std::cos(2.0 * gait - 0.5)) - 0.008;
  const double sway =
      0.018 * walk * std::cos(gait - 0.5 * pi) + 0.022 * akimbo * (1.0 - 0.3 * wave);
  root.translation += root.rotation * Vec3(sway, bob, 0.0);
  const double twist = 0.10 * walk * std::cos(gait - 0.2);
  RigidMotion& pelvis = pose[bone_pelvis];
  pelvis = about(rest::pelvis,
                 turn_y(-twist) * turn_z(-0.05 * akimbo - 0.03 * walk * std::sin(gait)), root);
  pose[bone_waist] =
      about(rest::waist, turn_y(twist) * turn_z(0.03 * akimbo) * turn_x(0.03 * walk), pelvis);
  pose[bone_chest] = about(
      rest::chest, turn_y(twist) * turn_z(0.03 * akimbo + 0.03 * wave) * turn_x(0.012 * breath),
      pose[bone_waist]);
  const double look = -0.35 * plateau(6.4, 6.8, 7.1, 7.5, t) + 0.22 * wave;
  pose[bone_neck] =
      about(rest::neck, turn_y(0.4 * look - 0.5 * twist) * turn_x(-0.02 * walk), pose[bone_chest]);
  pose[bone_head] = about(rest::head,
                          turn_y(0.6 * look - 0.5 * twist) * turn_z(0.10 * wave) *
                              turn_x(0.03 * std::sin(2.0 * gait) * walk - 0.02),
                          pose[bone_neck]);
  const double lag = 0.25 * (heading(t) - heading(std::max(t - 0.12, 0.0)));
  pose[bone_ponytail] = about(rest::ponytail,
                              turn_z(-1.2 * lag + 0.10 * walk * std::sin(gait)) *
                                  turn_x(0.10 * walk * (1.0 + std::cos(2.0 * gait))),
                              pose[bone_head]);
  for (const double side : {1.0, -1.0}) {
    pose_leg(t, side, pelvis, pose);
    pose_arm(t, side, pose[bone_chest], pelvis, pose);
  }
  return pose;
}

}  // namespace polyhull
