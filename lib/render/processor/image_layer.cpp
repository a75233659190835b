// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/image_layer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/srgb.h"
#include "render/projection.h"
#include "render/subject/hull_vertices.h"

namespace polyhull::processor {
namespace {

constexpr int side = 4;  // of a block of pixels: as many as rays are asked at once
constexpr int tile = band_rows;
constexpr std::size_t most = 4;  // views per point, as of triangles
static_assert(side * side == ImageHull::lanes && tile % side == 0);

/// Depths nearer to each other than this share are one surface.
constexpr float one_surface = 0.01f;

/// How near a view's direction is to the eye's, from the cosine between them.
float nearness(float cosine) {
  const float near = 0.5f + 0.5f * cosine;
  return std::max(near * near * near * near, 1e-3f);
}

/// The pixels that the corners around a subject may touch.
Rectangle touched(const std::vector<Vec3>& corners, const Mat4& pixels_from_world, int width,
                  int height) {
  const Rectangle whole{0, 0, width, height};
  Vec2 low(INFINITY), high(-INFINITY);
  for (const Vec3& corner : corners) {
    const Vec4 at = pixels_from_world * Vec4(corner, 1.0);
    if (!(at.z > 1e-3)) return whole;
    low = glm::min(low, Vec2(at) / at.z);
    high = glm::max(high, Vec2(at) / at.z);
  }
  low = glm::clamp(low, Vec2(-2.0), Vec2(width + 2.0, height + 2.0));
  high = glm::clamp(high, Vec2(-2.0), Vec2(width + 2.0, height + 2.0));
  const int left = static_cast<int>(low.x) - 1, top = static_cast<int>(low.y) - 1;
  return intersection(
      {left, top, static_cast<int>(high.x) + 2 - left, static_cast<int>(high.y) + 2 - top}, whole);
}

/// The views that weigh most at a point, and what they weigh.
struct Ranked {
  float weights[most] = {};
  std::uint32_t slots[most] = {};
  std::size_t count = 0;

  void add(float weight, std::uint32_t slot) {
    std::size_t at = std::min(count, most - 1);
    if (count == most && !(weight > weights[most - 1])) return;
    for (; at > 0 && weight > weights[at - 1]; --at) {
      weights[at] = weights[at - 1];
      slots[at] = slots[at - 1];
    }
    weights[at] = weight;
    slots[at] = slot;
    count = std::min(count + 1, most);
  }
};

/// The views that see a point of a face with the unit vector \p across from its front; of one that none
/// sees so, those that would.
Ranked rank(const std::vector<Vec3f>& centres, TextureMetric metric, const Vec3f& point,
            const Vec3f& to_eye, const Vec3f& across) {
  const Vec3f normal = glm::dot(across, to_eye) < 0.0f ? -across : across;
  Ranked facing, all;
  for (std::size_t slot = 0; slot < centres.size(); ++slot) {
    const Vec3f way = glm::normalize(centres[slot] - point);
    const float cosine = glm::dot(normal, way);
    const bool by_angle = metric != TextureMetric::camera_normal;
    const float weight =
        by_angle ? nearness(glm::dot(way, to_eye)) : std::max(cosine * cosine, 1e-3f);
    // The camera whose plane it is sees it from the side.
    if (cosine > 1e-3f)
      facing.add(weight, static_cast<std::uint32_t>(slot));
    else
      all.add(weight, static_cast<std::uint32_t>(slot));
  }
  return facing.count > 0 ? facing : all;
}

}  // namespace

std::vector<int> views_for(const Mesh& mesh, const std::vector<Vec3>& eyes) {
  constexpr std::size_t enough = most + 1;  // for each eye
  std::vector<int> all;
  for (std::size_t k = 0; k < mesh.views.size(); ++k)
    if (can_colour(mesh.views[k].view)) all.push_back(static_cast<int>(k));
  const bool by_angle = mesh.texturing && mesh.texturing->metric != TextureMetric::camera_normal;
  if (!by_angle && all.size() <= 255) return all;
  std::vector<int> chosen;
  for (const Vec3& eye : eyes) {
    const auto cosine = [&](int view) {
      const Vec3 centre = mesh.views[static_cast<std::size_t>(view)].calibration.centre();
      return glm::dot(glm::normalize(centre - mesh.hull.origin),
                      glm::normalize(eye - mesh.hull.origin));
    };
    std::stable_sort(all.begin(), all.end(), [&](int a, int b) { return cosine(a) > cosine(b); });
    chosen.insert(chosen.end(), all.begin(),
                  all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), enough)));
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

/// Rays of one call: where in the picture, in lanes.
struct ImageLayer::Block {
  float column[ImageHull::lanes], row[ImageHull::lanes];
  /// A grid from (left, top) on, \p step apart.
  Block(float left, float top, float step) {
    for (int i = 0; i < ImageHull::lanes; ++i) {
      column[i] = left + step * static_cast<float>(i % side);
      row[i] = top + step * static_cast<float>(i / side);
    }
  }
};

/// 1/s from which on the ray through a point of the picture counts.
float ImageLayer::Sight::near(float column, float row) const {
  if (!cut) return std::numeric_limits<float>::infinity();
  const float grows = kept_change.x + column * kept_change.y + row * kept_change.z;
  if (kept >= 0.0f) return std::numeric_limits<float>::infinity();
  return grows > 0.0f ? -grows / kept : 0.0f;
}

void ImageLayer::fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
                      int height) {
  sights_.clear();
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    const ReadySubject& subject = subjects[i];
    if (!subject.image) continue;
    const Mesh& mesh = subject.image->mesh;
    Sight& sight = sights_.emplace_back();
    sight.subject = static_cast<std::uint32_t>(i);
    const Mat4 pixels = eye.pixels_from_scene * subject.local_to_scene;
    Mat4 to_local(1.0);
    to_local[3] = Vec4(-mesh.hull.origin, 1.0);
    sight.part = touched(subject.image->hull.corners(), pixels * to_local, width, height);
    const Mat3 back = glm::inverse(Mat3(pixels));
    const Vec3 place = -(back * Vec3(pixels[3]));
    sight.origin = subject.image->hull.from(mesh.hull.origin + place);
    sight.place = Vec3f(place);
    sight.x = Vec3f(back[0]);
    sight.y = Vec3f(back[1]);
    sight.first = Vec3f(back[2]);
    if (eye.kept) {
      const Vec4 plane = *eye.kept * subject.local_to_scene;
      sight.cut = true;
      sight.kept = static_cast<float>(glm::dot(plane, Vec4(place, 1.0)));
      for (int k = 0; k < 3; ++k)
        sight.kept_change[k] = static_cast<float>(glm::dot(Vec3(plane), back[(k + 2) % 3]));
    }
    for (const int view : subject.views)
      sight.centres.emplace_back(mesh.views[static_cast<std::size_t>(view)].calibration.centre() -
                                 mesh.hull.origin);
  }
}

Rectangle ImageLayer::painted(int band) const {
  Rectangle rows;
  for (const Sight& sight : sights_)
    rows = bounding(rows, intersection(sight.part, {sight.part.x, band * band_rows,
                                                    sight.part.width, band_rows}));
  return rows;
}

void ImageLayer::look(const ImageHull& hull, const Sight& sight, const Block& block,
                      Scratch& scratch, ImageHull::Hits& hits) const {
  ImageHull::Directions ways;
  float near[ImageHull::lanes];
  for (int i = 0; i < ImageHull::lanes; ++i) {
    const Vec3f way = sight.way(block.column[i], block.row[i]);
    ways.x[i] = way.x;
    ways.y[i] = way.y;
    ways.z[i] = way.z;
    near[i] = sight.near(block.column[i], block.row[i]);
  }
  hull.enter(sight.origin, scratch.bundle, ways, near, scratch.hull, hits);
}

/// Writes hits of the block at (left, top), of sample \p sample of each pixel, or of all for -1.
void ImageLayer::put(const Sight& sight, const SampleRows& rows, int left, int top, int sample,
                     const ImageHull::Hits& hits, Scratch& scratch) {
  for (int i = 0; i < ImageHull::lanes; ++i) {
    const int x = left + i % side, y = top + i / side;
    if (hits.inverse[i] == 0.0f || x < rows.left || x >= rows.right || y < rows.top ||
        y >= rows.bottom)
      continue;
    const int first = sample < 0 ? 0 : sample, last = sample < 0 ? rows.samples - 1 : sample;
    for (int s = first; s <= last; ++s) {
      const std::size_t at = sample_index(rows, x, y, s);
      if (!(hits.inverse[i] > rows.inverse[at])) continue;
      rows.inverse[at] = hits.inverse[i];
      rows.id[at] = no_triangle;
      scratch.seen[at] = {sight.subject, hits.face[i]};
    }
  }
}

/// Draws the block of pixels at (left, top): where rays through its rim and inside show one surface, by
/// a ray through each pixel; where they show none, not at all; else by rays through all samples.
void ImageLayer::draw_block(const ImageHull& hull, const Sight& sight, int left, int top,
                            const SampleRows& rows, Scratch& scratch) const {
  const auto x = static_cast<float>(left), y = static_cast<float>(top);
  ImageHull::Hits hits;
  if (rows.samples > 1) {
    look(hull, sight, Block(x, y, static_cast<float>(side) / (side - 1)), scratch, hits);
    const auto [low, high] = std::minmax_element(hits.inverse, hits.inverse + ImageHull::lanes);
    if (*high == 0.0f) return;
    if (!(*low > (1.0f - one_surface) * *high)) {
      for (int s = 0; s < rows.samples; ++s) {
        look(hull, sight, Block(x + rows.places[s][0], y + rows.places[s][1], 1.0f), scratch, hits);
        put(sight, rows, left, top, s, hits, scratch);
      }
      return;
    }
  }
  look(hull, sight, Block(x + 0.5f, y + 0.5f, 1.0f), scratch, hits);
  put(sight, rows, left, top, -1, hits, scratch);
}

void ImageLayer::draw(const std::vector<ReadySubject>& subjects, const SampleRows& rows,
                      Scratch& scratch) const {
  if (sights_.empty()) return;
  const Rectangle all{rows.left, rows.top, rows.right - rows.left, rows.bottom - rows.top};
  scratch.seen.assign(
      static_cast<std::size_t>(rows.samples) * static_cast<std::size_t>(all.width * all.height),
      {no_triangle, 0});
  for (const Sight& sight : sights_) {
    const ImageHull& hull = subjects[sight.subject].image->hull;
    const Rectangle part = intersection(sight.part, all);
    if (part.empty()) continue;
    const int right = part.x + part.width, bottom = part.y + part.height;
    // Tiles and blocks lie where they lie, so that a picture does not depend on what is asked of it.
    for (int top = part.y / tile * tile; top < bottom; top += tile)
      for (int left = part.x / tile * tile; left < right; left += tile) {
        const auto x = static_cast<float>(left), y = static_cast<float>(top);
        hull.gather(sight.origin,
                    {sight.way(x, y), sight.way(x + tile, y), sight.way(x, y + tile),
                     sight.way(x + tile, y + tile)},
                    scratch.bundle);
        if (scratch.bundle.empty) continue;
        for (int j = top; j < std::min(top + tile, bottom); j += side)
          for (int i = left; i < std::min(left + tile, right); i += side)
            if (j + side > part.y && i + side > part.x)
              draw_block(hull, sight, i, j, rows, scratch);
      }
  }
}

void ImageLayer::add_item(const ReadySubject& subject, const Sight& sight, float column, float row,
                          float inverse, std::uint32_t face, float share, std::uint32_t pixel,
                          SkinItems& items) {
  const Texturing& texturing = *subject.image->mesh.texturing;
  const float depth = 1.0f / inverse;
  const Vec3f way = sight.way(column, row);
  const Vec3f point = sight.place + depth * way;
  const Vec3f& across = subject.image->hull.across(face);
  const Ranked ranked = rank(sight.centres, texturing.metric, point, -glm::normalize(way), across);
  SkinItem& item = items.emplace_back();
  item.place = point;
  item.depth = depth / static_cast<float>(subject.scale);
  for (std::size_t k = 0; k < most; ++k) {
    item.weights[k] = ranked.weights[k];
    item.slots |= ranked.slots[k] << (8 * k);
  }
  // Where no view has a picture, the form is shaded as that of triangles.
  const float light = sight.centres.empty()
                          ? shaded_share(glm::dot(across, way) < 0.0f ? across : -across, -way)
                          : 1.0f;
  item.fill = light * srgb_decoded(texturing.untextured);
  item.share = share;
  item.pixel = pixel;
}

void ImageLayer::find_items(const std::vector<ReadySubject>& subjects, const SampleRows& rows,
                            const Scratch& scratch, std::vector<SkinItems>& items) const {
  if (sights_.empty()) return;
  for (const Sight& sight : sights_) items[sight.subject].nearest_where_unseen = true;
  const int width = rows.right - rows.left, height = rows.bottom - rows.top;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const float each = 1.0f / static_cast<float>(rows.samples);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const auto column = static_cast<float>(rows.left + static_cast<int>(pixel) % width);
    const auto row = static_cast<float>(rows.top + static_cast<int>(pixel) / width);
    for (unsigned open = (1u << rows.samples) - 1; open != 0;) {
      // Its first open sample, and those of the same surface.
      const int first = std::countr_zero(open);
      const std::size_t before = pixel * static_cast<std::size_t>(rows.samples);
      const std::size_t at = before + static_cast<std::size_t>(first);
      const Scratch::Seen seen = scratch.seen[at];
      const float inverse = rows.inverse[at];
      float x = 0.0f, y = 0.0f, sum = 0.0f;
      int own = 0;
      for (int s = first; s < rows.samples; ++s) {
        const std::size_t other = before + static_cast<std::size_t>(s);
        if (!(open >> s & 1) || scratch.seen[other].subject != seen.subject ||
            (seen.subject != no_triangle &&
             std::abs(rows.inverse[other] - inverse) > one_surface * inverse))
          continue;
        open &= ~(1u << s);
        x += rows.places[s][0];
        y += rows.places[s][1];
        sum += rows.inverse[other];
        ++own;
      }
      if (seen.subject == no_triangle) continue;
      const auto count = static_cast<float>(own);
      const Sight& sight = *std::find_if(sights_.begin(), sights_.end(),
                                         [&](const Sight& s) { return s.subject == seen.subject; });
      const bool whole = own == rows.samples;
      add_item(subjects[seen.subject], sight, column + (whole ? 0.5f : x / count),
               row + (whole ? 0.5f : y / count), sum / count, seen.face, count * each,
               static_cast<std::uint32_t>(pixel), items[seen.subject]);
    }
  }
}

}  // namespace polyhull::processor
