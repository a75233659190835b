// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/animation/animation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace polyhull {
namespace {

/// None where \p v has no direction: it is no rotation then, as in a file.
Vec4 unit(const Vec4& v) {
  const double length = glm::length(v);
  return length > 0.0 ? v / length : Vec4(0.0);
}

Vec4 slerp(const Vec4& a, const Vec4& b, double share) {
  const glm::dquat from(a.w, a.x, a.y, a.z), to(b.w, b.x, b.y, b.z);
  const glm::dquat between = glm::slerp(glm::normalize(from), glm::normalize(to), share);
  return {between.x, between.y, between.z, between.w};
}

}  // namespace

Vec4 AnimationTrack::at(double time) const {
  const bool turns = part == Part::rotation, cubic = interpolation == Interpolation::cubic;
  const auto value = [&](std::size_t key) { return cubic ? values[3 * key + 1] : values[key]; };
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  const auto next = static_cast<std::size_t>(after - times.begin());
  const std::size_t key = next > 0 ? next - 1 : 0;
  if (next == 0 || next == times.size() || interpolation == Interpolation::step)
    return turns ? unit(value(key)) : value(key);
  const double length = times[next] - times[key], s = (time - times[key]) / length;
  if (interpolation == Interpolation::linear)
    return turns ? slerp(value(key), value(next), s) : glm::mix(value(key), value(next), s);
  const double s2 = s * s, s3 = s2 * s;
  const Vec4 out = (2.0 * s3 - 3.0 * s2 + 1.0) * value(key) +
                   length * (s3 - 2.0 * s2 + s) * values[3 * key + 2] +
                   (3.0 * s2 - 2.0 * s3) * value(next) + length * (s3 - s2) * values[3 * next];
  return turns ? unit(out) : out;
}

NodeTransform NodeMotion::at(double time) const {
  NodeTransform transform = rest;
  for (const AnimationTrack& track : tracks) {
    const Vec4 value = track.at(time);
    switch (track.part) {
      case AnimationTrack::Part::translation:
        transform.translation = Vec3(value);
        break;
      case AnimationTrack::Part::rotation:
        transform.rotation = value;
        break;
      case AnimationTrack::Part::scale:
        transform.scale = Vec3(value);
        break;
    }
  }
  return transform;
}

std::optional<int> find_animation(const std::vector<Animation>& animations,
                                  std::string_view choice) {
  if (choice.empty()) return animations.empty() ? 0 : 1;
  for (std::size_t i = 0; i < animations.size(); ++i)
    if (animations[i].name == choice) return static_cast<int>(i) + 1;
  int number = 0;
  const auto [end, error] = std::from_chars(choice.data(), choice.data() + choice.size(), number);
  if (error != std::errc() || end != choice.data() + choice.size() || number < 0 ||
      static_cast<std::size_t>(number) > animations.size())
    return {};
  return number;
}

double time_in(const Animation& animation, double seconds, bool loop) {
  if (seconds <= 0.0 || animation.duration <= 0.0) return 0.0;
  return loop ? std::fmod(seconds, animation.duration) : std::min(seconds, animation.duration);
}

}  // namespace polyhull
