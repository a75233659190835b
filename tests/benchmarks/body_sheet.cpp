// SPDX-License-Identifier: LGPL-2.1-or-later
#include "body_sheet.h"

#include <algorithm>

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

Sheet::Sheet(const BodyScene& scene, const Hull& hull)
    : scene_(scene),
      camera_(scene.between.front()),
      region_(region_of(surface_of(hull), camera_)) {}

void Sheet::add(const Hull& surface) {
  columns_.push_back({plaster(surface_of(surface), camera_), textured(surface, scene_, camera_)});
}

void Sheet::save(const std::string& path) {
  columns_.push_back({plaster(scene_.truth, camera_), scene_.seen.front()});
  const int across = static_cast<int>(columns_.size());
  Picture sheet{across * region_.width, 2 * region_.height, 3, {}};
  sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * sheet.height * 3);
  for (int column = 0; column < across; ++column) {
    const auto& pictures = columns_[static_cast<std::size_t>(column)];
    paste(pictures[0], column * region_.width, 0, sheet);
    paste(pictures[1], column * region_.width, region_.height, sheet);
  }
  save_picture(sheet, path);
}

void Sheet::paste(const Picture& from, int x, int y, Picture& sheet) const {
  for (int j = 0; j < region_.height; ++j) {
    const std::uint8_t* in = from.row(region_.y + j) + from.channels * region_.x;
    std::uint8_t* out = sheet.row(y + j) + 3 * x;
    for (int i = 0; i < region_.width; ++i) std::copy_n(in + from.channels * i, 3, out + 3 * i);
  }
}

}  // namespace polyhull::benchmark
