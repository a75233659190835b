// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/motion_blur.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

constexpr float least_motion = 0.1f;    // pixels: less is not seen
constexpr float arrived = 0.5f;         // pixels from where a source was to lead
constexpr float least_parallax = 1.0f;  // pixels: less is found from anywhere
constexpr int iterations = 3;
constexpr int most_steps = 64;
// From a frame to the next; more is a cut.
const double most_turn = glm::radians(15.0);
constexpr double most_shift = 0.5;   // of the picture's width
constexpr double most_frames = 2.0;  // by which they grow where frames lie between

/// Between four pixels.
Float4 between(const std::vector<Float4>& layer, const LightLayers& layers, float x, float y) {
  const float left = std::floor(x), top = std::floor(y);
  const float across = x - left, down = y - top;
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  const Float4 above =
      (1.0f - across) * layer[layers.pixel(i, j)] + across * layer[layers.pixel(i + 1, j)];
  const Float4 below =
      (1.0f - across) * layer[layers.pixel(i, j + 1)] + across * layer[layers.pixel(i + 1, j + 1)];
  return (1.0f - down) * above + down * below;
}

/// A and b of motion_blur.h.
void find_map(const Camera& camera, const Camera& before, Mat3& a, Vec3& b) {
  const Mat3 turn = before.R * glm::transpose(camera.R);
  a = before.K * turn * glm::inverse(camera.K);
  b = before.K * (before.t - turn * camera.t);
}

}  // namespace

bool MotionBlur::is_cut(const Camera& camera, const Camera& before, double frames) {
  const double allowed = std::clamp(frames, 1.0, most_frames);
  const Mat3 turn = before.R * glm::transpose(camera.R);
  if (turn[0][0] + turn[1][1] + turn[2][2] < 1.0 + 2.0 * std::cos(allowed * most_turn)) return true;
  Mat3 a;
  Vec3 b;
  find_map(camera, before, a, b);
  const Vec2 middle{0.5 * (camera.width - 1.0), 0.5 * (camera.height - 1.0)};
  for (const double inverse : {0.0, 1.0 / 3.0}) {
    const Vec3 q = a * Vec3(middle, 1.0) + inverse * b;
    if (!(q.z > 0.0)) return true;
    if (glm::length(middle - Vec2(q) / q.z) > allowed * most_shift * camera.width) return true;
  }
  return false;
}

bool MotionBlur::moves(const Camera& camera, const Shutter& shutter) {
  if (!(shutter.share > 0.0)) return false;
  Mat3 a;
  Vec3 b;
  find_map(camera, shutter.before, a, b);
  const double width = camera.width, height = camera.height;
  double most = 0.0;
  for (const double inverse : {0.0, 1.0 / 3.0, 2.0})
    for (const Vec2& at : {Vec2(0.5, 0.5), Vec2(0, 0), Vec2(1, 0), Vec2(0, 1), Vec2(1, 1)}) {
      const Vec2 u{at.x * (width - 1.0), at.y * (height - 1.0)};
      const Vec3 q = a * Vec3(u, 1.0) + inverse * b;
      if (q.z > 0.0) most = std::max(most, glm::length(u - Vec2(q) / q.z));
    }
  return shutter.share * most >= static_cast<double>(least_motion);
}

/// How far what is at \p u moves while the shutter is open.
MotionBlur::Point MotionBlur::motion_at(Point u, float inverse) const {
  const Vec3f at(u.x, u.y, 1.0f);
  const float z = glm::dot(rows_[2], at) + inverse * shift_.z;
  if (!(z > 1e-3f)) return {0.0f, 0.0f};  // it was behind the eye
  Point motion{u.x - (glm::dot(rows_[0], at) + inverse * shift_.x) / z,
               u.y - (glm::dot(rows_[1], at) + inverse * shift_.y) / z};
  const float length = share_ * std::hypot(motion.x, motion.y);
  const float scale = length > most_motion ? share_ * most_motion / length : share_;
  return {scale * motion.x, scale * motion.y};
}

/// Where lies what is at \p p at \p time (-1/2..1/2 of the shutter's); \p begin is the 1/z that is
/// tried first, \p error by how much it misses \p p.
MotionBlur::Point MotionBlur::source(const std::vector<float>& inverses, Point p, float time,
                                     float begin, float& error) const {
  Point motion = motion_at(p, begin), q{};
  for (int i = 0; i < iterations; ++i) {
    q = {p.x - time * motion.x, p.y - time * motion.y};
    const std::size_t at =
        layers_.pixel(static_cast<int>(std::lround(q.x)), static_cast<int>(std::lround(q.y)));
    motion = motion_at(q, inverses[at]);
    error = std::hypot(q.x + time * motion.x - p.x, q.y + time * motion.y - p.y);
    if (error < 0.05f) break;
  }
  return q;
}

MotionBlur::Point MotionBlur::scene_source(Point p, float time, const Reach& reach) const {
  if (subject_only_) return p;
  const std::vector<float>& inverses = *scene_inverse_;
  const std::size_t own =
      layers_.pixel(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
  Point best = p;
  float least_error = 1e9f, nearest = -1.0f;
  for (const float begin : {inverses[own], reach.nearest, reach.farthest}) {
    float error = 0.0f;
    const Point q = source(inverses, p, time, begin, error);
    const float depth = inverses[layers_.pixel(static_cast<int>(std::lround(q.x)),
                                               static_cast<int>(std::lround(q.y)))];
    const bool arrives = error < arrived, better = nearest >= 0.0f ? arrives && depth > nearest
                                                                   : arrives || error < least_error;
    if (!better) continue;
    best = q;
    least_error = error;
    if (arrives) nearest = depth;
    if (reach.parallax < least_parallax) break;
  }
  return best;
}

/// The light at \p p at \p time.
Float4 MotionBlur::seen(Point p, float time, const Reach& reach) const {
  const Point s = scene_source(p, time, reach);
  const Float4 scene = between(layers_.scene, layers_, s.x, s.y);
  if (!reach.subject) return scene;
  float error = 0.0f;
  const std::size_t own =
      layers_.pixel(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
  const Point q = source(subject_inverse_, p, time, subject_inverse_[own], error);
  const Float4 subject = between(layers_.subject, layers_, q.x, q.y);
  if (subject[3] == 0.0f) return scene;
  // What stands before the subject stays before it.
  const auto depth_at = [&](const std::vector<float>& inverses, Point at) {
    return inverses[layers_.pixel(static_cast<int>(std::lround(at.x)),
                                  static_cast<int>(std::lround(at.y)))];
  };
  if (depth_at(*scene_inverse_, s) > depth_at(subject_inverse_, q)) return scene;
  return subject + (1.0f - subject[3]) * scene;
}

void MotionBlur::blur_tile(int column, int row, const SharpPictures& sharp, std::uint8_t* target,
                           int target_stride) const {
  const Reach& reach = reach_[static_cast<std::size_t>(row * columns_ + column)];
  const int right = std::min((column + 1) * tile, layers_.width);
  const int steps = std::clamp(static_cast<int>(std::ceil(reach.motion)) + 1, 2, most_steps);
  const float share = 1.0f / static_cast<float>(steps);
  const std::uint8_t* codes = linear_to_srgb_table();
  for (int y = row * tile; y < std::min((row + 1) * tile, layers_.height); ++y)
    for (int x = column * tile; x < right; ++x) {
      const std::uint8_t* from =
          sharp.full + static_cast<std::ptrdiff_t>(y) * sharp.stride + 4 * std::ptrdiff_t{x};
      std::uint8_t* to =
          target + static_cast<std::ptrdiff_t>(y) * target_stride + 4 * std::ptrdiff_t{x};
      std::memcpy(to, from, 4);
      if (reach.motion < least_motion) continue;
      Float4 light{};
      for (int i = 0; i < steps; ++i)
        light += seen({static_cast<float>(x), static_cast<float>(y)},
                      (static_cast<float>(i) + 0.5f) * share - 0.5f, reach);
      for (int c = 0; c < 3; ++c) to[c] = linear_to_srgb(share * light[c], codes);
    }
}

/// Brings the subject's depth to the pixels around it, first along rows, then along columns.
void MotionBlur::spread_subject() {
  subject_inverse_ = layers_.subject_inverse;
  constexpr int most = static_cast<int>(0.5f * most_motion) + 2;
  std::vector<int> ages;  // how far the pixel is away that depth was taken from
  const auto spread = [&](std::size_t from, std::size_t step, std::size_t count) {
    ages.resize(count);
    int age = most;
    float last = 0.0f;
    for (std::size_t i = 0; i < count; ++i) {
      float& here = subject_inverse_[from + i * step];
      if (here > 0.0f) {
        last = here;
        age = 0;
      } else if (++age <= most) {
        here = last;
      }
      ages[i] = age;
    }
    age = most;
    for (std::size_t i = count; i-- > 0;) {
      float& here = subject_inverse_[from + i * step];
      if (ages[i] == 0) {
        last = here;
        age = 0;
      } else if (++age <= most && age < ages[i]) {
        here = last;
      }
    }
  };
  const auto columns = static_cast<std::size_t>(layers_.width),
             rows = static_cast<std::size_t>(layers_.height);
  for (std::size_t y = 0; y < rows; ++y) {
    const auto row = subject_inverse_.begin() + static_cast<std::ptrdiff_t>(y * columns);
    if (std::any_of(row, row + layers_.width, [](float w) { return w > 0.0f; }))
      spread(y * columns, 1, columns);
  }
  for (std::size_t x = 0; x < columns; ++x) spread(x, columns, rows);
}

/// What can come to each tile, from the tiles around.
void MotionBlur::find_reach() {
  columns_ = (layers_.width + tile - 1) / tile;
  rows_of_tiles_ = (layers_.height + tile - 1) / tile;
  std::vector<Reach> own(static_cast<std::size_t>(columns_ * rows_of_tiles_));
  for (Reach& reach : own) reach.farthest = 1e9f;
  const auto length = [](Point motion) { return std::hypot(motion.x, motion.y); };
  for (int y = 0; y < layers_.height; ++y)
    for (int x = 0; x < layers_.width; ++x) {
      Reach& reach = own[static_cast<std::size_t>(y / tile * columns_ + x / tile)];
      const std::size_t i = layers_.pixel(x, y);
      const Point at{static_cast<float>(x), static_cast<float>(y)};
      const float inverse = (*scene_inverse_)[i];
      reach.nearest = std::max(reach.nearest, inverse);
      reach.farthest = std::min(reach.farthest, inverse);
      if (layers_.subject[i][3] > 0.0f) {
        reach.subject = true;
        reach.motion = std::max(reach.motion, length(motion_at(at, subject_inverse_[i])));
      }
    }
  for (int row = 0; row < rows_of_tiles_; ++row)
    for (int column = 0; column < columns_; ++column) {
      Reach& reach = own[static_cast<std::size_t>(row * columns_ + column)];
      if (subject_only_) continue;
      for (const float x : {0.0f, static_cast<float>(tile)})
        for (const float y : {0.0f, static_cast<float>(tile)})
          for (const float inverse : {reach.nearest, reach.farthest})
            reach.motion =
                std::max(reach.motion, length(motion_at({static_cast<float>(column * tile) + x,
                                                         static_cast<float>(row * tile) + y},
                                                        inverse)));
    }
  reach_ = own;
  constexpr int most = static_cast<int>(0.5f * most_motion) / tile + 1;
  for (int row = 0; row < rows_of_tiles_; ++row)
    for (int column = 0; column < columns_; ++column) {
      Reach& reach = reach_[static_cast<std::size_t>(row * columns_ + column)];
      for (int j = std::max(row - most, 0); j <= std::min(row + most, rows_of_tiles_ - 1); ++j)
        for (int i = std::max(column - most, 0); i <= std::min(column + most, columns_ - 1); ++i) {
          const Reach& other = own[static_cast<std::size_t>(j * columns_ + i)];
          const int apart = std::max({std::abs(i - column) - 1, std::abs(j - row) - 1, 0}) * tile;
          if (0.5f * other.motion + 1.0f < static_cast<float>(apart)) continue;
          reach.motion = std::max(reach.motion, other.motion);
          reach.nearest = std::max(reach.nearest, other.nearest);
          reach.farthest = std::min(reach.farthest, other.farthest);
          reach.subject |= other.subject;
        }
      const Point middle{(static_cast<float>(column) + 0.5f) * tile,
                         (static_cast<float>(row) + 0.5f) * tile};
      const Point near = motion_at(middle, reach.nearest), far = motion_at(middle, reach.farthest);
      reach.parallax = length({near.x - far.x, near.y - far.y});
    }
}

void MotionBlur::apply(const Camera& camera, const Shutter& shutter, const DepthLayers& depths,
                       const SharpPictures& sharp, std::uint8_t* target, int target_stride) {
  Mat3 a;
  Vec3 b;
  find_map(camera, shutter.before, a, b);
  for (int i = 0; i < 3; ++i) rows_[i] = Vec3f(glm::transpose(a)[i]);
  shift_ = Vec3f(b);
  share_ = static_cast<float>(shutter.share);
  subject_only_ = shutter.subject_only;
  layers_.read(depths, sharp);
  scene_inverse_ = &depths.scene();
  spread_subject();
  find_reach();
  parallel_for(static_cast<std::size_t>(columns_ * rows_of_tiles_), 4, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (int i = static_cast<int>(begin); i < static_cast<int>(end); ++i)
                   blur_tile(i % columns_, i / columns_, sharp, target, target_stride);
               });
}

}  // namespace polyhull
