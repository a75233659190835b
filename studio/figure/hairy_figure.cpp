// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/hairy_figure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull {
namespace {

// A strand: three corners in the skin, three half way up, the tip.
constexpr std::size_t points = 7;
constexpr std::size_t faces = 10;
constexpr std::uint32_t face[faces][3] = {{0, 2, 1}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4},
                                          {2, 0, 3}, {2, 3, 5}, {3, 4, 6}, {4, 5, 6}, {5, 3, 6}};

/// Number \p index of the sequence with step \p step (Roberts 2018), 0..1.
double fraction(std::size_t index, double step) {
  const double value = 0.5 + step * static_cast<double>(index);
  return value - std::floor(value);
}

}  // namespace

HairyFigure::HairyFigure(std::shared_ptr<const Figure> figure, int strands)
    : figure_(std::move(figure)) {
  const std::vector<Vec3f>& rest = figure_->rest_positions();
  triangles_ = figure_->triangles();
  vertex_count_ = figure_->vertex_count();
  std::vector<double> areas{0.0};  // of all triangles before
  for (std::size_t t = 0; t < triangles_.size(); t += 3) {
    const Vec3f &a = rest[triangles_[t]], &b = rest[triangles_[t + 1]],
                &c = rest[triangles_[t + 2]];
    areas.push_back(areas.back() + 0.5 * glm::length(glm::cross(b - a, c - a)));
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(strands); ++i) {
    const double wanted = (static_cast<double>(i) + 0.5) / strands * areas.back();
    Strand strand;
    const auto after = std::upper_bound(areas.begin(), areas.end(), wanted);
    strand.triangle = static_cast<std::uint32_t>(std::clamp<std::ptrdiff_t>(
        after - areas.begin() - 1, 0, static_cast<std::ptrdiff_t>(areas.size()) - 2));
    double u = fraction(i, 0.7548776662466927), v = fraction(i, 0.5698402909980532);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    strand.at = Vec3f(1.0 - u - v, u, v);
    const std::uint32_t* corner = &triangles_[3 * static_cast<std::size_t>(strand.triangle)];
    const float height = rest[corner[0]].y;
    if (height < 0.12f) continue;  // shoes
    const auto size = static_cast<float>(fraction(i, 0.4142135623730950));
    strand.length = (height > 1.56f ? 0.075f : 0.038f) * (0.5f + size);
    strand.radius = 0.0009f;
    strand.shade = 0.75f + 0.35f * static_cast<float>(fraction(i, 0.7320508075688772));
    strand.lean =
        Vec3f(fraction(i, 0.8191725133961645) - 0.5, -0.35, fraction(i, 0.6710436067037893) - 0.5);
    strands_.push_back(strand);
  }
  for (std::size_t s = 0; s < strands_.size(); ++s)
    for (const auto& corners : face)
      for (const std::uint32_t corner : corners)
        triangles_.push_back(static_cast<std::uint32_t>(vertex_count_ + points * s + corner));
  vertex_count_ += points * strands_.size();
}

void HairyFigure::pose(double seconds, SubjectFrame& frame) const {
  figure_->pose(seconds, frame);
  const std::size_t first = figure_->vertex_count();
  frame.positions.resize(vertex_count_);
  frame.normals.resize(vertex_count_);
  parallel_each(strands_.size(), 512, 0, [&](std::size_t s) {
    const Strand& strand = strands_[s];
    const std::uint32_t* v = &triangles_[3 * static_cast<std::size_t>(strand.triangle)];
    const auto mix = [&](const std::vector<Vec3f>& values) {
      return values[v[0]] * strand.at.x + values[v[1]] * strand.at.y + values[v[2]] * strand.at.z;
    };
    const Vec3f up = glm::normalize(mix(frame.normals)), foot = mix(frame.positions);
    const Vec3f any = std::abs(up.y) < 0.8f ? Vec3f(0, 1, 0) : Vec3f(1, 0, 0);
    const Vec3f across = glm::normalize(glm::cross(any, up)), along = glm::cross(up, across);
    const Vec3f half = foot + strand.length * (0.55f * up + 0.15f * strand.lean);
    const Vec3f tip = foot + strand.length * (0.9f * up + 0.55f * strand.lean);
    Vec3f* place = &frame.positions[first + points * s];
    for (int k = 0; k < 3; ++k) {
      const float angle = 2.0943951f * static_cast<float>(k);
      const Vec3f side = strand.radius * (std::cos(angle) * across + std::sin(angle) * along);
      place[k] = foot - 0.002f * up + side;
      place[3 + k] = half + 0.75f * side;
    }
    place[6] = tip;
    std::fill_n(&frame.normals[first + points * s], points, up);
  });
}

Vec3f HairyFigure::albedo(std::uint32_t triangle, const Vec3f& at, float width) const {
  const auto own = static_cast<std::uint32_t>(figure_->triangles().size() / 3);
  if (triangle < own) return figure_->albedo(triangle, at, width);
  const Strand& strand = strands_[(triangle - own) / faces];
  return strand.shade * figure_->albedo(strand.triangle, strand.at, width);
}

}  // namespace polyhull
