// SPDX-License-Identifier: LGPL-2.1-or-later
#include "imagehull/image_hull.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "imagehull/enclosing.h"

namespace polyhull {

using imagehull::chain_edges;

namespace {

void check(const Silhouette& silhouette) {
  const Camera& camera = *silhouette.camera;
  bool finite = true;
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(camera.t[i]);
    for (int j = 0; j < 3; ++j)
      finite = finite && std::isfinite(camera.R[i][j]) && std::isfinite(camera.K[i][j]);
  }
  if (!finite || !(std::abs(glm::determinant(camera.K * camera.R)) > 1e-12))
    throw Error(
        Error::Kind::bad_input,
        "Camera '{}' cannot be used: its calibration is not finite, or has no focal length.",
        camera.name);
  if (silhouette.rings->points.size() > ImageHull::most_edges)
    throw Error(Error::Kind::unsupported,
                "The contours of camera '{}' have {} points, and rays take {} at most; raise "
                "contourfind's tolerance.",
                camera.name, silhouette.rings->points.size(), ImageHull::most_edges);
  for (const Vec2f& point : silhouette.rings->points)
    if (!(std::abs(point.x) < 1e7f && std::abs(point.y) < 1e7f))
      throw Error(
          Error::Kind::bad_input,
          "A contour of camera '{}' cannot be used: it is not finite, or ten million pixels "
          "away.",
          camera.name);
}

}  // namespace

imagehull::Chains ImageHull::View::chains() const {
  imagehull::Chains out;
  out.count = static_cast<int>(first_edges.size());
  out.middle_x = boxes[0].data();
  out.middle_y = boxes[1].data();
  out.half_x = boxes[2].data();
  out.half_y = boxes[3].data();
  out.points = chain_points.data();
  out.first_edge = first_edges.data();
  return out;
}

/// Whether the silhouette holds a pixel (around the middle), by the even-odd rule.
bool ImageHull::View::holds(const Vec2& pixel) const {
  bool in = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2 a(points[i]), b(points[next[i]]);
    if ((a.y > pixel.y) != (b.y > pixel.y) &&
        pixel.x < a.x + (b.x - a.x) * (pixel.y - a.y) / (b.y - a.y))
      in = !in;
  }
  return in;
}

/// Cuts the ring of points begin .. end - 1 into chains.
void ImageHull::add_chains(View& view, std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t first = begin; first < end; first += chain_edges) {
    Vec2f corner[chain_edges + 1], low(INFINITY), high(-INFINITY);
    for (std::uint32_t i = 0; i <= chain_edges; ++i) {
      const std::uint32_t at = std::min(first + i, end);
      corner[i] = view.points[at == end ? begin : at];
      low = glm::min(low, corner[i]);
      high = glm::max(high, corner[i]);
    }
    // More than what rounding moves a line by.
    const Vec2f margin = 4e-3f + 4e-6f * glm::max(glm::abs(low), glm::abs(high));
    const Vec2f middle = 0.5f * (low + high), half = 0.5f * (high - low) + margin;
    view.boxes[0].push_back(middle.x);
    view.boxes[1].push_back(middle.y);
    view.boxes[2].push_back(half.x);
    view.boxes[3].push_back(half.y);
    for (int axis = 0; axis < 2; ++axis)
      for (const Vec2f& p : corner) view.chain_points.push_back(p[axis]);
    view.first_edges.push_back(first);
  }
}

ImageHull::View ImageHull::prepared(const Silhouette& silhouette) {
  View view;
  const Rings& rings = *silhouette.rings;
  const Camera& camera = *silhouette.camera;
  Vec2f low(INFINITY), high(-INFINITY);
  for (const Vec2f& p : rings.points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  view.middle = 0.5 * (Vec2(low) + Vec2(high));
  Mat3 around(1.0);
  around[2] = Vec3(-view.middle, 1.0);
  view.centre = camera.centre();
  view.turn = around * camera.K * camera.R;
  const std::array<double, 9> rows = to_rows(view.turn);
  std::copy(rows.begin(), rows.end(), view.rows);
  // Off the axis: a pixel may look along that.
  view.ahead = glm::normalize(glm::transpose(camera.R) * Vec3(0.37, 0.21, 1.0));
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const std::span<const Vec2f> ring = rings.ring(r);
    if (ring.size() < 3) continue;
    const auto begin = static_cast<std::uint32_t>(view.points.size());
    for (const Vec2f& p : ring) {
      view.points.emplace_back(Vec2(p) - view.middle);
      view.next.push_back(static_cast<std::uint32_t>(view.points.size()));
    }
    view.next.back() = begin;
    add_chains(view, begin, static_cast<std::uint32_t>(view.points.size()));
  }
  return view;
}

ImageHull::ImageHull(std::span<const Silhouette> views) {
  for (const Silhouette& silhouette : views) check(silhouette);
  for (const Silhouette& silhouette : views) {
    views_.push_back(prepared(silhouette));
    View& view = views_.back();
    view.first_face = faces();
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      const Vec3 a(view.points[i], 1.0), b(view.points[view.next[i]], 1.0);
      const Vec3 across = glm::transpose(view.turn) * glm::cross(a, b);
      const double length = glm::length(across);  // 0 for an edge without length, which none meets
      across_.emplace_back(length > 0.0 ? across / length : Vec3(0.0, 0.0, 1.0));
    }
  }
  const bool seen = std::none_of(views_.begin(), views_.end(),
                                 [](const View& view) { return view.points.empty(); });
  if (!seen || views_.size() < 2) return;
  corners_ = enclosing_corners(views);
  for (const View& view : views_) {
    for (std::uint32_t i = 0; i < view.first_edges.size(); ++i) all_.chains.push_back(i);
    all_.ends.push_back(static_cast<std::uint32_t>(all_.chains.size()));
  }
  all_.empty = corners_.empty();
  double least = INFINITY;
  for (const View& view : views_)
    for (const Vec3& corner : corners_)
      least = std::min(least, glm::dot(corner - view.centre, corner - view.centre));
  // A hull that reaches to a camera leaves its size as measure.
  const double size = corners_.empty() ? 0.0 : glm::distance(corners_.front(), corners_.back());
  nearest_ = 1e-4 * std::max(std::sqrt(least), 1e-3 * size);
}

std::size_t ImageHull::view_of(std::uint32_t face) const {
  std::size_t view = views_.size() - 1;
  while (view > 0 && face < views_[view].first_face) --view;
  return view;
}

ImageHull::Origin ImageHull::from(const Vec3& place) const {
  Origin origin;
  for (const View& view : views_) {
    Vec3 way = place - view.centre;
    if (glm::dot(way, way) < nearest_ * nearest_) way = -nearest_ * view.ahead;
    const Vec3 start = view.turn * way;
    origin.start.push_back(
        {static_cast<float>(start.x), static_cast<float>(start.y), static_cast<float>(start.z)});
    origin.inside.push_back(start.z > 0.0 && view.holds(Vec2(start) / start.z));
  }
  return origin;
}

void ImageHull::gather(const Origin& origin, const std::array<Vec3f, 4>& corners,
                       Bundle& bundle) const {
  bundle.chains.resize(all_.chains.size());
  bundle.ends.clear();
  bundle.empty = true;
  std::uint32_t kept = 0;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    const View& view = views_[k];
    const glm::mat3 turn(view.turn);
    float ways[4][3];
    for (int c = 0; c < 4; ++c) {
      const Vec3f way = turn * corners[static_cast<std::size_t>(c)];
      for (int axis = 0; axis < 3; ++axis) ways[c][axis] = way[axis];
    }
    const int found = imagehull::Loops::best().gather(view.chains(), origin.start[k].data(), ways,
                                                      bundle.chains.data() + kept);
    if (found == 0 && !origin.inside[k]) return;
    kept += static_cast<std::uint32_t>(found);
    bundle.ends.push_back(kept);
  }
  bundle.empty = false;
}

void ImageHull::enter(const Origin& origin, const Bundle& bundle, const Directions& directions,
                      const float (&near)[lanes], Scratch& scratch, Hits& hits) const {
  std::fill_n(hits.inverse, lanes, 0.0f);
  std::fill_n(hits.face, lanes, 0u);
  if (bundle.empty) return;
  scratch.views.clear();
  std::uint32_t begin = 0;
  int count = 0;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    const std::uint32_t end = bundle.ends[k];
    const std::size_t room = static_cast<std::size_t>(count) + chain_edges * (end - begin);
    if (scratch.edges.size() < room) {
      scratch.edges.resize(room);
      scratch.inverse.resize(lanes * room);
    }
    std::uint32_t* edges = scratch.edges.data() + count;
    const int found = imagehull::Loops::best().cross(
        views_[k].chains(), bundle.chains.data() + begin, static_cast<int>(end - begin),
        origin.start[k].data(), views_[k].rows, directions,
        scratch.inverse.data() + static_cast<std::ptrdiff_t>(lanes) * count, edges);
    if (found == 0 && !origin.inside[k]) return;
    for (int i = 0; i < found; ++i) edges[i] += views_[k].first_face;
    scratch.views.push_back({count, count + found, origin.inside[k]});
    count += found;
    begin = end;
  }
  imagehull::Loops::best().enter(scratch.views.data(), static_cast<int>(views_.size()),
                                 scratch.inverse.data(), scratch.edges.data(), near, hits.inverse,
                                 hits.face);
}

}  // namespace polyhull
