// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/working_volume.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {

WorkingVolume::WorkingVolume(const std::array<double, 6>& box) {
  const auto corner = [&](int x, int y, int z) { return Vec3(box[x], box[2 + y], box[4 + z]); };
  for (int k = 0; k < 2; ++k) {
    faces_.push_back({corner(k, 0, 0), corner(k, 1, 0), corner(k, 1, 1), corner(k, 0, 1)});
    faces_.push_back({corner(0, k, 0), corner(1, k, 0), corner(1, k, 1), corner(0, k, 1)});
    faces_.push_back({corner(0, 0, k), corner(1, 0, k), corner(1, 1, k), corner(0, 1, k)});
  }
}

void WorkingVolume::cut(const Vec3& normal, double offset) {
  std::vector<std::vector<Vec3>> kept;
  std::vector<Vec3> rim;
  bool whole = true;
  std::vector<double> value;
  for (auto& face : faces_) {
    value.clear();
    bool any = false, all = true;
    for (const Vec3& p : face) {
      value.push_back(glm::dot(normal, p) + offset);
      any = any || value.back() >= 0;
      all = all && value.back() >= 0;
    }
    if (all) {
      kept.push_back(std::move(face));
      continue;
    }
    whole = false;
    if (!any) continue;
    std::vector<Vec3> part;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::size_t k = (i + 1) % face.size();
      if (value[i] >= 0) part.push_back(face[i]);
      if ((value[i] >= 0) != (value[k] >= 0)) {
        // From the kept end to the other, so that both faces of an edge find the same point.
        const std::size_t in = value[i] >= 0 ? i : k, out = value[i] >= 0 ? k : i;
        part.push_back(face[in] + (face[out] - face[in]) * (value[in] / (value[in] - value[out])));
        rim.push_back(part.back());
      }
    }
    kept.push_back(std::move(part));
  }
  faces_ = std::move(kept);
  if (whole || rim.size() < 3) return;
  Vec3 middle(0.0);
  for (const Vec3& p : rim) middle += p / static_cast<double>(rim.size());
  const Vec3 axis = glm::normalize(normal);
  const Vec3 u = glm::normalize(std::abs(axis.x) < 0.7 ? glm::cross(axis, Vec3(1, 0, 0))
                                                       : glm::cross(axis, Vec3(0, 1, 0)));
  const Vec3 v = glm::cross(axis, u);
  std::vector<std::pair<double, Vec3>> sorted;
  for (const Vec3& p : rim)
    sorted.push_back({std::atan2(glm::dot(p - middle, v), glm::dot(p - middle, u)), p});
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Vec3> cap;
  for (const auto& [angle, p] : sorted)
    if (cap.empty() || cap.back() != p) cap.push_back(p);
  faces_.push_back(std::move(cap));
}

}  // namespace polyhull::hull
