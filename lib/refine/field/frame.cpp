// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/frame.h"

#include <cmath>

#include "base/error.h"
#include "hull/measure.h"

namespace polyhull::refine {
namespace {

bool near(const Box& a, const Box& b, float margin) {
  for (int k = 0; k < 3; ++k) {
    const float apart = k == 0 ? margin + 8.0f : margin;  // rows are whole vectors of nodes
    if (a.low[k] > b.high[k] + apart || b.low[k] > a.high[k] + apart) return false;
  }
  return true;
}

}  // namespace

LocalFrame frame_of(const Hull& hull, double cells_per_unit) {
  Vec3 low(1e300), high(-1e300);
  for (const Vec3f& v : hull.vertices) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw Error(Error::Kind::bad_input, "A mesh has a vertex that is not finite.");
    low = glm::min(low, Vec3(v));
    high = glm::max(high, Vec3(v));
  }
  LocalFrame frame;
  frame.cells = cells_per_unit;
  frame.origin = hull.origin + 0.5 * (low + high);
  const Vec3 size = high - low;
  for (int k = 1; k < 3; ++k)
    if (size[k] > size[frame.x_axis]) frame.x_axis = k;
  return frame;
}

ContactView view_in(const LocalFrame& frame, const Camera& camera) {
  ContactView view;
  const Mat3 turn = camera.K * camera.R;
  const Vec3 shift = camera.K * camera.to_camera(frame.origin) * frame.cells;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k)
      view.pixel[i][k] = static_cast<float>(turn[(frame.x_axis + k) % 3][i]);
    view.pixel[i][3] = static_cast<float>(shift[i]);
  }
  view.focal = static_cast<float>(std::sqrt(std::abs(camera.K[0][0] * camera.K[1][1])));
  view.centre = frame.from_world(camera.centre());
  return view;
}

OutlineView outline_in(const LocalFrame& frame, const Camera& camera, const Rings& rings,
                       float spacing) {
  OutlineView view;
  view.rings = &rings;
  view.centre = frame.from_world(camera.centre());
  view.spacing = spacing;
  const Mat3 to_world = glm::transpose(camera.R) * glm::inverse(camera.K);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) view.ray[i][k] = to_world[i][(frame.x_axis + k) % 3];
  return view;
}

std::vector<Box> boxes_of(const Hull& hull, const LocalFrame& frame, float margin) {
  const std::vector<std::uint32_t> part = connected_parts(hull);
  std::vector<std::int32_t> box_of(part.size(), -1);
  std::vector<Box> boxes;
  for (const std::uint32_t v : hull.triangles) {
    std::int32_t& box = box_of[part[v]];
    if (box < 0) {
      box = static_cast<std::int32_t>(boxes.size());
      boxes.push_back({Vec3f(1e30f), Vec3f(-1e30f)});
    }
    const Vec3f p = frame.from_world(hull.origin + Vec3(hull.vertices[v]));
    Box& grown = boxes[static_cast<std::size_t>(box)];
    grown.low = glm::min(grown.low, p);
    grown.high = glm::max(grown.high, p);
  }
  for (std::size_t i = 0; i < boxes.size();) {
    std::size_t other = i + 1;
    while (other < boxes.size() && !near(boxes[i], boxes[other], margin)) ++other;
    if (other == boxes.size()) {
      ++i;
      continue;
    }
    boxes[i].low = glm::min(boxes[i].low, boxes[other].low);
    boxes[i].high = glm::max(boxes[i].high, boxes[other].high);
    boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(other));
    i = 0;  // the grown box may be near an earlier one
  }
  return boxes;
}

Box bounds_of(const Hull& hull, const LocalFrame& frame) {
  Vec3 low(-1e9), high(1e9);
  for (const HullFace& face : hull.faces) {
    if (face.view >= 0 || face.edge > 5 || face.triangle_count == 0) continue;
    const int axis = static_cast<int>(face.edge / 2);
    const std::uint32_t vertex = hull.triangles[3 * std::size_t{face.first_triangle}];
    const double at = hull.origin[axis] + hull.vertices[vertex][axis];
    (face.edge % 2 == 0 ? low : high)[axis] = (at - frame.origin[axis]) * frame.cells;
  }
  const int x = frame.x_axis, y = (x + 1) % 3, z = (x + 2) % 3;
  return {Vec3f(low[x], low[y], low[z]), Vec3f(high[x], high[y], high[z])};
}

}  // namespace polyhull::refine
