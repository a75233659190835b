// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/motion_blur.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/thread_pool.h"
#include "render/projection.h"

namespace polyhull {
namespace {

constexpr float least_motion = 0.1f;    // pixels: less is not seen
constexpr float least_parallax = 1.0f;  // pixels: less is found from anywhere
constexpr float least_tear = 0.15f;     // pixels by which neighbours' motions differ
constexpr int most_steps = 64;
// From a frame to the next; more is a cut.
const double most_turn = glm::radians(15.0);
constexpr double most_shift = 0.5;   // of the picture's width
constexpr double most_frames = 2.0;  // by which they grow where frames lie between

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
Vec2f MotionBlur::motion_at(const Vec2f& u, float inverse) const {
  float motion[2];
  // Of one pixel, whose place is whole.
  lens::MotionLoops::best().motions(map_, static_cast<int>(u.x), static_cast<int>(u.y), &inverse, 1,
                                    motion, motion + 1);
  return {motion[0], motion[1]};
}

void MotionBlur::find_motions() {
  const auto size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  for (Motions* of : {&scene_motions_, &subject_motions_}) {
    of->x.resize(size);
    of->y.resize(size);
  }
  parallel_each(height_, 1, 0, [&](int y) {
    const auto first = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    if (!subject_only_)
      lens::MotionLoops::best().motions(map_, 0, y, scene_inverse_ + first, width_,
                                        &scene_motions_.x[first], &scene_motions_.y[first]);
    if (y < part_.y || y >= part_.y + part_.height) return;
    const std::size_t at = first + static_cast<std::size_t>(part_.x);
    lens::MotionLoops::best().motions(map_, part_.x, y, &subject_inverse_[at], part_.width,
                                      &subject_motions_.x[at], &subject_motions_.y[at]);
  });
}

/// Brings the subject's depth to the pixels around it, first along rows, then along columns.
void MotionBlur::spread_subject(const LightLayers& sharp) {
  constexpr int most = static_cast<int>(0.5f * most_motion) + 2;
  part_ = {};
  if (sharp.part.empty()) return;
  // As far as sources are looked for.
  constexpr int reach = static_cast<int>(most_motion) + 2 * tile + 2;
  const Rectangle& own = sharp.part;
  part_ = intersection({0, 0, width_, height_}, {own.x - reach, own.y - reach,
                                                 own.width + 2 * reach, own.height + 2 * reach});
  std::vector<int> ages;  // how far the pixel is away that depth was taken from
  const auto spread = [&](std::size_t from, std::size_t step, int count) {
    ages.resize(static_cast<std::size_t>(count));
    int age = most;
    float last = 0.0f;
    for (std::size_t i = 0; i < ages.size(); ++i) {
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
    for (std::size_t i = ages.size(); i-- > 0;) {
      float& here = subject_inverse_[from + i * step];
      if (ages[i] == 0) {
        last = here;
        age = 0;
      } else if (++age <= most && age < ages[i]) {
        here = last;
      }
    }
  };
  for (int y = own.y; y < own.y + own.height; ++y) spread(sharp.pixel(part_.x, y), 1, part_.width);
  for (int x = part_.x; x < part_.x + part_.width; ++x)
    spread(sharp.pixel(x, part_.y), static_cast<std::size_t>(width_), part_.height);
}

/// Cells in which, or at whose border to the next, motions differ.
void MotionBlur::find_torn() {
  const int columns = 2 * columns_;
  torn_.assign(static_cast<std::size_t>(columns * 2 * rows_of_tiles_), 0);
  parallel_each(2 * rows_of_tiles_, 1, 0, [&](int row) {
    for (int y = cell * row; y < std::min(cell * (row + 1), height_); ++y)
      for (const float* plane : {scene_motions_.x.data(), scene_motions_.y.data()}) {
        const float* here = plane + static_cast<std::ptrdiff_t>(y) * width_;
        const float* next = y + 1 < height_ ? here + width_ : here;
        for (int column = 0; cell * column < width_; ++column) {
          const int x = cell * column, end = std::min(x + cell, width_ - 1);
          float most = 0.0f;
          for (int i = x; i < end; ++i) {
            const float right = std::abs(here[i + 1] - here[i]), down = std::abs(next[i] - here[i]);
            most = std::max(most, std::max(right, down));
          }
          if (most > least_tear) torn_[static_cast<std::size_t>(row * columns + column)] = 1;
        }
      }
  });
}

/// Whether nothing in cell (column, row), and of what comes there from \p motion away, is torn.
bool MotionBlur::smooth(int column, int row, float motion) const {
  const int around = static_cast<int>(0.5f * motion + 1.0f) / cell + 1;
  const int columns = 2 * columns_, rows = 2 * rows_of_tiles_;
  for (int j = std::max(row - around, 0); j <= std::min(row + around, rows - 1); ++j)
    for (int i = std::max(column - around, 0); i <= std::min(column + around, columns - 1); ++i)
      if (torn_[static_cast<std::size_t>(j * columns + i)]) return false;
  return true;
}

/// What moves in a tile.
void MotionBlur::find_own(int column, int row, const LightLayers& sharp) {
  Reach reach;
  const Rectangle part =
      intersection({0, 0, width_, height_}, {column * tile, row * tile, tile, tile});
  for (int y = part.y; y < part.y + part.height; ++y)
    for (std::size_t i = sharp.pixel(part.x, y); i <= sharp.pixel(part.x + part.width - 1, y);
         ++i) {
      reach.nearest = std::max(reach.nearest, scene_inverse_[i]);
      reach.farthest = std::min(reach.farthest, scene_inverse_[i]);
    }
  const Rectangle bodies = intersection(part, sharp.part);
  float longest = 0.0f;
  for (int y = bodies.y; y < bodies.y + bodies.height; ++y)
    for (int x = bodies.x; x < bodies.x + bodies.width; ++x) {
      const std::size_t i = sharp.pixel(x, y);
      if (sharp.subject[3][i] == 0.0f) continue;
      reach.subject = true;
      const float across = subject_motions_.x[i], down = subject_motions_.y[i];
      longest = std::max(longest, across * across + down * down);
    }
  reach.motion = std::sqrt(longest);
  if (!subject_only_)
    for (const int x : {0, tile})
      for (const int y : {0, tile})
        for (const float inverse : {reach.nearest, reach.farthest})
          reach.motion =
              std::max(reach.motion,
                       glm::length(motion_at(Vec2f(column * tile + x, row * tile + y), inverse)));
  own_[static_cast<std::size_t>(row * columns_ + column)] = reach;
}

/// What can come to each tile, from the tiles around.
void MotionBlur::find_reach() {
  reach_ = own_;
  float longest = 0.0f;
  for (const Reach& reach : own_) longest = std::max(longest, reach.motion);
  const int most = static_cast<int>(0.5f * longest + 1.0f) / tile + 1;
  parallel_each(rows_of_tiles_, 1, 0, [&](int row) {
    for (int column = 0; column < columns_; ++column) {
      Reach& reach = reach_[static_cast<std::size_t>(row * columns_ + column)];
      for (int j = std::max(row - most, 0); j <= std::min(row + most, rows_of_tiles_ - 1); ++j)
        for (int i = std::max(column - most, 0); i <= std::min(column + most, columns_ - 1); ++i) {
          const Reach& other = own_[static_cast<std::size_t>(j * columns_ + i)];
          const int apart = std::max({std::abs(i - column) - 1, std::abs(j - row) - 1, 0}) * tile;
          if (0.5f * other.motion + 1.0f < static_cast<float>(apart)) continue;
          reach.motion = std::max(reach.motion, other.motion);
          reach.nearest = std::max(reach.nearest, other.nearest);
          reach.farthest = std::min(reach.farthest, other.farthest);
          reach.subject |= other.subject;
        }
      const Vec2f middle(column * tile + tile / 2, row * tile + tile / 2);
      reach.parallax =
          glm::length(motion_at(middle, reach.nearest) - motion_at(middle, reach.farthest));
    }
  });
}

void MotionBlur::blur_tile(int column, int row, const LightLayers& sharp,
                           LightLayers& moved) const {
  const Reach& reach = reach_[static_cast<std::size_t>(row * columns_ + column)];
  const int right = std::min((column + 1) * tile, width_),
            bottom = std::min((row + 1) * tile, height_);
  if (reach.motion < least_motion) {
    for (int y = row * tile; y < bottom; ++y)
      for (std::size_t c = 0; c < 3; ++c)
        sharp.picture(c, sharp.pixel(column * tile, y), right - column * tile,
                      &moved.scene[c][sharp.pixel(column * tile, y)]);
    return;
  }
  const auto layer = [&](const std::vector<float>* light, const float* coverage,
                         const float* inverse, const Motions& motions) {
    return lens::MovingLayer{{light[0].data(), light[1].data(), light[2].data(), coverage},
                             inverse,
                             motions.x.data(),
                             motions.y.data(),
                             width_,
                             height_};
  };
  const lens::MovingLayer scene = layer(sharp.scene, nullptr, scene_inverse_, scene_motions_),
                          subject = layer(sharp.subject, sharp.subject[3].data(),
                                          subject_inverse_.data(), subject_motions_);
  lens::MotionSpan span{};
  span.steps = std::clamp(static_cast<int>(std::ceil(reach.motion)) + 1, 2, most_steps);
  span.still = subject_only_;
  span.parallax = reach.parallax >= least_parallax;
  span.nearest = reach.nearest;
  span.farthest = reach.farthest;
  for (int top = row * tile; top < bottom; top += cell)
    for (span.x = column * tile; span.x < right; span.x += cell) {
      span.smooth = !subject_only_ && smooth(span.x / cell, top / cell, reach.motion);
      for (span.y = top; span.y < std::min(top + cell, bottom); ++span.y) {
        float light[3][lens::motion_row];
        lens::MotionLoops::best().blur(map_, scene, reach.subject ? &subject : nullptr, span,
                                       light);
        const std::size_t at = sharp.pixel(span.x, span.y);
        for (std::size_t c = 0; c < 3; ++c)
          std::copy_n(light[c], std::min(cell, right - span.x), &moved.scene[c][at]);
      }
    }
}

void MotionBlur::apply(const Camera& camera, const Shutter& shutter, const DepthLayers& depths,
                       const LightLayers& sharp, LightLayers& moved) {
  Mat3 a;
  Vec3 b;
  find_map(camera, shutter.before, a, b);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) map_.a[i][j] = static_cast<float>(a[j][i]);
    map_.b[i] = static_cast<float>(b[i]);
  }
  map_.share = static_cast<float>(shutter.share);
  map_.most = most_motion;
  subject_only_ = shutter.subject_only;
  width_ = sharp.width;
  height_ = sharp.height;
  columns_ = (width_ + tile - 1) / tile;
  rows_of_tiles_ = (height_ + tile - 1) / tile;
  scene_inverse_ = depths.scene().data();
  subject_inverse_ = depths.subject();
  spread_subject(sharp);
  find_motions();
  if (!subject_only_) find_torn();
  own_.resize(static_cast<std::size_t>(columns_ * rows_of_tiles_));
  parallel_each(rows_of_tiles_, 1, 0, [&](int row) {
    for (int column = 0; column < columns_; ++column) find_own(column, row, sharp);
  });
  find_reach();
  moved.resize(width_, height_, {});
  parallel_each(columns_ * rows_of_tiles_, 4, 0,
                [&](int i) { blur_tile(i % columns_, i / columns_, sharp, moved); });
}

}  // namespace polyhull
