// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/depth_of_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>

#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

constexpr float sharp_radius = 0.5f;  // a disk of this one, as it is drawn, is a pixel
constexpr float exact_radius = 4.5f;  // up to here all pixels are looked at
constexpr int ring_offsets = 48;
constexpr float least = 1e-4f;

float within(float value) {
  return std::clamp(value, 0.0f, 1.0f);
}

/// The share to which circle \p c lies before \p other.
float before(float c, float other) {
  const float width = std::max(1.0f, 0.25f * std::max(std::abs(c), std::abs(other)));
  return within((c - other) / width - 0.5f);
}

/// A sum of light and of the weights that it came with.
struct Sum {
  Float4 light{};
  float weight = 0.0f;
  void add(float w, const Float4& value) {
    light += w * value;
    weight += w;
  }
  /// Its light as that of a layer of coverage 0 to 1.
  Float4 layer() const { return weight > 1.0f ? light * (1.0f / weight) : light; }
  float coverage() const { return std::min(weight, 1.0f); }
};

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
  find_disks();
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
void DepthOfField::find_disks() {
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

/// Of a disk at \p distance from its middle.
float DepthOfField::weight(const Disk& disk, float distance) {
  return within(disk.radius - distance + 0.5f) * disk.inverse_area;
}

void DepthOfField::find_circles(const ViewportLens& lens, float scale, const DepthLayers& depths) {
  const std::size_t count = layers_.scene.size();
  scene_disks_.resize(count);
  subject_disks_.resize(count);
  const float focus = static_cast<float>(1.0 / lens.focus_distance);
  const auto disk = [&](float inverse, bool pixel) {
    const float circle = scale * (inverse - focus);
    const float radius = pixel ? sharp_radius : radius_of(circle);
    return Disk{circle, radius, inverse_area(radius)};
  };
  parallel_for(count, 4096, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      scene_disks_[i] = disk(depths.scene()[i], subject_only_);
      if (layers_.subject[i][3] > 0.0f) subject_disks_[i] = disk(layers_.subject_inverse[i], false);
    }
  });
}

/// How far disks reach, tile by tile.
void DepthOfField::find_reach(int width, int height) {
  columns_ = (width + tile - 1) / tile;
  rows_ = (height + tile - 1) / tile;
  const auto tiles = static_cast<std::size_t>(columns_ * rows_);
  std::vector<float> scene(tiles, 0.0f), subject(tiles, -1.0f);     // the largest radius in each
  std::vector<float> nearest(tiles, -1e9f), farthest(tiles, 1e9f);  // of the scene's circles
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t i = layers_.pixel(x, y),
                        t = static_cast<std::size_t>(y / tile * columns_ + x / tile);
      const Disk& disk = scene_disks_[i];
      scene[t] = std::max(scene[t], disk.radius);
      nearest[t] = std::max(nearest[t], disk.circle);
      farthest[t] = std::min(farthest[t], disk.circle);
      if (layers_.subject[i][3] > 0.0f) subject[t] = std::max(subject[t], subject_disks_[i].radius);
    }
  reach_.assign(tiles, 0.0f);
  near_subject_.assign(tiles, 0);
  even_.assign(tiles, 0);
  constexpr int most = static_cast<int>(most_radius) / tile + 1;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const auto t = static_cast<std::size_t>(row * columns_ + column);
      for (int j = std::max(row - most, 0); j <= std::min(row + most, rows_ - 1); ++j)
        for (int i = std::max(column - most, 0); i <= std::min(column + most, columns_ - 1); ++i) {
          const auto other = static_cast<std::size_t>(j * columns_ + i);
          const int apart = std::max({std::abs(i - column) - 1, std::abs(j - row) - 1, 0}) * tile;
          for (const float radius : {scene[other], subject[other]})
            if (radius + 1.0f > static_cast<float>(apart)) reach_[t] = std::max(reach_[t], radius);
          if (subject[other] + 1.0f > static_cast<float>(apart)) near_subject_[t] = 1;
        }
      const int around = static_cast<int>(reach_[t] + 1.0f) / tile + 1;
      float most_near = -1e9f, most_far = 1e9f;
      for (int j = std::max(row - around, 0); j <= std::min(row + around, rows_ - 1); ++j)
        for (int i = std::max(column - around, 0); i <= std::min(column + around, columns_ - 1);
             ++i) {
          const auto other = static_cast<std::size_t>(j * columns_ + i);
          most_near = std::max(most_near, nearest[other]);
          most_far = std::min(most_far, farthest[other]);
        }
      even_[t] = !near_subject_[t] && before(most_near, most_far) == 0.0f;
    }
}

/// The subject's light at a pixel and, last, its coverage there; \p circle gets its c.
Float4 DepthOfField::gather_subject(int x, int y, std::size_t count, float& circle) const {
  Float4 light{};
  float circles = 0.0f;
  for (std::size_t k = 0; k < count; ++k) {
    const Offset& o = offsets_[k];
    const std::size_t q = layers_.pixel(x + o.x, y + o.y);
    if (layers_.subject[q][3] == 0.0f) continue;
    const float w = o.share * weight(subject_disks_[q], o.distance);
    light += w * layers_.subject[q];
    circles += w * layers_.subject[q][3] * subject_disks_[q].circle;
  }
  if (light[3] < least) return Float4{};
  circle = circles / light[3];
  // The subject as if it were even here, so that its coverage is that of its outline.
  const float radius = radius_of(circle);
  const Disk mean{circle, radius, inverse_area(radius)};
  float coverage = 0.0f;
  for (std::size_t k = 0; k < count && offsets_[k].distance < radius + 0.5f; ++k) {
    const Offset& o = offsets_[k];
    coverage +=
        o.share * weight(mean, o.distance) * layers_.subject[layers_.pixel(x + o.x, y + o.y)][3];
  }
  return light * (within(coverage) / light[3]);
}

/// A pixel's light where circles are alike around it.
Float4 DepthOfField::gather_even(int x, int y, std::size_t count) const {
  Float4 light{};
  float sum = 0.0f;
  for (std::size_t k = 0; k < count; ++k) {
    const Offset& o = offsets_[k];
    const std::size_t q = layers_.pixel(x + o.x, y + o.y);
    const float w = o.share * weight(scene_disks_[q], o.distance);
    light += w * layers_.scene[q];
    sum += w;
  }
  return sum > least ? light * (1.0f / sum) : layers_.scene[layers_.pixel(x, y)];
}

/// A pixel's light.
Float4 DepthOfField::gather(int x, int y, std::size_t count, bool subject) const {
  float subject_circle = 0.0f;
  Float4 body{};
  if (subject) body = gather_subject(x, y, count, subject_circle);
  const std::size_t p = layers_.pixel(x, y);
  const Disk& disk = scene_disks_[p];
  const float own = disk.circle;
  Sum nearest, front, middle, behind;
  for (std::size_t k = 0; k < count; ++k) {
    const Offset& o = offsets_[k];
    const std::size_t q = layers_.pixel(x + o.x, y + o.y);
    const Disk& other = scene_disks_[q];
    const float c = other.circle;
    const float back = o.distance < disk.radius + 0.5f ? before(own, c) : 0.0f;
    const float over = body[3] > 0.0f ? before(c, subject_circle) : 0.0f;
    if (back > 0.0f)
      behind.add((1.0f - over) * back * o.share * weight(disk, o.distance), layers_.scene[q]);
    if (other.radius + 0.5f <= o.distance) continue;
    const float w = o.share * weight(other, o.distance);
    const float ahead = before(c, own);
    nearest.add(over * w, layers_.scene[q]);
    front.add((1.0f - over) * ahead * w, layers_.scene[q]);
    middle.add((1.0f - over) * (1.0f - ahead - before(own, c)) * w, layers_.scene[q]);
  }
  Float4 scene = middle.layer();
  const float left = 1.0f - middle.coverage();
  if (behind.weight > least) {
    scene += (left / behind.weight) * behind.light;
  } else if (middle.weight > least) {
    scene = middle.light * (1.0f / middle.weight);
  } else {
    scene = layers_.scene[p];
  }
  scene = front.layer() + (1.0f - front.coverage()) * scene;
  if (body[3] == 0.0f) return scene;
  return nearest.layer() + (1.0f - nearest.coverage()) * (body + (1.0f - body[3]) * scene);
}

void DepthOfField::blur_tile(int column, int row, const SharpPictures& sharp, std::uint8_t* target,
                             int target_stride) const {
  const auto t = static_cast<std::size_t>(row * columns_ + column);
  const int right = std::min((column + 1) * tile, width_);
  const bool same = reach_[t] <= sharp_radius + 0.02f;  // which no code shows
  std::size_t count = 0;
  while (count < offsets_.size() && offsets_[count].distance < reach_[t] + 0.5f) ++count;
  const std::uint8_t* codes = linear_to_srgb_table();
  for (int y = row * tile; y < std::min((row + 1) * tile, height_); ++y)
    for (int x = column * tile; x < right; ++x) {
      const std::uint8_t* from =
          sharp.full + static_cast<std::ptrdiff_t>(y) * sharp.stride + 4 * std::ptrdiff_t{x};
      std::uint8_t* to =
          target + static_cast<std::ptrdiff_t>(y) * target_stride + 4 * std::ptrdiff_t{x};
      std::memcpy(to, from, 4);
      if (same) continue;
      const Float4 light =
          even_[t] ? gather_even(x, y, count) : gather(x, y, count, near_subject_[t] != 0);
      for (int c = 0; c < 3; ++c) to[c] = linear_to_srgb(light[c], codes);
    }
}

void DepthOfField::apply(const Camera& camera, const ViewportLens& lens, const DepthLayers& depths,
                         const SharpPictures& sharp, std::uint8_t* target, int target_stride) {
  width_ = depths.width();
  height_ = depths.height();
  subject_only_ = lens.subject_only;
  const double focal = std::max(camera.K[0][0], camera.K[1][1]);
  set_pixels(camera.K[0][0], camera.K[1][1]);
  layers_.read(depths, sharp);
  find_circles(lens, static_cast<float>(std::min(0.5 * lens.aperture * focal, 1e6)), depths);
  find_reach(width_, height_);
  parallel_for(static_cast<std::size_t>(columns_ * rows_), 4, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (int i = static_cast<int>(begin); i < static_cast<int>(end); ++i)
                   blur_tile(i % columns_, i / columns_, sharp, target, target_stride);
               });
}

}  // namespace polyhull
