// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/scene_layer.h"

#include <algorithm>
#include <atomic>

#include "base/thread_pool.h"

namespace polyhull::processor {

bool SceneLayer::set(const TracedScene* scene, const LayerView& view) {
  if (scene == scene_ && view == view_) return false;
  scene_ = scene;
  view_ = view;
  bands_.resize(static_cast<std::size_t>((view.height + band_rows - 1) / band_rows));
  for (Band& band : bands_) band.left = band.right = 0;
  triangles_.begin(view.width, view.height);
  first_of_mesh_.clear();
  mirror_pieces_ = 0;
  if (!scene) return true;
  std::vector<Corner> corners;
  std::uint32_t first = 0;
  for (const SceneMesh& mesh : scene->scene().meshes) {
    const bool is_mirror = static_cast<int>(first_of_mesh_.size()) == view.mirror_mesh;
    first_of_mesh_.push_back(first);
    if (is_mirror) mirror_first_ = triangles_.pieces();
    corners.resize(mesh.positions.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec4 point(Vec3(mesh.positions[i]), 1.0);
      corners[i] = {Vec3(view.pixels_from_scene * point),
                    view.kept ? glm::dot(*view.kept, point) : 1.0};
    }
    for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3, ++first) {
      const std::uint32_t* t = &mesh.triangles[i];
      triangles_.add({corners[t[0]], corners[t[1]], corners[t[2]]}, first, Facing::both);
    }
    if (is_mirror) mirror_pieces_ = triangles_.pieces() - mirror_first_;
  }
  return true;
}

bool SceneLayer::ensure(const Rectangle& part) {
  if (part.empty()) return false;
  std::atomic<bool> any = false;
  const int first = part.y / band_rows, last = (part.y + part.height - 1) / band_rows;
  parallel_for(static_cast<std::size_t>(last - first + 1), 1, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) {
                   const int number = first + static_cast<int>(i);
                   const Band& band = bands_[static_cast<std::size_t>(number)];
                   const int left = part.x, right = part.x + part.width;
                   if (left >= band.left && right <= band.right) continue;
                   // What is asked for at first; should that grow, the view stays, and all of it is
                   // drawn.
                   const bool again = band.right > band.left;
                   draw(number, again ? 0 : left / 32 * 32,
                        again ? view_.width : std::min(view_.width, (right + 31) / 32 * 32));
                   any = true;
                 }
               });
  return any;
}

void SceneLayer::draw(int number, int left, int right) {
  Band& band = bands_[static_cast<std::size_t>(number)];
  const int top = number * band_rows, bottom = std::min(top + band_rows, view_.height);
  const auto width = static_cast<std::size_t>(view_.width);
  const auto rows = static_cast<std::size_t>(bottom - top);
  const auto samples = static_cast<std::size_t>(view_.samples);
  band.inverse.resize(samples * rows * width);
  band.centre_inverse.resize(rows * width);
  band.centre.resize(rows * width);
  band.mirror.resize(rows * width);
  band.left = left;
  band.right = right;

  const auto columns = static_cast<std::size_t>(right - left);
  thread_local std::vector<float> inverse;
  thread_local std::vector<std::uint32_t> ids;
  inverse.assign((samples + 1) * rows * columns, 0.0f);
  ids.assign((samples + 1) * rows * columns, no_triangle);
  triangles_.draw(number, {left, right, top, bottom, static_cast<int>(samples) + 1,
                           sample_places(view_.samples), inverse.data(), ids.data()});
  for (std::size_t y = 0; y < rows; ++y) {
    const std::size_t to = y * width + static_cast<std::size_t>(left);
    for (std::size_t s = 0; s < samples; ++s) {
      const float* from = &inverse[(s * rows + y) * columns];
      std::copy(from, from + columns, &band.inverse[s * rows * width + to]);
    }
    const std::size_t middle = (samples * rows + y) * columns;
    std::copy_n(&inverse[middle], columns, &band.centre_inverse[to]);
    std::copy_n(&ids[middle], columns, &band.centre[to]);
    std::uint8_t* marks = &band.mirror[to];
    std::fill_n(marks, columns, std::uint8_t{0});
    for (std::size_t s = 0; mirror_pieces_ > 0 && s < samples; ++s) {
      const std::uint32_t* from = &ids[(s * rows + y) * columns];
      for (std::size_t x = 0; x < columns; ++x)
        marks[x] |= static_cast<std::uint8_t>((from[x] - mirror_first_ < mirror_pieces_) << s);
    }
  }
}

bool SceneLayer::shows_mirror(const Rectangle& part) const {
  for (int y = part.y; y < part.y + part.height; ++y) {
    const Band& of = bands_[static_cast<std::size_t>(y / band_rows)];
    const auto row = of.mirror.begin() + static_cast<std::ptrdiff_t>(y % band_rows) * view_.width;
    if (std::any_of(row + part.x, row + part.x + part.width, [](auto bits) { return bits != 0; }))
      return true;
  }
  return false;
}

RayHit SceneLayer::hit(int x, int y) const {
  const Band& band = bands_[static_cast<std::size_t>(y / band_rows)];
  const std::uint32_t number =
      band.centre[static_cast<std::size_t>(y % band_rows) * view_.width + x];
  RayHit hit;
  if (number == no_triangle) return hit;
  const ScreenTriangle& piece = triangles_.piece(number);
  const auto mesh = std::upper_bound(first_of_mesh_.begin(), first_of_mesh_.end(), piece.id) - 1;
  const Foot at = foot(piece, x + 0.5, y + 0.5);
  hit.mesh = static_cast<std::uint32_t>(mesh - first_of_mesh_.begin());
  hit.triangle = piece.id - *mesh;
  hit.u = at.second;
  hit.v = at.third;
  hit.distance = at.depth;
  const SceneMesh& of = scene_->scene().meshes[hit.mesh];
  const std::uint32_t* t = &of.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  hit.normal =
      glm::cross(of.positions[t[1]] - of.positions[t[0]], of.positions[t[2]] - of.positions[t[0]]);
  return hit;
}

}  // namespace polyhull::processor
