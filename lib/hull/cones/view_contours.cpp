// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/cones/view_contours.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace polyhull::hull {
namespace {

void append_rings(Contours& contours, const ConeInput& input) {
  const Rings& rings = *input.silhouette->rings;
  std::uint32_t begin = 0;
  for (std::uint32_t end : rings.ends) {
    end = std::min<std::uint32_t>(end, static_cast<std::uint32_t>(rings.points.size()));
    for (std::uint32_t i = begin; i < end; ++i) {
      const Vec2f p = rings.points[i];
      if (!std::isfinite(p.x) || !std::isfinite(p.y))
        throw Error(Error::Kind::bad_input,
                    "The silhouette of camera '{}' has a point that is not finite (number {}): "
                    "expected pixels.",
                    input.silhouette->camera->name, i);
      contours.points.push_back(Vec2(p));
      contours.source.push_back(i);
      contours.view.push_back(input.view);
    }
    begin = std::max(begin, end);
    contours.ends.push_back(static_cast<std::uint32_t>(contours.points.size()));
  }
}

/// The frame's border as a ring; its edges are numbered after the silhouette's points.
void append_border(Contours& contours, const ConeInput& input) {
  const double right = input.camera->width - 0.5, bottom = input.camera->height - 0.5;
  const Vec2 corners[4] = {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    contours.points.push_back(corners[i]);
    contours.source.push_back(static_cast<std::uint32_t>(input.silhouette->rings->points.size()) +
                              i);
    contours.view.push_back(input.view);
  }
  contours.ends.push_back(static_cast<std::uint32_t>(contours.points.size()));
}

/// The part of each ring where weight(p) >= 0, weights linear: one side of Sutherland and Hodgman.
/// The pieces along the cut get the number \p cut, or that of the edge that leaves there.
template <class Weight>
void clip(Contours& contours, Weight weight, std::int64_t cut = -1) {
  Contours out;
  std::uint32_t begin = 0;
  for (std::uint32_t end : contours.ends) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t k = i + 1 < end ? i + 1 : begin;
      const Vec2 p = contours.points[i], q = contours.points[k];
      const double a = weight(p), b = weight(q);
      const auto push = [&](const Vec2& x, std::int64_t source) {
        out.points.push_back(x);
        out.source.push_back(source < 0 ? contours.source[i] : static_cast<std::uint32_t>(source));
        out.view.push_back(contours.view[i]);
      };
      if (a >= 0) push(p, -1);
      if ((a >= 0) != (b >= 0)) push(p + (q - p) * (a / (a - b)), a >= 0 ? cut : -1);
    }
    out.ends.push_back(static_cast<std::uint32_t>(out.points.size()));
    begin = end;
  }
  contours = std::move(out);
}

/// Sides of the frame are numbered as in append_border().
void clip_to_frame(Contours& contours, const ConeInput& input) {
  const double right = input.camera->width - 0.5, bottom = input.camera->height - 0.5;
  const auto border = static_cast<std::int64_t>(input.silhouette->rings->points.size());
  clip(
      contours, [&](const Vec2& p) { return p.x + 0.5; }, border + 3);
  clip(
      contours, [&](const Vec2& p) { return right - p.x; }, border + 1);
  clip(
      contours, [&](const Vec2& p) { return p.y + 0.5; }, border);
  clip(
      contours, [&](const Vec2& p) { return bottom - p.y; }, border + 2);
}

/// Moves rings of a camera with the same centre into the picture of \p to; what lies behind it is
/// cut off.
void transfer(Contours& contours, const ConeCamera& from, const ConeCamera& to) {
  const Mat3 map = to.to_pixel * from.to_ray;
  const auto depth = [&](const Vec2& p) {
    const Vec3 d = from.to_ray * Vec3(p, 1.0);
    return glm::dot(d, to.forward) - 0.02 * glm::length(d);
  };
  clip(contours, depth);
  for (Vec2& p : contours.points) {
    const Vec3 q = map * Vec3(p, 1.0);
    p = Vec2(q) / q.z;
  }
}

}  // namespace

Contours view_contours(const ConeInput& input, const ConeCamera& camera, bool complement) {
  Contours contours;
  append_rings(contours, input);
  if (complement) {
    clip_to_frame(contours, input);
    append_border(contours, input);
  }
  if (input.camera->to_pixel != camera.to_pixel) transfer(contours, *input.camera, camera);
  return contours;
}

}  // namespace polyhull::hull
