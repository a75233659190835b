// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/scene/scene_layer.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <functional>
#include <utility>

#include "base/thread_pool.h"
#include "render/projection.h"
#include "render/seen_mirrors.h"
#include "scene/scene.h"

namespace polyhull::processor {
namespace {

/// Which columns of band \p number any of \p parts has: first, and one past the last; the same:
/// none.
std::pair<int, int> columns_of(std::span<const Rectangle> parts, int number) {
  const int top = number * band_rows, bottom = top + band_rows;
  Rectangle all;
  for (const Rectangle& part : parts)
    if (!part.empty() && part.y < bottom && part.y + part.height > top) all = bounding(all, part);
  return {all.x, all.x + all.width};
}

/// Calls draw(number, left, right) for the bands in which \p drawn lacks some of \p parts. Returns
/// whether any does.
template <class Part>
bool draw_missing(const std::vector<Part>& drawn, std::span<const Rectangle> parts, int width,
                  const std::function<void(int, int, int)>& draw) {
  std::atomic<bool> any = false;
  parallel_each(drawn.size(), 1, 0, [&](std::size_t i) {
    const int number = static_cast<int>(i);
    const auto [left, right] = columns_of(parts, number);
    if (left == right || drawn[i].holds(left, right)) return;
    // What is asked for at first; should that grow, the view stays, and all of it is drawn.
    const bool again = drawn[i].right > drawn[i].left;
    draw(number, again ? 0 : left / 32 * 32,
         again ? width : std::min(width, (right + 31) / 32 * 32));
    any = true;
  });
  return any;
}

}  // namespace

bool SceneLayer::set(const TracedScene* scene, const LayerView& view,
                     std::shared_ptr<const SceneOnScreen> ready) {
  if (scene == scene_ && view == view_) return false;
  ++generation_;
  const bool other = scene != scene_;
  scene_ = scene;
  view_ = view;
  const auto bands = static_cast<std::size_t>((view.height + band_rows - 1) / band_rows);
  samples_.resize(bands);
  middles_.resize(bands);
  for (Samples& part : samples_) part.left = part.right = 0;
  for (Middles& part : middles_) part.left = part.right = 0;
  screen_ = std::move(ready);
  if (!scene) return true;
  if (other) number_triangles();
  if (screen_) return true;
  const auto own = std::make_shared<SceneOnScreen>();
  own->set(scene->scene(), view.pixels_from_scene, view.kept, view.width, view.height, 0);
  screen_ = own;
  return true;
}

void SceneLayer::number_triangles() {
  first_of_mesh_.assign(1, 0);
  mesh_of_.clear();
  mirror_of_.clear();
  for (const SceneMesh& mesh : scene_->scene().meshes) {
    const auto number = static_cast<std::uint32_t>(first_of_mesh_.size() - 1);
    mesh_of_.insert(mesh_of_.end(), mesh.triangles.size() / 3, number);
    for (const int mirror : mirrors_of_triangles(scene_->scene(), number))
      mirror_of_.push_back(mirror < static_cast<int>(most_known_mirrors)
                               ? static_cast<std::uint8_t>(mirror + 1)
                               : std::uint8_t{0});
    first_of_mesh_.push_back(static_cast<std::uint32_t>(mesh_of_.size()));
  }
}

bool SceneLayer::ensure_samples(std::span<const Rectangle> parts) {
  return draw_missing(samples_, parts, view_.width, [this](int number, int left, int right) {
    draw_samples(number, left, right);
  });
}

bool SceneLayer::ensure_middles(const Rectangle& part) {
  return draw_missing(middles_, {&part, 1}, view_.width, [this](int number, int left, int right) {
    draw_middles(number, left, right);
  });
}

void SceneLayer::lay_out(Part& part, int number, int left, int right) const {
  part.left = left;
  part.right = right;
  part.rows = static_cast<std::size_t>(std::min(band_rows, view_.height - number * band_rows));
}

void SceneLayer::draw_samples(int number, int left, int right) {
  Samples& part = samples_[static_cast<std::size_t>(number)];
  lay_out(part, number, left, right);
  const std::size_t pixels = part.rows * part.width();
  const std::size_t count = static_cast<std::size_t>(view_.samples) * pixels;
  thread_local std::vector<std::uint32_t> pieces;
  part.inverse.assign(count, 0.0f);
  pieces.assign(count, no_triangle);
  const int top = number * band_rows;
  screen_->draw(number, {left, right, top, top + static_cast<int>(part.rows), view_.samples,
                         sample_places(view_.samples), part.inverse.data(), pieces.data()});
  if (!view_.mirrors) return;
  part.mirror.resize(count);
  mark(pieces.data(), count, part.mirror.data());
}

/// The mirror that each of \p pieces is part of.
void SceneLayer::mark(const std::uint32_t* pieces, std::size_t count, std::uint8_t* mirrors) const {
  for (std::size_t i = 0; i < count;) {
    // Neighbours mostly show the same.
    const std::uint32_t number = pieces[i];
    std::size_t end = i + 1;
    while (end < count && pieces[end] == number) ++end;
    std::fill(mirrors + i, mirrors + end,
              number != no_triangle ? mirror_of_[piece(number).id] : std::uint8_t{0});
    i = end;
  }
}

bool Aperture::seen_in(const Rectangle& part) const {
  constexpr std::uint64_t ones = 0x0101010101010101u, tops = 0x8080808080808080u;
  for (int y = part.y; y < part.y + part.height; ++y) {
    for (int s = 0; s < layer.view().samples; ++s) {
      const std::uint8_t* row = layer.mirror(s, part.x, y);
      int x = 0;
      for (; !within && x + 8 <= part.width; x += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, row + x, sizeof eight);
        eight ^= mirror * ones;
        if ((eight - ones) & ~eight & tops) return true;  // one of its bytes is 0
      }
      for (; x < part.width; ++x)
        if (row[x] == mirror && (!within || within->seen_at(s, part.x + x, y))) return true;
    }
  }
  return false;
}

void SceneLayer::draw_middles(int number, int left, int right) {
  Middles& part = middles_[static_cast<std::size_t>(number)];
  lay_out(part, number, left, right);
  part.inverse.assign(part.rows * part.width(), 0.0f);
  part.piece.assign(part.rows * part.width(), no_triangle);
  const int top = number * band_rows;
  screen_->draw(number, {left, right, top, top + static_cast<int>(part.rows), 1, sample_places(1),
                         part.inverse.data(), part.piece.data()});
}

SceneLayer::Triangle SceneLayer::triangle(const ScreenTriangle& piece) const {
  const std::uint32_t mesh = mesh_of_[piece.id], number = piece.id - first_of_mesh_[mesh];
  const SceneMesh& of = scene_->scene().meshes[mesh];
  return {mesh, number, &of, &of.triangles[3 * static_cast<std::size_t>(number)]};
}

RayHit SceneLayer::hit(int x, int y) const {
  RayHit hit;
  const std::uint32_t number = *middle_piece(x, y);
  if (number == no_triangle) return hit;
  const Triangle shown = triangle(piece(number));
  hit.mesh = shown.mesh;
  hit.triangle = shown.number;
  const Foot at = foot(piece(number), x + 0.5, y + 0.5);
  hit.u = at.second;
  hit.v = at.third;
  hit.distance = at.depth;
  const std::vector<Vec3f>& p = shown.of->positions;
  hit.normal =
      glm::cross(p[shown.corner[1]] - p[shown.corner[0]], p[shown.corner[2]] - p[shown.corner[0]]);
  return hit;
}

}  // namespace polyhull::processor
