// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/light_masks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::processor {
namespace {

constexpr int texels = LightMasks::texels, sections = LightMasks::sections;
constexpr std::uint64_t open = std::uint64_t{1} << sections;  // an odd number of surfaces

/// Rows become columns.
void transpose(std::array<std::uint64_t, 64>& rows) {
  std::uint64_t mask = 0xffffffffu;
  for (unsigned half = 32; half != 0; half >>= 1, mask ^= mask << half) {
    for (unsigned k = 0; k < 64; k = ((k | half) + 1) & ~half) {
      const std::uint64_t swapped = ((rows[k] >> half) ^ rows[k | half]) & mask;
      rows[k] ^= swapped << half;
      rows[k | half] ^= swapped;
    }
  }
}

}  // namespace

bool LightMasks::set(const LightReach& reach, std::span<const Vec3f> points,
                     std::span<const std::uint32_t> triangles, int finest) {
  map_ = reach.map();
  if (map_.point || map_.everywhere || points.empty()) return false;
  corners_.clear();
  Vec2f high(-1e30f);
  float nearest = 0.0f;
  low_ = Vec2f(1e30f);
  deepest_ = 1e30f;
  for (const Vec3f& point : points) {
    const LightReach::Place at = reach.place(point);
    corners_.emplace_back(at.tangents, at.inverse);
    low_ = glm::min(low_, at.tangents);
    high = glm::max(high, at.tangents);
    deepest_ = std::min(deepest_, at.inverse);
    nearest = std::max(nearest, at.inverse);
  }
  const float range = std::max(nearest - deepest_, 1e-6f * nearest);
  per_section_ = sections / range;
  constexpr float most_range = 8.0f;  // else sections are too few for what lies deepest
  if (!(range < most_range * deepest_)) return false;
  // As fine as the subject's size asks for, but no finer than sections lie apart.
  constexpr float most_moved = 2.0f * sections;
  const Vec2f moved = map_.extent * range;
  scale_ = glm::min(static_cast<float>(finest) / glm::max(high - low_, Vec2f(1e-6f)),
                    most_moved / moved);
  // Of the sections whole words, and eights of rows.
  const Vec2f size = (high - low_) * scale_;
  const auto whole = [&](float at, int parts) {
    return std::min(static_cast<int>(at) / parts + 1, (finest + parts - 1) / parts) * parts;
  };
  columns_used_ = whole(size.x, 64);
  rows_used_ = whole(size.y, 8);
  width_ = columns_used_ + static_cast<int>(moved.x * scale_.x) + 4;
  height_ = rows_used_ + static_cast<int>(moved.y * scale_.y) + 4;
  columns_ = static_cast<std::size_t>(width_) / 32 + 1;
  for (Vec3f& corner : corners_)
    corner = Vec3f((Vec2f(corner) - low_) * scale_, (corner.z - deepest_) * per_section_);
  cut(triangles);
  part();
  return true;
}

/// Finds which sections lie inside, in the middle of each texel: below each surface there all turn over.
void LightMasks::cut(std::span<const std::uint32_t> triangles) {
  for (auto* bits : {&inside_, &surface_}) {
    bits->resize(std::size_t{texels} * texels);
    std::fill_n(bits->begin(), static_cast<std::size_t>(rows_used_) * texels, 0);
  }
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const Vec3f* p[3] = {&corners_[triangles[i]], &corners_[triangles[i + 1]],
                         &corners_[triangles[i + 2]]};
    const auto row_from = [](float y) { return static_cast<int>(std::ceil(y - 0.5f)); };
    const int first = std::max(row_from(std::min({p[0]->y, p[1]->y, p[2]->y})), 0);
    const int end = std::min(row_from(std::max({p[0]->y, p[1]->y, p[2]->y})), rows_used_);
    if (first >= end) continue;  // most of those that are smaller than a texel
    std::sort(p, p + 3, [](const Vec3f* a, const Vec3f* b) {
      return a->y < b->y || (a->y == b->y && a->x < b->x);
    });
    const Vec3f &a = *p[0], &b = *p[1], &c = *p[2];
    const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (area == 0.0f) continue;
    const float per_x = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) / area;
    const float per_y = ((c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)) / area;
    const float lowest = std::min({a.z, b.z, c.z}), highest = std::max({a.z, b.z, c.z});
    for (int row = first; row < end; ++row) {
      const float y = static_cast<float>(row) + 0.5f;
      // Both triangles at an edge compute the same.
      const auto cross = [y](const Vec3f& from, const Vec3f& to) {
        return from.x + (y - from.y) * ((to.x - from.x) / (to.y - from.y));
      };
      const float whole = cross(a, c), part = y < b.y ? cross(a, b) : cross(b, c);
      const float left = std::min(whole, part), right = std::max(whole, part);
      const int begin = std::max(static_cast<int>(std::ceil(left - 0.5f)), 0);
      const int stop = std::min(static_cast<int>(std::ceil(right - 0.5f)), columns_used_);
      for (int x = begin; x < stop; ++x) {
        const float at = a.z + (static_cast<float>(x) + 0.5f - a.x) * per_x + (y - a.y) * per_y;
        const float w = std::clamp(at, lowest, highest);
        const std::size_t texel = static_cast<std::size_t>(row) * texels + x;
        inside_[texel] ^= open | ((std::uint64_t{1} << static_cast<int>(w + 0.5f)) - 1);
        surface_[texel] |= std::uint64_t{1} << std::min(static_cast<int>(w), sections - 1);
      }
    }
  }
}

/// From texels to sections. What is thinner than a section lies in one; where a surface is open, there
/// is the surface alone.
void LightMasks::part() {
  sections_.resize(std::size_t{sections} * across * texels);
  for (int k = 0; k < sections; ++k)
    for (int column = 0; column < columns_used_ / 32; ++column)
      std::fill_n(&sections_[section_word(k, column, 0)], rows_used_, 0);
  for (auto& columns : rows_) std::fill(std::begin(columns), std::end(columns), Rows{});
  std::array<std::uint64_t, 64> bits;
  for (int row = 0; row < rows_used_; ++row) {
    for (int word = 0; word < columns_used_ / 64; ++word) {
      std::uint64_t any = 0;
      for (std::size_t i = 0; i < 64; ++i) {
        const std::size_t texel = static_cast<std::size_t>(row) * texels + 64 * word + i;
        const std::uint64_t solid = inside_[texel];
        const std::uint64_t surface = surface_[texel];
        // Beside what is solid a surface is its own; of neighbouring sections one has what is thin.
        const std::uint64_t thin = surface & ~(solid | solid << 1 | solid >> 1);
        bits[i] = solid & open ? surface : solid | (thin & ~(thin << 1));
        any |= bits[i];
      }
      if (any == 0) continue;
      transpose(bits);
      for (; any != 0; any &= any - 1) {
        const int k = std::countr_zero(any);
        for (int half = 0; half < 2; ++half) {
          const auto own = static_cast<std::uint32_t>(bits[k] >> (32 * half));
          if (own == 0) continue;
          const int column = 2 * word + half;
          sections_[section_word(k, column, row)] = own;
          Rows& rows = rows_[k][column];
          rows.first = std::min(rows.first, row / 8 * 8);
          rows.end = row / 8 * 8 + 8;
        }
      }
    }
  }
}

void LightMasks::aim(std::span<const Vec3f> places) {
  shifts_.resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3f way = places[i] - map_.centre;
    // What the images have room for, however coarse coordinates are far from the origin.
    const Vec2f aside = glm::clamp(Vec2f(glm::dot(way, map_.right), glm::dot(way, map_.down)),
                                   -map_.extent, map_.extent) *
                        scale_;
    // From the first texel but one on, whichever way the sections move.
    const Vec2f range = aside * (sections / per_section_);
    const Vec2f margin = 1.0f + glm::max(range, Vec2f(0.0f));
    Shift& shift = shifts_[i];
    shift.per_inverse = -aside;
    shift.origin = margin + deepest_ * aside - low_ * scale_;
    for (int k = 0; k < sections; ++k) {
      const Vec2f moved = margin - aside * ((static_cast<float>(k) + 0.5f) / per_section_);
      shift.x[k] = static_cast<int>(moved.x + 0.5f);
      shift.y[k] = static_cast<int>(moved.y + 0.5f);
    }
  }
  images_.resize(places.size() * image_size());
  parallel_each(places.size(), 8, 0, [&](std::size_t i) { draw(i); });
}

void LightMasks::draw(std::size_t number) {
  std::uint32_t* image = images_.data() + number * image_size();
  std::fill_n(image, image_size(), 0);
  const Shift& shift = shifts_[number];
  for (int k = 0; k < sections; ++k) {
    for (int column = 0; column < across; ++column) {
      const auto [first, end] = rows_[k][column];
      if (first >= end) continue;
      std::uint32_t* to = image + (shift.x[k] / 32 + column) * static_cast<std::size_t>(height_) +
                          shift.y[k] + first;
      Loops::best().shift_onto(&sections_[section_word(k, column, first)], (end - first) / 8,
                               shift.x[k] % 32, to, to + height_);
    }
  }
}

MaskImage LightMasks::image(std::size_t number) const {
  const Shift& shift = shifts_[number];
  return {images_.data() + number * image_size(),
          width_,
          height_,
          {scale_.x, scale_.y},
          {shift.origin.x, shift.origin.y},
          {shift.per_inverse.x, shift.per_inverse.y}};
}

/// Whether what is nearer to the light than the receiver hides the place from it.
bool LightMasks::is_hidden(std::size_t number, const Vec3f& at) const {
  const Shift& shift = shifts_[number];
  const float nearer = std::min((at.z - deepest_) * per_section_, float{sections});
  for (int k = std::max(static_cast<int>(nearer), 0); k < sections; ++k) {
    const Vec2f texel = Vec2f(at) * scale_ + shift.origin + at.z * shift.per_inverse -
                        Vec2f(shift.x[k], shift.y[k]);
    if (!(texel.x >= 0.0f && texel.y >= 0.0f)) continue;
    if (!(texel.x < columns_used_ && texel.y < rows_used_)) continue;
    const int x = static_cast<int>(texel.x), y = static_cast<int>(texel.y);
    if (sections_[section_word(k, x / 32, y)] >> (x % 32) & 1) return true;
  }
  return false;
}

void LightMasks::find_hidden(std::size_t first, int count, const MaskPoints& receivers,
                             std::uint32_t* hidden) const {
  thread_local std::vector<std::uint32_t> own;
  own.assign(static_cast<std::size_t>(receivers.count), 0);
  std::uint32_t* const found = own.data();  // by this subject
  for (int i = 0; i < count; ++i)
    Loops::best().look_up(image(first + i), receivers, std::uint32_t{1} << i, found);
  for (int k = 0; k < receivers.count; ++k) {
    const Vec3f at(receivers.x[k], receivers.y[k], receivers.w[k]);
    // In the last section all of the others are nearer.
    const bool behind = (at.z - deepest_) * per_section_ < 1.0f;
    for (std::uint32_t asked = behind ? 0 : found[k]; asked != 0; asked &= asked - 1) {
      const int i = std::countr_zero(asked);
      if (!is_hidden(first + i, at)) found[k] &= ~(std::uint32_t{1} << i);
    }
    hidden[k] |= found[k];
  }
}

}  // namespace polyhull::processor
