// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/working_volume.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {

WorkingVolume::WorkingVolume(const std::array<double, 6>& box) {
  const auto corner = [&](int x, int y, int z) { return Vec3(box[x], box[2 + y], box[4 + z]); };
  const auto add = [&](const std::array<Vec3, 4>& face) {
    corners_.insert(corners_.end(), face.begin(), face.end());
    ends_.push_back(corners_.size());
  };
  for (int k = 0; k < 2; ++k) {
    add({corner(k, 0, 0), corner(k, 1, 0), corner(k, 1, 1), corner(k, 0, 1)});
    add({corner(0, k, 0), corner(1, k, 0), corner(1, k, 1), corner(0, k, 1)});
    add({corner(0, 0, k), corner(1, 0, k), corner(1, 1, k), corner(0, 1, k)});
  }
}

void WorkingVolume::cut(const Vec3& normal, double offset) {
  kept_.clear(), kept_ends_.clear(), rim_.clear(), values_.clear();
  bool whole = true;
  for (const Vec3& p : corners_) {
    values_.push_back(glm::dot(normal, p) + offset);
    whole = whole && values_.back() >= 0;
  }
  if (whole) return;
  std::size_t begin = 0;
  for (const std::size_t end : ends_) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t k = i + 1 < end ? i + 1 : begin;
      if (values_[i] >= 0) kept_.push_back(corners_[i]);
      if ((values_[i] >= 0) != (values_[k] >= 0)) {
        // From the kept end to the other, so that both faces of an edge find the same point.
        const std::size_t in = values_[i] >= 0 ? i : k, out = values_[i] >= 0 ? k : i;
        kept_.push_back(corners_[in] + (corners_[out] - corners_[in]) *
                                           (values_[in] / (values_[in] - values_[out])));
        rim_.push_back(kept_.back());
      }
    }
    if (kept_.size() > (kept_ends_.empty() ? 0 : kept_ends_.back()))
      kept_ends_.push_back(kept_.size());
    begin = end;
  }
  corners_.swap(kept_);
  ends_.swap(kept_ends_);
  if (rim_.size() < 3) return;
  Vec3 middle(0.0);
  for (const Vec3& p : rim_) middle += p / static_cast<double>(rim_.size());
  const Vec3 axis = glm::normalize(normal);
  const Vec3 u = glm::normalize(std::abs(axis.x) < 0.7 ? glm::cross(axis, Vec3(1, 0, 0))
                                                       : glm::cross(axis, Vec3(0, 1, 0)));
  const Vec3 v = glm::cross(axis, u);
  sorted_.clear();
  for (const Vec3& p : rim_)
    sorted_.push_back({std::atan2(glm::dot(p - middle, v), glm::dot(p - middle, u)), p});
  std::sort(sorted_.begin(), sorted_.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  const std::size_t first = corners_.size();
  for (const auto& [angle, p] : sorted_)
    if (corners_.size() == first || corners_.back() != p) corners_.push_back(p);
  ends_.push_back(corners_.size());
}

}  // namespace polyhull::hull
