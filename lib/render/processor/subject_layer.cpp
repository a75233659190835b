// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/subject_layer.h"

#include <algorithm>
#include <limits>
#include <span>

namespace polyhull::processor {
namespace {

constexpr std::uint32_t number_bits = 0x0fffffffu;  // below the sample's number

/// The number that more than half of \p seen have, or the first one's, and whether so many have it.
std::pair<std::uint32_t, bool> leading(const std::uint32_t* seen, int count) {
  for (int i = 0; 2 * i < count; ++i) {
    int same = 0;
    for (int j = i; j < count; ++j) same += ((seen[i] ^ seen[j]) & number_bits) == 0;
    if (2 * same > count) return {seen[i] & number_bits, true};
  }
  return {seen[0] & number_bits, false};
}

/// Sets the point of a triangle's surface at \p at.
void set_point(SkinItem& item, const HullVertex* corner, const Foot& at) {
  const HullVertex &a = corner[0], &b = corner[1], &c = corner[2];
  const float first = 1.0f - at.second - at.third;
  item.place = first * a.position + at.second * b.position + at.third * c.position;
  const auto fill = [](const HullVertex& v) { return Vec3f(v.fill[0], v.fill[1], v.fill[2]); };
  item.fill = (first * fill(a) + at.second * fill(b) + at.third * fill(c)) * (1.0f / 65535.0f);
}

/// The views of a point of a narrow triangle.
void set_views(SkinItem& item, const HullVertex* corner, const Foot& at) {
  const HullVertex &a = corner[0], &b = corner[1], &c = corner[2];
  const float first = 1.0f - at.second - at.third;
  for (std::size_t k = 0; k < 4; ++k)
    item.weights[k] = (first * a.weights[k] + at.second * b.weights[k] + at.third * c.weights[k]) *
                      (1.0f / 65535.0f);
  item.slots = a.slots[0] | a.slots[1] << 8 | a.slots[2] << 16 |
               static_cast<std::uint32_t>(a.slots[3]) << 24;
}

/// The views of the last of \p items, a point of a wide triangle: items for all of them.
void set_views(SkinItems& items, std::span<const std::array<std::uint16_t, 4>> list,
               const Foot& at) {
  const SkinItem point = items.back();
  items.pop_back();
  const float first = 1.0f - at.second - at.third;
  for (std::size_t begin = 0; begin < list.size(); begin += 4) {
    SkinItem& item = items.emplace_back(point);
    for (std::size_t i = 0; i < 4 && begin + i < list.size(); ++i) {
      const auto& [a, b, c, slot] = list[begin + i];
      item.weights[i] = (first * a + at.second * b + at.third * c) * (1.0f / 65535.0f);
      item.slots |= static_cast<std::uint32_t>(slot) << (8 * i);
    }
    item.parts = begin == 0 ? static_cast<std::uint8_t>((list.size() + 3) / 4) : 0;
  }
}

}  // namespace

void SubjectLayer::Drawn::add(const std::vector<ReadySubject>& subjects, std::size_t subject,
                              const SubjectEye& eye, std::size_t first, std::size_t last,
                              Facing facing) {
  const Mat4& to_scene = subjects[subject].local_to_scene;
  const Mat4 from_local = eye.pixels_from_scene * to_scene;
  const Vec4 plane = eye.kept ? *eye.kept * to_scene : Vec4(0, 0, 0, 1);
  const Skin& skin = subjects[subject].skin;
  for (std::size_t v = first; v < last; v += 3) {
    std::array<Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec4 point(Vec3(skin.vertex(v + k).position), 1.0);
      corners[k] = {Vec3(from_local * point), glm::dot(plane, point)};
    }
    triangles.add(corners, static_cast<std::uint32_t>(vertex_of.size()), facing);
    vertex_of.emplace_back(static_cast<std::uint32_t>(subject), static_cast<std::uint32_t>(v));
  }
}

bool SubjectLayer::Drawn::joined(const std::vector<ReadySubject>& subjects, std::uint32_t a,
                                 std::uint32_t b) const {
  const auto [subject, first] = vertex_of[a];
  const auto [other_subject, other] = vertex_of[b];
  return subject == other_subject && subjects[subject].skin.joined(first, other);
}

void SubjectLayer::fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
                        int height) {
  for (Drawn* drawn : {&hulls_, &ribbons_}) {
    drawn->triangles.begin(width, height);
    drawn->vertex_of.clear();
  }
  images_.fill(subjects, eye, width, height);
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    const Skin& skin = subjects[s].skin;
    hulls_.add(subjects, s, eye, skin.first_vertex(eye.number), skin.last_vertex(eye.number),
               eye.facing);
    if (eye.number == 0)
      ribbons_.add(subjects, s, eye, skin.first_of_ribbon(), skin.last_of_ribbon(), Facing::both);
  }
}

/// Begins with the scene's depths, so that only what is nearer is drawn, and beside the mirror with
/// what nothing is nearer than.
void SubjectLayer::hide(const Rectangle& rows, const SceneLayer& scene, const SceneLayer* frame,
                        Scratch& scratch) const {
  const auto width = static_cast<std::size_t>(rows.width);
  const auto height = static_cast<std::size_t>(rows.height);
  for (std::size_t s = 0; s < static_cast<std::size_t>(scene.view().samples); ++s) {
    for (std::size_t y = 0; y < height; ++y) {
      const int row = rows.y + static_cast<int>(y);
      float* to = &scratch.inverse[(s * height + y) * width];
      std::copy_n(scene.inverse(static_cast<int>(s), rows.x, row), width, to);
      if (frame == nullptr) continue;
      const std::uint8_t* marks = frame->mirror(rows.x, row);
      for (std::size_t x = 0; x < width; ++x)
        if (!(marks[x] >> s & 1)) to[x] = std::numeric_limits<float>::infinity();
    }
  }
}

/// Of what is nearer than the scene that the scratch has, all samples of a pixel alike.
void SubjectLayer::hide(const Rectangle& rows, const LayerView& view, const DepthPicture& depth,
                        Scratch& scratch) const {
  const auto pixels = static_cast<std::size_t>(rows.width) * static_cast<std::size_t>(rows.height);
  std::size_t pixel = 0;
  for (int y = rows.y; y < rows.y + rows.height; ++y) {
    for (int x = rows.x; x < rows.x + rows.width; ++x, ++pixel) {
      const float found = depth.at(x, y, view.width, view.height);
      for (std::size_t s = 0; s < static_cast<std::size_t>(view.samples); ++s) {
        float& scene = scratch.inverse[s * pixels + pixel];
        if (found * (1.0f - depth_picture_ahead) > scene) scene = found;
      }
    }
  }
}

/// Each triangle in a pixel is coloured once, in the middle of its samples; one that has more than half of
/// them also for those with which it has a corner in common.
void SubjectLayer::find_items(const std::vector<ReadySubject>& subjects, const Rectangle& rows,
                              int samples, const Drawn& drawn,
                              const std::vector<std::uint32_t>& ids, Scratch& scratch) const {
  const float(*places)[2] = sample_places(samples);
  const float each = 1.0f / static_cast<float>(samples);
  const auto pixels = static_cast<std::size_t>(rows.width) * static_cast<std::size_t>(rows.height);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    std::uint32_t seen[8];
    int count = 0;
    for (std::size_t s = 0; s < static_cast<std::size_t>(samples); ++s) {
      const std::uint32_t number = ids[s * pixels + pixel];
      if (number != no_triangle) seen[count++] = number | static_cast<std::uint32_t>(s) << 28;
    }
    while (count > 0) {
      const auto [number, leads] = leading(seen, count);
      float sx = 0.0f, sy = 0.0f;
      const ScreenTriangle& piece = drawn.triangles.piece(number);
      const auto [subject, first] = drawn.vertex_of[piece.id];
      const Skin& skin = subjects[subject].skin;
      int own = 0, left = 0;
      for (int i = 0; i < count; ++i) {
        const std::uint32_t other = seen[i] & number_bits;
        if (other == number ||
            (leads && drawn.joined(subjects, piece.id, drawn.triangles.piece(other).id))) {
          sx += places[seen[i] >> 28][0];
          sy += places[seen[i] >> 28][1];
          ++own;
        } else {
          seen[left++] = seen[i];
        }
      }
      count = left;
      const double x = rows.x + static_cast<double>(pixel % static_cast<std::size_t>(rows.width));
      const double y = rows.y + static_cast<double>(pixel / static_cast<std::size_t>(rows.width));
      const Foot at =
          foot(piece, x + sx / static_cast<float>(own), y + sy / static_cast<float>(own));
      SkinItems& items = scratch.items[subject];
      const HullVertex* corner = &skin.vertex(first);
      SkinItem& item = items.emplace_back();
      set_point(item, corner, at);
      item.depth = at.depth / static_cast<float>(subjects[subject].scale);
      item.share = static_cast<float>(own) * each;
      item.pixel = static_cast<std::uint32_t>(pixel);
      if (skin.wide(first))
        set_views(items, skin.list(*corner), at);
      else
        set_views(item, corner, at);
    }
  }
}

/// Draws the nearest ribbon of each sample where no hull is.
void SubjectLayer::draw_ribbons(int band, const SampleRows& rows, Scratch& scratch) const {
  scratch.ribbon_ids.assign(scratch.ids.size(), no_triangle);
  SampleRows own = rows;
  own.id = scratch.ribbon_ids.data();
  ribbons_.triangles.draw(band, own);
  for (std::size_t i = 0; i < scratch.ids.size(); ++i)
    if (scratch.ids[i] != no_triangle) scratch.ribbon_ids[i] = no_triangle;
}

/// What of band \p band and \p part triangles touch.
Rectangle SubjectLayer::painted(int band, const Rectangle& part) const {
  Rectangle rows;
  if (part.empty()) return rows;  // there may be no bands
  for (const Drawn* drawn : {&hulls_, &ribbons_}) {
    const ScreenTriangles::Columns columns = drawn->triangles.columns(band);
    if (!columns.empty())
      rows =
          bounding(rows, {columns.first, band * band_rows, columns.end - columns.first, band_rows});
  }
  return intersection(bounding(rows, images_.painted(band)), part);
}

Rectangle SubjectLayer::paint(const std::vector<ReadySubject>& subjects, int band,
                              const Rectangle& part, const SceneLayer& scene,
                              const SceneLayer* frame, bool drawn, const DepthPicture* depth,
                              Scratch& scratch, std::vector<glm::vec4>& into) const {
  const Rectangle rows = painted(band, part);
  if (rows.empty()) return rows;
  const auto pixels = static_cast<std::size_t>(rows.width) * static_cast<std::size_t>(rows.height);
  const int samples = scene.view().samples;
  into.assign(pixels, glm::vec4(0.0f));
  scratch.inverse.resize(static_cast<std::size_t>(samples) * pixels);
  scratch.ids.assign(static_cast<std::size_t>(samples) * pixels, no_triangle);
  if (drawn)
    hide(rows, scene, frame, scratch);
  else
    std::fill(scratch.inverse.begin(), scratch.inverse.end(), 0.0f);
  if (depth != nullptr) hide(rows, scene.view(), *depth, scratch);
  const SampleRows sample_rows{rows.x,
                               rows.x + rows.width,
                               rows.y,
                               rows.y + rows.height,
                               samples,
                               sample_places(samples),
                               scratch.inverse.data(),
                               scratch.ids.data()};
  hulls_.triangles.draw(band, sample_rows);
  scratch.items.resize(subjects.size());
  for (SkinItems& items : scratch.items) {
    items.clear();
    items.nearest_where_unseen = false;
  }
  images_.draw(subjects, sample_rows, scratch.images);
  find_items(subjects, rows, samples, hulls_, scratch.ids, scratch);
  images_.find_items(subjects, sample_rows, scratch.images, scratch.items);
  for (SkinItems& items : scratch.items) items.first_of_ribbon = items.size();
  if (ribbons_.triangles.pieces() > 0) {
    draw_ribbons(band, sample_rows, scratch);
    find_items(subjects, rows, samples, ribbons_, scratch.ribbon_ids, scratch);
  }
  for (std::size_t s = 0; s < subjects.size(); ++s)
    subjects[s].skin.paint(scratch.items[s], scratch.skin, into.data());
  return rows;
}

}  // namespace polyhull::processor
