// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/soft_masks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/thread_pool.h"

namespace polyhull::processor {
namespace {

constexpr float far = 500.0f;   // sizes of the subject's box
constexpr int finest = 80;      // texels: some 2 cm of a person
constexpr float beside = 1e9f;  // a tangent where no mask has anything

std::size_t side_of(const Vec3f& way) {
  const Vec3f size = glm::abs(way);
  const int axis = size.y >= size.x && size.y >= size.z ? 1 : size.x >= size.z ? 0 : 2;
  return 2 * static_cast<std::size_t>(axis) + (way[axis] < 0.0f);
}

Vec3f axis_of(std::size_t side) {
  Vec3f axis(0.0f);
  axis[static_cast<int>(side / 2)] = side % 2 ? -1.0f : 1.0f;
  return axis;
}

/// As LightReach::place() for all \p points, side by side. Beyond the cube nothing is hidden.
void find_places(const LightReach::Map& map, const SoftPoints& points, float* __restrict to_x,
                 float* __restrict to_y, float* __restrict to_w) {
  const float* __restrict x = points.x.data();
  const float* __restrict y = points.y.data();
  const float* __restrict z = points.z.data();
  const Vec3f centre = map.centre, right = map.right, down = map.down, forward = map.forward;
  const std::size_t count = points.x.size();
  for (std::size_t k = 0; k < count; ++k) {
    const float dx = x[k] - centre.x, dy = y[k] - centre.y, dz = z[k] - centre.z;
    const float depth = dx * forward.x + dy * forward.y + dz * forward.z;
    const float inverse = 1.0f / depth;
    const bool before = depth > 0.0f;
    to_x[k] = before ? (dx * right.x + dy * right.y + dz * right.z) * inverse : beside;
    to_y[k] = before ? (dx * down.x + dy * down.y + dz * down.z) * inverse : 0.0f;
    to_w[k] = before ? inverse : 0.0f;
  }
}

}  // namespace

/// Neighbours of the list come into different sets.
void SoftMasks::choose_directions() {
  for (std::size_t set = 0; set < sets; ++set) {
    set_[set].clear();
    for (std::size_t i = set; i < parts_->size() && set_[set].size() < most; i += sets)
      set_[set].push_back((*parts_)[i]);
    std::stable_sort(set_[set].begin(), set_[set].end(),
                     [](const EnvironmentPart& a, const EnvironmentPart& b) {
                       return side_of(a.direction) < side_of(b.direction);
                     });
  }
  for (std::size_t k = 0; k < sides; ++k) {
    Side& side = sides_[k];
    side.ways.clear();
    for (std::size_t set = 0; set < sets; ++set) {
      side.first[set] = side.ways.size();
      for (const EnvironmentPart& part : set_[set])
        if (side_of(part.direction) == k) side.ways.push_back(part.direction);
    }
    side.first[sets] = side.ways.size();
  }
}

void SoftMasks::set(const RenderPlan& plan, const Parts& parts, bool same) {
  if (same && parts == parts_) return;
  ++generation_;
  if (std::exchange(parts_, parts) != parts) {
    ++directions_;
    choose_directions();
  }
  balls_.clear();
  for (const PlacedSubject& subject : plan.subjects) {
    const Bounds& own = subject.bounds;
    balls_.push_back({Vec3f(0.5 * (own.min + own.max)),
                      1.001f * static_cast<float>(0.5 * glm::distance(own.min, own.max)),
                      far * static_cast<float>(glm::distance(own.min, own.max))});
  }
  for (Side& side : sides_) side.cut = false;
  aimed_ = false;
}

void SoftMasks::cut(const RenderPlan& plan, std::size_t number) {
  Side& side = sides_[number];
  if (std::exchange(side.cut, true) || side.ways.empty()) return;
  const Vec3f axis = axis_of(number);
  side.hiders.resize(plan.subjects.size());
  for (std::size_t i = 0; i < plan.subjects.size(); ++i) {
    const PlacedSubject& subject = plan.subjects[i];
    const auto& [middle, radius, distance] = balls_[i];
    Light light;
    light.centre = middle + distance * axis;
    light.u = distance * Vec3f(axis.z, axis.x, axis.y);
    light.v = glm::cross(light.u, axis);  // shines to cross(u, v), inwards
    Hider& hider = side.hiders[i];
    hider.reach.build(light, {}, {});  // the light's axes are wanted alone
    hider.any = hider.masks.set(hider.reach, subject.points, subject.mesh->hull.triangles, finest);
  }
}

void SoftMasks::aim() {
  if (std::exchange(aimed_, true)) return;
  std::vector<Vec3f> places;
  for (std::size_t k = 0; k < sides; ++k) {
    Side& side = sides_[k];
    if (side.ways.empty()) continue;
    const Vec3f axis = axis_of(k);
    for (std::size_t i = 0; i < side.hiders.size(); ++i) {
      const auto& [middle, radius, distance] = balls_[i];
      places.clear();
      for (const Vec3f& way : side.ways)
        places.push_back(middle + distance / glm::dot(way, axis) * way);
      if (side.hiders[i].any) side.hiders[i].masks.aim(places);
    }
  }
}

bool SoftMasks::may_hide(const Receiver& receiver) const {
  return std::any_of(balls_.begin(), balls_.end(), [&](const Ball& ball) {
    return glm::dot(receiver.normal, ball.centre - receiver.point) > -ball.radius;
  });
}

void SoftMasks::find_hidden(int set, const SoftPoints& points, std::uint64_t* hidden) const {
  struct Scratch {
    std::vector<float> x, y, w;
    std::vector<std::uint32_t> found;
  };
  thread_local Scratch s;
  const std::size_t size = points.x.size();
  for (auto* numbers : {&s.x, &s.y, &s.w}) numbers->resize(size);
  int bit = 0;
  for (const Side& side : sides_) {
    const std::size_t first = side.first[static_cast<std::size_t>(set)];
    const int count = static_cast<int>(side.first[static_cast<std::size_t>(set) + 1] - first);
    if (count == 0) continue;
    for (const Hider& hider : side.hiders) {
      if (!hider.any) continue;
      find_places(hider.reach.map(), points, s.x.data(), s.y.data(), s.w.data());
      const MaskPoints receivers{static_cast<int>(size), s.x.data(), s.y.data(), s.w.data()};
      for (int done = 0; done < count; done += 32) {
        s.found.assign(size, 0);
        hider.masks.find_hidden(first + static_cast<std::size_t>(done), std::min(count - done, 32),
                                receivers, s.found.data());
        const std::uint32_t* const found = s.found.data();
        for (std::size_t k = 0; k < size; ++k) hidden[k] |= std::uint64_t{found[k]} << (bit + done);
      }
    }
    bit += count;
  }
}

}  // namespace polyhull::processor
