// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/subject_layer.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>
#include <utility>

#include "raytrace/float4.h"

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

/// How much of each corner is in a point.
struct Shares {
  float first, second, third;
  explicit Shares(const Foot& at)
      : first(1.0f - at.second - at.third), second(at.second), third(at.third) {}
  Vec3f of(const Vec3f& a, const Vec3f& b, const Vec3f& c) const {
    return first * a + second * b + third * c;
  }
  /// Of 0..65535 for 0..1.
  Float4 of(const std::array<std::uint16_t, 4>& a, const std::array<std::uint16_t, 4>& b,
            const std::array<std::uint16_t, 4>& c) const {
    const auto wide = [](const std::array<std::uint16_t, 4>& values) {
      using UShort4 = std::uint16_t __attribute__((vector_size(8)));
      return __builtin_convertvector(std::bit_cast<UShort4>(values), Float4);
    };
    return (first * wide(a) + second * wide(b) + third * wide(c)) * (1.0f / 65535.0f);
  }
};

/// The views of the last of \p items, a point of a wide triangle: items for all of them.
void set_views(SkinItems& items, std::span<const std::array<std::uint16_t, 4>> list,
               const Shares& shares) {
  const SkinItem point = items.back();
  items.pop_back();
  for (std::size_t begin = 0; begin < list.size(); begin += 4) {
    SkinItem& item = items.emplace_back(point);
    for (std::size_t i = 0; i < 4 && begin + i < list.size(); ++i) {
      const auto& [a, b, c, slot] = list[begin + i];
      item.weights[i] =
          (shares.first * a + shares.second * b + shares.third * c) * (1.0f / 65535.0f);
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
    triangles.add(corners, static_cast<std::uint32_t>(origins.size()), facing);
    origins.push_back(
        {static_cast<std::uint32_t>(subject), static_cast<std::uint32_t>(v), skin.wide(v)});
  }
}

bool SubjectLayer::Drawn::joined(const std::vector<ReadySubject>& subjects, std::uint32_t a,
                                 std::uint32_t b) const {
  const Origin &own = origins[a], &other = origins[b];
  return own.subject == other.subject && subjects[own.subject].skin.joined(own.first, other.first);
}

void SubjectLayer::Drawn::add_item(const std::vector<ReadySubject>& subjects, std::uint32_t number,
                                   double x, double y, float share, std::uint32_t pixel,
                                   std::vector<SkinItems>& items) const {
  const ScreenTriangle& piece = triangles.piece(number);
  const Origin& origin = origins[piece.id];
  const ReadySubject& subject = subjects[origin.subject];
  const Foot at = foot(piece, x, y);
  const Shares shares(at);
  const HullVertex* const corner = &subject.skin.vertex(origin.first);
  const HullVertex &a = corner[0], &b = corner[1], &c = corner[2];
  SkinItem& item = items[origin.subject].emplace_back();
  item.place = shares.of(a.position, b.position, c.position);
  item.fill = to_vector(shares.of(a.fill, b.fill, c.fill));
  item.depth = at.depth / static_cast<float>(subject.scale);
  item.share = share;
  item.pixel = pixel;
  if (origin.wide) return set_views(items[origin.subject], subject.skin.list(a), shares);
  item.weights = std::bit_cast<std::array<float, 4>>(shares.of(a.weights, b.weights, c.weights));
  item.slots = std::bit_cast<std::uint32_t>(a.slots);
}

void SubjectLayer::fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
                        int height) {
  for (Drawn* drawn : {&hulls_, &ribbons_}) {
    drawn->triangles.begin(width, height);
    drawn->origins.clear();
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

/// Lists the columns in which any of the samples of a row of pixels has a triangle. The ids of a sample lie
/// \p pixels after those of the one before. Returns how many there are.
std::size_t SubjectLayer::find_covered(const std::uint32_t* ids, std::size_t pixels, int samples,
                                       Scratch& scratch) {
  const std::size_t width = scratch.covered.size();
  scratch.together.assign(ids, ids + width);
  std::uint32_t* const together = scratch.together.data();
  for (int s = 1; s < samples; ++s) {
    ids += pixels;
    for (std::size_t x = 0; x < width; ++x) together[x] &= ids[x];
  }
  std::uint32_t* const covered = scratch.covered.data();
  std::size_t count = 0;
  for (std::size_t x = 0; x < width; ++x) {
    covered[count] = static_cast<std::uint32_t>(x);
    count += together[x] != no_triangle;
  }
  return count;
}

/// Each triangle in a pixel is coloured once, in the middle of its samples; one that has more than half of
/// them also for those with which it has a corner in common.
void SubjectLayer::find_items(const std::vector<ReadySubject>& subjects, const Rectangle& rows,
                              int samples, const Drawn& drawn,
                              const std::vector<std::uint32_t>& ids, Scratch& scratch) const {
  const float(*places)[2] = sample_places(samples);
  const float each = 1.0f / static_cast<float>(samples);
  const auto width = static_cast<std::size_t>(rows.width);
  const std::size_t pixels = width * static_cast<std::size_t>(rows.height);
  float all_x = 0.0f, all_y = 0.0f;
  for (int s = 0; s < samples; ++s) all_x += places[s][0], all_y += places[s][1];
  scratch.covered.resize(width);
  for (std::size_t first = 0; first < pixels; first += width) {
    const std::size_t count = find_covered(&ids[first], pixels, samples, scratch);
    const double y = rows.y + static_cast<double>(first / width);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t column = scratch.covered[i], pixel = first + column;
      const double x = rows.x + static_cast<double>(column);
      const auto add = [&](std::uint32_t number, float sx, float sy, int own) {
        const auto of = static_cast<float>(own);
        drawn.add_item(subjects, number, x + sx / of, y + sy / of, of * each,
                       static_cast<std::uint32_t>(pixel), scratch.items);
      };
      std::uint32_t seen[8];
      int left = 0;
      bool same = true;
      for (std::size_t s = 0; s < static_cast<std::size_t>(samples); ++s) {
        const std::uint32_t number = ids[s * pixels + pixel];
        same = same && number == ids[pixel];
        if (number != no_triangle) seen[left++] = number | static_cast<std::uint32_t>(s) << 28;
      }
      if (same) {
        add(ids[pixel], all_x, all_y, samples);
        continue;
      }
      while (left > 0) {
        const auto [number, leads] = leading(seen, left);
        const std::uint32_t id = drawn.triangles.piece(number).id;
        float sx = 0.0f, sy = 0.0f;
        const int all = std::exchange(left, 0);
        for (int k = 0; k < all; ++k) {
          const std::uint32_t other = seen[k] & number_bits;
          if (other == number ||
              (leads && drawn.joined(subjects, id, drawn.triangles.piece(other).id))) {
            sx += places[seen[k] >> 28][0];
            sy += places[seen[k] >> 28][1];
          } else {
            seen[left++] = seen[k];
          }
        }
        add(number, sx, sy, all - left);
      }
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
