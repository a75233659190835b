// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/depth_of_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/thread_pool.h"
#include "render/projection.h"

namespace polyhull {
namespace {

constexpr float sharp_radius = 0.5f;  // a disk of this one, as it is drawn, is a pixel
constexpr float exact_radius = 4.5f;  // up to here all pixels are looked at
constexpr int ring_offsets = 48;
float within(float value) {
  return std::clamp(value, 0.0f, 1.0f);
}

/// Whether circle \p c lies before \p other by so little that it is the same surface.
bool alike(float c, float other) {
  return c - other <= 0.5f * std::max(1.0f, 0.25f * std::max(std::abs(c), std::abs(other)));
}

}  // namespace

/// Makes the disks for a focal length of \p fx by \p fy pixels.
void DepthOfField::set_pixels(double fx, double fy) {
  // In steps that no picture shows: lenses that are calibrated or zoom differ from square by a hair.
  const double ratio = std::round(1000.0 * std::clamp(fy / fx, 1e-2, 1e2)) / 1000.0;
  const auto wide = static_cast<float>(std::max(ratio, 1.0)),
             high = static_cast<float>(std::max(1.0 / ratio, 1.0));
  if (wide == wide_ && high == high_) return;
  wide_ = wide;
  high_ = high;
  find_offsets();
  find_tables();
}

void DepthOfField::find_offsets() {
  offsets_.clear();
  const int inner = static_cast<int>(exact_radius);
  for (int y = -inner; y <= inner; ++y)
    for (int x = -inner; x <= inner; ++x) {
      const float across = wide_ * static_cast<float>(x), down = high_ * static_cast<float>(y);
      const float distance = std::sqrt(across * across + down * down);
      if (distance < exact_radius) offsets_.push_back({x, y, distance, 1.0f});
    }
  // Beyond, rings that are twice as wide each, evenly filled on a sunflower's spiral.
  constexpr float golden = 2.3999632f;  // radians
  const float end = most_radius + 1.0f;
  int turn = 0;
  for (float from = exact_radius; from < end; from *= 2.0f) {
    const float to = std::min(2.0f * from, end);
    const float area = to * to - from * from;
    const int count = static_cast<int>(std::ceil(ring_offsets * area / (3.0f * from * from)));
    for (int i = 0; i < count; ++i, ++turn) {
      const float radius = std::sqrt(from * from + area * (static_cast<float>(i) + 0.5f) /
                                                       static_cast<float>(count));
      const float angle = golden * static_cast<float>(turn);
      offsets_.push_back(
          {static_cast<int>(std::lround(radius * std::cos(angle) / wide_)),
           static_cast<int>(std::lround(radius * std::sin(angle) / high_)), radius,
           std::numbers::pi_v<float> * area / (wide_ * high_ * static_cast<float>(count))});
    }
  }
  std::stable_sort(offsets_.begin(), offsets_.end(),
                   [](const Offset& a, const Offset& b) { return a.distance < b.distance; });
}

/// The areas, so that an even surface stays as it is; and the radii that are drawn: pixels are as wide
/// as small disks, so that what is drawn has the true disk's variance, radius^2 / 4.
void DepthOfField::find_tables() {
  inverse_area_.clear();
  drawn_radius_.clear();
  std::vector<double> variances;
  for (int i = 0; i <= static_cast<int>(most_radius) * radius_steps + 1; ++i) {
    const float radius = static_cast<float>(i) / radius_steps;
    double area = 0.0, spread = 0.0;
    for (const Offset& offset : offsets_) {
      const double share =
          static_cast<double>(within(radius - offset.distance + 0.5f) * offset.share);
      area += share;
      const double x = static_cast<double>(wide_) * offset.x,
                   y = static_cast<double>(high_) * offset.y;
      spread += 0.5 * share * (x * x + y * y);
    }
    inverse_area_.push_back(static_cast<float>(1.0 / std::max(area, 1e-3)));
    variances.push_back(spread / std::max(area, 1e-3));
  }
  inverse_area_.push_back(inverse_area_.back());  // read beside the last
  std::size_t k = static_cast<std::size_t>(sharp_radius * radius_steps);
  for (std::size_t i = 0; i < variances.size(); ++i) {
    const double radius = static_cast<double>(i) / radius_steps;
    const double wanted = 0.25 * radius * radius;
    while (k + 2 < variances.size() && variances[k + 1] < wanted) ++k;
    const double rise = variances[k + 1] - variances[k];
    const double share = rise > 0.0 ? std::clamp((wanted - variances[k]) / rise, 0.0, 1.0) : 0.0;
    drawn_radius_.push_back(static_cast<float>((static_cast<double>(k) + share) / radius_steps));
  }
}

/// Of the disk that is drawn for \p circle.
float DepthOfField::radius_of(float circle) const {
  const float at = std::min(std::abs(circle), most_radius) * radius_steps;
  const auto i = static_cast<std::size_t>(at);
  const float share = at - static_cast<float>(i);
  return drawn_radius_[i] + share * (drawn_radius_[i + 1] - drawn_radius_[i]);
}

float DepthOfField::inverse_area(float radius) const {
  const float at = radius * radius_steps;
  const auto i = static_cast<std::size_t>(at);
  const float share = at - static_cast<float>(i);
  return inverse_area_[i] + share * (inverse_area_[i + 1] - inverse_area_[i]);
}

void DepthOfField::Disks::resize(std::size_t count) {
  for (std::vector<float>* plane : {&circle, &radius, &inverse_area}) plane->resize(count);
}

/// Makes the disks, and each tile's largest.
void DepthOfField::find_disks(const ViewportLens& lens, float scale, const DepthLayers& depths,
                              const LightLayers& sharp) {
  const std::size_t count = sharp.scene[0].size();
  scene_disks_.resize(count);
  subject_disks_.resize(count);
  for (std::vector<float>* of : {&radius_, &subject_radius_, &nearest_, &farthest_})
    of->resize(static_cast<std::size_t>(columns_ * rows_));
  const float focus = static_cast<float>(1.0 / lens.focus_distance);
  const auto make = [&](const std::vector<float>& inverse, std::size_t at, int pixels, Disks& to) {
    lens::FocusLoops::best().disks(tables(), scale, focus, &inverse[at], pixels, &to.circle[at],
                                   &to.radius[at], &to.inverse_area[at]);
  };
  const auto pixel_area = inverse_area_[static_cast<std::size_t>(sharp_radius * radius_steps)];
  const auto row_of_tiles = [&](int row) {
    const int bottom = std::min((row + 1) * tile, height_);
    for (int y = row * tile; y < bottom; ++y) {
      const std::size_t at = sharp.pixel(0, y);
      make(depths.scene(), at, width_, scene_disks_);
      if (subject_only_) {
        std::fill_n(&scene_disks_.radius[at], width_, sharp_radius);
        std::fill_n(&scene_disks_.inverse_area[at], width_, pixel_area);
      }
      if (y >= sharp.part.y && y < sharp.part.y + sharp.part.height)
        make(depths.subject(), sharp.pixel(sharp.part.x, y), sharp.part.width, subject_disks_);
    }
    for (int column = 0; column < columns_; ++column) {
      const int left = column * tile, right = std::min(left + tile, width_);
      float radius = 0.0f, subject = -1.0f, nearest = -1e9f, farthest = 1e9f;
      for (int y = row * tile; y < bottom; ++y)
        for (std::size_t i = sharp.pixel(left, y); i <= sharp.pixel(right - 1, y); ++i) {
          radius = std::max(radius, scene_disks_.radius[i]);
          nearest = std::max(nearest, scene_disks_.circle[i]);
          farthest = std::min(farthest, scene_disks_.circle[i]);
        }
      const Rectangle own =
          intersection(sharp.part, {left, row * tile, right - left, bottom - row * tile});
      for (int y = own.y; y < own.y + own.height; ++y)
        for (int x = own.x; x < own.x + own.width; ++x)
          if (sharp.subject[3][sharp.pixel(x, y)] > 0.0f)
            subject = std::max(subject, subject_disks_.radius[sharp.pixel(x, y)]);
      const auto t = static_cast<std::size_t>(row * columns_ + column);
      radius_[t] = radius;
      subject_radius_[t] = subject;
      nearest_[t] = nearest;
      farthest_[t] = farthest;
    }
  };
  parallel_each(rows_, 1, 0, row_of_tiles);
}

/// How far disks reach, tile by tile.
void DepthOfField::find_reach() {
  const auto tiles = static_cast<std::size_t>(columns_ * rows_);
  reach_.assign(tiles, 0.0f);
  near_subject_.assign(tiles, 0);
  even_.assign(tiles, 0);
  const float largest = std::max(*std::max_element(radius_.begin(), radius_.end()),
                                 *std::max_element(subject_radius_.begin(), subject_radius_.end()));
  const int most = static_cast<int>(largest + 1.0f) / tile + 1;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const auto t = static_cast<std::size_t>(row * columns_ + column);
      for (int j = std::max(row - most, 0); j <= std::min(row + most, rows_ - 1); ++j)
        for (int i = std::max(column - most, 0); i <= std::min(column + most, columns_ - 1); ++i) {
          const auto other = static_cast<std::size_t>(j * columns_ + i);
          const int apart = std::max({std::abs(i - column) - 1, std::abs(j - row) - 1, 0}) * tile;
          for (const float radius : {radius_[other], subject_radius_[other]})
            if (radius + 1.0f > static_cast<float>(apart)) reach_[t] = std::max(reach_[t], radius);
          if (subject_radius_[other] + 1.0f > static_cast<float>(apart)) near_subject_[t] = 1;
        }
      const int around = static_cast<int>(reach_[t] + 1.0f) / tile + 1;
      float most_near = -1e9f, most_far = 1e9f;
      for (int j = std::max(row - around, 0); j <= std::min(row + around, rows_ - 1); ++j)
        for (int i = std::max(column - around, 0); i <= std::min(column + around, columns_ - 1);
             ++i) {
          const auto other = static_cast<std::size_t>(j * columns_ + i);
          most_near = std::max(most_near, nearest_[other]);
          most_far = std::min(most_far, farthest_[other]);
        }
      even_[t] = !near_subject_[t] && alike(most_near, most_far);
    }
}

/// A tile's pixels and those within reach, where they lie, or copies where they reach beyond the
/// border, where the last goes on.
struct DepthOfField::Around {
  int left = 0, top = 0;
  std::ptrdiff_t stride = 0;
  std::array<const float*, 7> planes{};  // of that pixel, in the order of lens::DiskPlanes
  std::vector<float> copies;

  void take(const LightLayers& layers, const std::vector<float>* light, const Disks& disks,
            const Rectangle& part) {
    left = part.x;
    top = part.y;
    const bool subject = light == layers.subject;  // the scene's covers all
    const std::vector<float>* from[] = {
        &light[0],     &light[1],     &light[2],          &light[subject ? 3 : 0],
        &disks.circle, &disks.radius, &disks.inverse_area};
    if (intersection(part, {0, 0, layers.width, layers.height}) == part) {
      stride = layers.width;
      for (std::size_t p = 0; p < 7; ++p) planes[p] = from[p]->data() + layers.pixel(left, top);
      return;
    }
    stride = part.width;
    const auto size = static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height);
    copies.resize(7 * size);
    float* to = copies.data();
    for (std::size_t p = 0; p < 7; ++p) {
      planes[p] = to;
      for (int y = top; y < top + part.height; ++y)
        for (int x = left; x < left + part.width; ++x) *to++ = (*from[p])[layers.pixel(x, y)];
    }
  }
  /// From pixel (x, y) of the picture on.
  lens::DiskPlanes at(int x, int y) const {
    const std::ptrdiff_t i = (y - top) * stride + (x - left);
    return {{planes[0] + i, planes[1] + i, planes[2] + i, planes[3] + i},
            planes[4] + i,
            planes[5] + i,
            planes[6] + i};
  }
};

void DepthOfField::blur_tile(int column, int row, const LightLayers& sharp, bool layered,
                             LightLayers& focused) const {
  const auto t = static_cast<std::size_t>(row * columns_ + column);
  const int left = column * tile, right = std::min(left + tile, width_);
  const int top = row * tile, bottom = std::min(top + tile, height_);
  const bool subject = near_subject_[t] != 0;
  thread_local Around scene, bodies;
  thread_local std::vector<lens::DiskOffset> offsets;
  offsets.clear();
  if (reach_[t] > sharp_radius + 0.02f) {  // else no code shows it
    int wide = 0, high = 0;
    std::size_t count = 0;
    for (; count < offsets_.size() && offsets_[count].distance < reach_[t] + 0.5f; ++count) {
      wide = std::max(wide, std::abs(offsets_[count].x));
      high = std::max(high, std::abs(offsets_[count].y));
    }
    const Rectangle part{left - wide, top - high, tile + 2 * wide, bottom - top + 2 * high};
    scene.take(sharp, sharp.scene, scene_disks_, part);
    if (subject) bodies.take(sharp, sharp.subject, subject_disks_, part);
    for (std::size_t k = 0; k < count; ++k) {
      const Offset& o = offsets_[k];
      offsets.push_back({static_cast<int>(o.y * scene.stride) + o.x, o.distance, o.share});
    }
  }
  const int count = static_cast<int>(offsets.size());
  const lens::FocusLoops& loops = lens::FocusLoops::best();
  float light[3][tile], behind[3][tile], body[4][tile], circle[tile], radius[tile], area[tile];
  for (int y = top; y < bottom; ++y) {
    if (count > 0 && even_[t]) loops.even(scene.at(left, y), offsets.data(), count, light);
    if (count > 0 && !even_[t]) {
      if (subject) {
        const lens::DiskPlanes there = bodies.at(left, y);
        loops.subject(there, offsets.data(), count, body, circle);
        for (int i = 0; i < tile; ++i) {
          radius[i] = radius_of(circle[i]);
          area[i] = inverse_area(radius[i]);
        }
        loops.cover(there, offsets.data(), count, radius, area, body);
      }
      loops.scene(scene.at(left, y), offsets.data(), count, subject ? body : nullptr, circle,
                  light);
      if (subject && layered)
        loops.scene(scene.at(left, y), offsets.data(), count, nullptr, nullptr, behind);
    }
    const std::size_t first = sharp.pixel(left, y);
    const int pixels = right - left;
    for (std::size_t c = 0; c < 3; ++c) {
      float* to = &focused.scene[c][first];
      if (count == 0) sharp.picture(c, first, pixels, light[c]);
      std::copy_n(light[c], pixels, to);
      if (!layered || !subject) continue;
      for (int x = 0; x < pixels; ++x) {
        const std::size_t i = first + static_cast<std::size_t>(x);
        const float coverage = sharp.subject[3][i];
        if (coverage == 0.0f) continue;
        to[x] = count > 0 ? behind[c][x] : sharp.scene[c][i];
        focused.subject[c][i] = light[c][x] - (1.0f - coverage) * to[x];
        focused.subject[3][i] = coverage;
      }
    }
  }
}

void DepthOfField::apply(const Camera& camera, const ViewportLens& lens, const DepthLayers& depths,
                         const LightLayers& sharp, bool layered, LightLayers& focused) {
  width_ = sharp.width;
  height_ = sharp.height;
  columns_ = (width_ + tile - 1) / tile;
  rows_ = (height_ + tile - 1) / tile;
  subject_only_ = lens.subject_only;
  const double focal = std::max(camera.K[0][0], camera.K[1][1]);
  set_pixels(camera.K[0][0], camera.K[1][1]);
  find_disks(lens, static_cast<float>(std::min(0.5 * lens.aperture * focal, 1e6)), depths, sharp);
  find_reach();
  focused.resize(width_, height_, layered ? sharp.part : Rectangle{});
  parallel_each(columns_ * rows_, 4, 0,
                [&](int i) { blur_tile(i % columns_, i / columns_, sharp, layered, focused); });
}

}  // namespace polyhull
