// SPDX-License-Identifier: LGPL-2.1-or-later
#include "body_sheet.h"

#include <algorithm>

#include "sheet.h"

namespace polyhull::benchmark {

using namespace test;

namespace {

/// What is covered in any of the pictures, and a little around it: nothing is larger than the hull
/// but the truth, by the contours' tolerance.
Rectangle region_of(const TriangleSurface& surface, const Camera& camera) {
  constexpr int margin = 12;
  int left = camera.width, right = 0, top = camera.height, bottom = 0;
  for (const Vec3& v : surface.vertices) {
    const auto p = camera.project_ideal(v);
    if (!p) continue;
    left = std::min(left, static_cast<int>(p->x) - margin);
    right = std::max(right, static_cast<int>(p->x) + margin);
    top = std::min(top, static_cast<int>(p->y) - margin);
    bottom = std::max(bottom, static_cast<int>(p->y) + margin);
  }
  left = std::max(left, 0);
  top = std::max(top, 0);
  return {left, top, std::min(right, camera.width) - left, std::min(bottom, camera.height) - top};
}

}  // namespace

BodySheet::BodySheet(const BodyScene& scene, const Hull& hull)
    : scene_(scene),
      camera_(scene.between.front()),
      region_(region_of(surface_of(hull), camera_)) {}

void BodySheet::add(const Hull& surface) {
  columns_.push_back({plaster(surface_of(surface), camera_), textured(surface, scene_, camera_)});
}

void BodySheet::save(const std::string& path) {
  columns_.push_back({plaster(scene_.truth, camera_), scene_.seen.front()});
  const int across = static_cast<int>(columns_.size());
  Sheet sheet(across, 2, region_);
  for (int column = 0; column < across; ++column)
    for (int row = 0; row < 2; ++row)
      sheet.put(columns_[static_cast<std::size_t>(column)][static_cast<std::size_t>(row)], column,
                row);
  sheet.save(path);
}

}  // namespace polyhull::benchmark
