// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/subject.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "studio/figure/figure.h"
#include "studio/figure/file_subject.h"
#include "studio/figure/hairy_figure.h"

namespace polyhull {
namespace {

std::shared_ptr<const Figure> stored_figure() {
  std::shared_ptr<const Figure> figure;
  float pixel = 0.0f;
  for (std::size_t i = coarser_skins.size() + 1; i-- > 0;) {
    figure = std::make_shared<const Figure>(stored_figure_skin(i), figure, pixel);
    if (i > 0) pixel = coarser_skins[i - 1].pixel;
  }
  return figure;
}

std::vector<std::uint32_t> find_neighbours(const std::vector<std::uint32_t>& triangles,
                                           std::size_t vertex_count) {
  const auto next = [](std::size_t side) { return side % 3 == 2 ? side - 2 : side + 1; };
  // The sides that begin at each vertex.
  std::vector<std::uint32_t> ends(vertex_count + 1, 0), sides(triangles.size());
  for (const std::uint32_t v : triangles) ++ends[v];
  for (std::size_t v = 0; v < vertex_count; ++v) ends[v + 1] += ends[v];
  for (std::size_t s = 0; s < triangles.size(); ++s)
    sides[--ends[triangles[s]]] = static_cast<std::uint32_t>(s);
  std::vector<std::uint32_t> neighbours(triangles.size());
  for (std::size_t s = 0; s < triangles.size(); ++s) {
    const std::uint32_t from = triangles[s], to = triangles[next(s)];
    neighbours[s] = static_cast<std::uint32_t>(s / 3);
    for (std::uint32_t i = ends[to]; i < ends[to + 1]; ++i)
      if (triangles[next(sides[i])] == from) neighbours[s] = sides[i] / 3;
  }
  return neighbours;
}

}  // namespace

const std::vector<std::uint32_t>& Subject::neighbours() const {
  std::call_once(neighbours_found_,
                 [&] { neighbours_ = find_neighbours(triangles_, vertex_count_); });
  return neighbours_;
}

std::shared_ptr<const Subject> Subject::coarser(float pixel) const {
  if (!coarser_ || pixel < coarser_pixel_) return nullptr;
  const std::shared_ptr<const Subject> still_coarser = coarser_->coarser(pixel);
  return still_coarser ? still_coarser : coarser_;
}

std::shared_ptr<const Subject> open_subject(const std::string& name, double height) {
  if (!name.empty() && name != "figure" && name != "hairy") return load_subject(name, height);
  static const std::shared_ptr<const Figure> figure = stored_figure();
  if (name != "hairy") return figure;
  static const std::shared_ptr<const Subject> hairy = std::make_shared<const HairyFigure>(figure);
  return hairy;
}

Vec3f outgoing_colour(const Subject& subject, const SubjectFrame& frame, std::uint32_t triangle,
                      const Vec3f& at, float width) {
  const std::uint32_t* v = &subject.triangles()[3 * static_cast<std::size_t>(triangle)];
  const Vec3f n = glm::normalize(frame.normals[v[0]] * at.x + frame.normals[v[1]] * at.y +
                                 frame.normals[v[2]] * at.z);
  const Vec3f linear = subject.albedo(triangle, at, width) * studio_light(n);
  return {srgb_from_linear(linear.x), srgb_from_linear(linear.y), srgb_from_linear(linear.z)};
}

Placement placement_for(const Rig& rig) {
  Placement placement;
  const Vec3 up = glm::normalize(rig.up);
  // The shortest turn from +y to the rig's up.
  const Vec3 axis = glm::cross(Vec3(0, 1, 0), up);
  const double c = up.y;
  Mat3 turn(1.0);
  if (c < -1.0 + 1e-12) {
    turn = Mat3(Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, -1));
  } else if (glm::length(axis) > 1e-12) {
    const Mat3 k(Vec3(0, axis.z, -axis.y), Vec3(-axis.z, 0, axis.x), Vec3(axis.y, -axis.x, 0));
    turn = Mat3(1.0) + k + k * k * (1.0 / (1.0 + c));
  }
  placement.linear = turn * (1.0 / rig.metres_per_unit());
  if (rig.bounds) {
    const Bounds& b = *rig.bounds;
    const bool holds = glm::all(glm::lessThanEqual(b.min, Vec3(0.0))) &&
                       glm::all(glm::greaterThanEqual(b.max, Vec3(0.0)));
    if (!holds) {
      const Vec3 middle = 0.5 * (b.min + b.max), half = 0.5 * (b.max - b.min);
      placement.origin = middle - up * glm::dot(glm::abs(up), half);
    }
  }
  return placement;
}

TruthMesh truth_mesh(const Subject& subject, const Rig& rig, double seconds) {
  SubjectFrame frame;
  subject.pose(seconds, frame);
  const Placement place = placement_for(rig);
  const Mat3 turn = place.linear * rig.metres_per_unit();
  TruthMesh mesh;
  mesh.triangles = subject.triangles();
  const std::size_t count = frame.positions.size();
  mesh.positions.resize(count);
  mesh.normals.resize(count);
  mesh.colours.assign(count, Vec3f(0.5f));
  for (std::size_t i = 0; i < count; ++i) {
    mesh.positions[i] = Vec3f(place(Vec3(frame.positions[i])));
    mesh.normals[i] = Vec3f(turn * Vec3(frame.normals[i]));
  }
  std::vector<bool> done(count, false);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh.triangles[t + k];
      if (done[v]) continue;
      done[v] = true;
      Vec3f at(0.0f);
      at[k] = 1.0f;
      const float edge =
          glm::distance(frame.positions[v], frame.positions[mesh.triangles[t + (k + 1) % 3]]);
      mesh.colours[v] =
          outgoing_colour(subject, frame, static_cast<std::uint32_t>(t / 3), at, edge);
    }
  }
  return mesh;
}

}  // namespace polyhull
