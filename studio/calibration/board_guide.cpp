// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/board_guide.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace polyhull::calibration {
namespace {

constexpr double same_shape = 0.03;  // of the picture's width, in each measure
constexpr std::size_t few_shared = 3;

}  // namespace

BoardGuide::BoardGuide(std::vector<TakeCamera> cameras, const Enough& enough)
    : cameras_(std::move(cameras)),
      enough_(enough),
      kept_(cameras_.size()),
      covered_(cameras_.size(), std::vector<char>(columns * rows, 0)),
      shared_(cameras_.size() * cameras_.size(), 0) {}

BoardGuide::Shape BoardGuide::shape_of(const View& view) const {
  const double by_width = 1.0 / std::max(1, cameras_[view.camera].width);
  const double share = 1.0 / static_cast<double>(view.corners.size());
  Vec2 mean(0.0);
  for (const Vec2& corner : view.corners) mean += share * corner;
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (const Vec2& corner : view.corners) {
    const Vec2 off = corner - mean;
    xx += share * off.x * off.x;
    xy += share * off.x * off.y;
    yy += share * off.y * off.y;
  }
  const double wide = std::sqrt(xx), high = std::sqrt(yy);
  const double slant = xy / std::max(1e-9, std::sqrt(wide * high));
  return {mean.x * by_width, mean.y * by_width, wide * by_width, high * by_width, slant * by_width};
}

bool BoardGuide::is_new(const View& view) const {
  const Shape shape = shape_of(view);
  return std::ranges::none_of(kept_[view.camera], [&](const Shape& other) {
    return std::abs(shape.x - other.x) < same_shape && std::abs(shape.y - other.y) < same_shape &&
           std::abs(shape.wide - other.wide) < same_shape &&
           std::abs(shape.high - other.high) < same_shape &&
           std::abs(shape.slant - other.slant) < same_shape;
  });
}

bool BoardGuide::add(const std::vector<View>& views) {
  bool worth = false;
  for (const View& view : views) {
    if (view.corners.empty()) continue;
    worth = worth || is_new(view);
    for (const View& other : views)
      worth = worth || (other.camera != view.camera && !other.corners.empty() &&
                        shared(view.camera, other.camera) < few_shared);
  }
  if (!worth) return false;
  for (const View& view : views) {
    if (view.corners.empty()) continue;
    const TakeCamera& camera = cameras_[view.camera];
    kept_[view.camera].push_back(shape_of(view));
    for (const Vec2& corner : view.corners) {
      const int x = static_cast<int>(columns * corner.x / camera.width);
      const int y = static_cast<int>(rows * corner.y / camera.height);
      for (int v = std::max(0, y - 1); v <= std::min(rows - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(columns - 1, x + 1); ++u)
          covered_[view.camera][static_cast<std::size_t>(v * columns + u)] = 1;
    }
    for (const View& other : views)
      if (other.camera != view.camera && !other.corners.empty())
        ++shared_[view.camera * cameras_.size() + other.camera];
  }
  ++instants_;
  return true;
}

bool BoardGuide::covered(std::size_t camera, int column, int row) const {
  return covered_[camera][static_cast<std::size_t>(row * columns + column)] != 0;
}

double BoardGuide::coverage(std::size_t camera) const {
  return static_cast<double>(std::ranges::count(covered_[camera], 1)) / (columns * rows);
}

BoardGuide::Place BoardGuide::next_place(std::size_t camera) const {
  Place place;
  double most = 0.0;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) {
      const int left = x * columns / 3, right = (x + 1) * columns / 3;
      const int top = y * rows / 3, bottom = (y + 1) * rows / 3;
      int open = 0;
      for (int v = top; v < bottom; ++v)
        for (int u = left; u < right; ++u) open += covered(camera, u, v) ? 0 : 1;
      const double share = static_cast<double>(open) / ((right - left) * (bottom - top));
      if (share <= most) continue;
      most = share;
      place = {x, y};
    }
  return place;
}

std::size_t BoardGuide::unlinked(std::size_t camera) const {
  const std::size_t count = cameras_.size();
  std::vector<char> linked(count, 0);
  std::vector<std::size_t> open{camera};
  linked[camera] = 1;
  while (!open.empty()) {
    const std::size_t a = open.back();
    open.pop_back();
    for (std::size_t b = 0; b < count; ++b)
      if (linked[b] == 0 && shared(a, b) >= enough_.shared) {
        linked[b] = 1;
        open.push_back(b);
      }
  }
  std::size_t best = count;
  for (std::size_t b = 0; b < count; ++b)
    if (linked[b] == 0 && (best == count || shared(camera, b) > shared(camera, best))) best = b;
  return best;
}

std::string BoardGuide::wish(std::size_t camera) const {
  if (coverage(camera) < enough_.coverage) {
    constexpr const char* heights[] = {"upper ", "", "lower "};
    constexpr const char* sides[] = {"left", "middle", "right"};
    const Place place = next_place(camera);
    return std::string(heights[place.row]) + sides[place.column];
  }
  if (views(camera) < enough_.views) return "other slants and distances";
  const std::size_t other = unlinked(camera);
  return other == cameras_.size() ? ""
                                  : fmt::format("where '{}' sees it, too", cameras_[other].name);
}

bool BoardGuide::enough() const {
  for (std::size_t c = 0; c < cameras_.size(); ++c)
    if (!wish(c).empty()) return false;
  return true;
}

}  // namespace polyhull::calibration
