// SPDX-License-Identifier: LGPL-2.1-or-later
// The shape of the figure at rest. Lengths in metres, from a person of 1.75 m.
#include "studio/figure/figure.h"

namespace polyhull {
namespace {

using Kind = SkinBody::Kind;

SkinBody cone(int bone, Vec3f a, Vec3f b, float ra, float rb, float blend) {
  SkinBody body;
  body.bone = bone;
  body.a = a;
  body.b = b;
  body.ra = ra;
  body.rb = rb;
  body.blend = blend;
  return body;
}

SkinBody flat_cone(int bone, Vec3f a, Vec3f b, float ra, float rb, Vec3f squash, float flatness,
                   float blend) {
  SkinBody body = cone(bone, a, b, ra, rb, blend);
  // Only across the axis, so that the ends stay where they are.
  const Vec3f axis = glm::normalize(b - a);
  body.squash = glm::normalize(squash - axis * glm::dot(squash, axis));
  body.flatness = flatness;
  return body;
}

SkinBody ellipsoid(int bone, Vec3f centre, Vec3f radii, float blend) {
  SkinBody body;
  body.kind = Kind::ellipsoid;
  body.bone = bone;
  body.a = centre;
  body.b = radii;
  body.blend = blend;
  return body;
}

void add_torso(std::vector<SkinBody>& skin) {
  skin.push_back(ellipsoid(bone_pelvis, {0, 0.945f, -0.008f}, {0.160f, 0.110f, 0.112f}, 0.02f));
  skin.push_back(ellipsoid(bone_waist, {0, 1.075f, 0.000f}, {0.130f, 0.150f, 0.092f}, 0.06f));
  skin.push_back(ellipsoid(bone_chest, {0, 1.265f, -0.004f}, {0.152f, 0.175f, 0.104f}, 0.06f));
  skin.push_back(ellipsoid(bone_chest, {0.058f, 1.285f, 0.052f}, {0.062f, 0.060f, 0.048f}, 0.05f));
  skin.push_back(ellipsoid(bone_chest, {-0.058f, 1.285f, 0.052f}, {0.062f, 0.060f, 0.048f}, 0.05f));
  skin.push_back(cone(bone_chest, {-0.135f, 1.392f, -0.016f}, {0.135f, 1.392f, -0.016f}, 0.052f,
                      0.052f, 0.06f));
  for (const float side : {1.0f, -1.0f}) {
    skin.push_back(cone(bone_chest, {side * 0.025f, 1.455f, -0.024f},
                        {side * 0.135f, 1.408f, -0.018f}, 0.036f, 0.034f, 0.03f));
    // The seat of the trousers.
    skin.push_back(
        ellipsoid(bone_pelvis, {side * 0.064f, 0.905f, -0.050f}, {0.080f, 0.085f, 0.074f}, 0.04f));
  }
  // The hem of the shirt stands out a little over the trousers.
  skin.push_back(ellipsoid(bone_pelvis, {0, 0.985f, -0.004f}, {0.166f, 0.085f, 0.117f}, 0.02f));
}

void add_head(std::vector<SkinBody>& skin) {
  skin.push_back(
      cone(bone_neck, {0, 1.430f, -0.022f}, {0, 1.560f, -0.006f}, 0.052f, 0.049f, 0.03f));
  skin.push_back(ellipsoid(bone_head, {0, 1.655f, -0.006f}, {0.073f, 0.090f, 0.092f}, 0.02f));
  skin.push_back(ellipsoid(bone_head, {0, 1.598f, 0.024f}, {0.057f, 0.074f, 0.066f}, 0.03f));
  skin.push_back(ellipsoid(bone_head, {0, 1.543f, 0.062f}, {0.024f, 0.018f, 0.018f}, 0.03f));
  skin.push_back(
      cone(bone_head, {0, 1.642f, 0.086f}, {0, 1.606f, 0.101f}, 0.008f, 0.0125f, 0.014f));
  for (const float side : {1.0f, -1.0f}) {
    skin.push_back(
        ellipsoid(bone_head, {side * 0.075f, 1.625f, -0.006f}, {0.011f, 0.030f, 0.018f}, 0.008f));
    skin.push_back(
        ellipsoid(bone_head, {side * 0.030f, 1.588f, 0.062f}, {0.024f, 0.022f, 0.022f}, 0.03f));
  }
  // Hair: a shell around the skull, cut off in front along the hairline.
  SkinBody hair = ellipsoid(bone_head, {0, 1.668f, -0.020f}, {0.086f, 0.098f, 0.098f}, 0.006f);
  hair.cut_normal = glm::normalize(Vec3f(0.0f, -0.62f, 0.78f));
  hair.cut = glm::dot(hair.cut_normal, Vec3f(0.0f, 1.690f, 0.064f));
  skin.push_back(hair);
  SkinBody fringe =
      ellipsoid(bone_head, {0.014f, 1.722f, 0.048f}, {0.062f, 0.034f, 0.044f}, 0.012f);
  skin.push_back(fringe);
  skin.push_back(ellipsoid(bone_head, {0, 1.705f, -0.118f}, {0.026f, 0.026f, 0.022f}, 0.015f));
  skin.push_back(
      cone(bone_ponytail, {0, 1.712f, -0.150f}, {0, 1.640f, -0.182f}, 0.030f, 0.040f, 0.015f));
  skin.push_back(
      cone(bone_ponytail, {0, 1.640f, -0.182f}, {0, 1.490f, -0.176f}, 0.038f, 0.013f, 0.015f));
}

void add_arm(std::vector<SkinBody>& skin, float side) {
  const auto at = [&](const Vec3f& p) { return Vec3f(p.x * side, p.y, p.z); };
  const int upper = side > 0 ? bone_left_upper_arm : bone_right_upper_arm;
  const int fore = side > 0 ? bone_left_forearm : bone_right_forearm;
  const int hand = side > 0 ? bone_left_hand : bone_right_hand;
  const Vec3f shoulder = at(rest::shoulder), elbow = at(rest::elbow), wrist = at(rest::wrist);
  const Vec3f along = glm::normalize(wrist - elbow);
  const Vec3f palm = at({-0.766f, -0.643f, 0.0f});
  const Vec3f front(0.0f, 0.0f, 1.0f);
  skin.push_back(cone(upper, shoulder, elbow, 0.051f, 0.036f, 0.05f));
  // The sleeve, wider than the arm, ends above the elbow.
  SkinBody sleeve = cone(upper, shoulder, glm::mix(shoulder, elbow, 0.95f), 0.053f, 0.058f, 0.012f);
  sleeve.cut_normal = glm::normalize(elbow - shoulder);
  sleeve.cut = glm::dot(sleeve.cut_normal, glm::mix(shoulder, elbow, 0.62f));
  skin.push_back(sleeve);
  skin.push_back(cone(fore, elbow, glm::mix(elbow, wrist, 0.35f), 0.034f, 0.037f, 0.015f));
  skin.push_back(
      flat_cone(fore, glm::mix(elbow, wrist, 0.35f), wrist, 0.037f, 0.026f, palm, 0.92f, 0.015f));
  skin.push_back(
      flat_cone(hand, wrist, wrist + along * 0.074f, 0.026f, 0.040f, palm, 0.46f, 0.02f));
  const Vec3f knuckles = wrist + along * 0.078f;
  const Vec3f middle = knuckles + along * 0.048f + palm * 0.010f;
  const Vec3f tips = middle + along * 0.030f + palm * 0.016f;
  skin.push_back(flat_cone(hand, knuckles, middle, 0.039f, 0.036f, palm, 0.36f, 0.012f));
  skin.push_back(flat_cone(hand, middle, tips, 0.036f, 0.026f, palm, 0.38f, 0.012f));
  const Vec3f thumb = wrist + along * 0.030f + front * 0.024f + palm * 0.006f;
  const Vec3f joint = thumb + along * 0.034f + front * 0.026f + palm * 0.008f;
  skin.push_back(cone(hand, thumb, joint, 0.016f, 0.0125f, 0.015f));
  skin.push_back(cone(hand, joint, joint + along * 0.030f + front * 0.007f + palm * 0.004f, 0.0125f,
                      0.010f, 0.008f));
}

void add_leg(std::vector<SkinBody>& skin, float side) {
  const auto at = [&](const Vec3f& p) { return Vec3f(p.x * side, p.y, p.z); };
  const int thigh = side > 0 ? bone_left_thigh : bone_right_thigh;
  const int shin = side > 0 ? bone_left_shin : bone_right_shin;
  const int foot = side > 0 ? bone_left_foot : bone_right_foot;
  const Vec3f hip = at(rest::hip), knee = at(rest::knee), ankle = at(rest::ankle);
  skin.push_back(cone(thigh, hip + Vec3f(0, -0.03f, 0), knee, 0.082f, 0.058f, 0.05f));
  const Vec3f calf = glm::mix(knee, ankle, 0.35f) + Vec3f(0, 0, -0.012f);
  skin.push_back(cone(shin, knee, calf, 0.057f, 0.058f, 0.02f));
  // Trousers fall straight from the calf and end above the shoe.
  SkinBody trouser = cone(shin, calf, ankle + Vec3f(0, -0.02f, 0.004f), 0.057f, 0.056f, 0.02f);
  trouser.cut_normal = {0.0f, -1.0f, 0.0f};
  trouser.cut = -0.098f;
  skin.push_back(trouser);
  skin.push_back(cone(foot, ankle + Vec3f(0, 0.02f, 0), ankle, 0.036f, 0.036f, 0.010f));
  const Vec3f heel = at({0.112f, 0.034f, -0.048f}), ball = at({0.120f, 0.026f, 0.108f});
  SkinBody shoe = flat_cone(foot, heel, ball, 0.040f, 0.046f, {0, 1, 0}, 1.0f, 0.02f);
  shoe.above_floor = true;
  skin.push_back(shoe);
  SkinBody instep = cone(foot, ankle + Vec3f(0, -0.012f, 0.006f), ball + Vec3f(0, 0.012f, -0.02f),
                         0.039f, 0.034f, 0.03f);
  instep.above_floor = true;
  skin.push_back(instep);
  SkinBody toes = flat_cone(foot, ball, ball + Vec3f(side * 0.004f, -0.002f, 0.045f), 0.046f,
                            0.038f, {0, 1, 0}, 0.82f, 0.02f);
  toes.above_floor = true;
  skin.push_back(toes);
}

}  // namespace

std::vector<SkinBody> figure_bodies() {
  std::vector<SkinBody> skin;
  add_torso(skin);
  for (const float side : {1.0f, -1.0f}) add_leg(skin, side);
  for (const float side : {1.0f, -1.0f}) add_arm(skin, side);
  add_head(skin);
  return skin;
}

}  // namespace polyhull
