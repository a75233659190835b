// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/surface/assemble.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace polyhull::hull {
namespace {

constexpr std::uint32_t empty_slot = 0xffffffffu;

std::uint64_t hash(const CornerKey& key) {
  std::uint64_t h = key[0] * 0x9e3779b97f4a7c15u;
  h = (h ^ (h >> 32) ^ key[1]) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 32) ^ key[2]) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

struct RealPlane {
  Vec3 normal;
  double offset;  ///< against the middle
};

RealPlane real_plane(const ClippingProblem& problem, std::uint32_t plane, const Vec3& middle) {
  if (plane < problem.cone_faces()) {
    const std::size_t cone = static_cast<std::size_t>(problem.set.group[plane]);
    const Cone& c = *problem.cones[cone];
    const Vec3 n = c.normals[plane - problem.first_face[cone]];
    return {n, glm::dot(n, c.centre_real - middle)};
  }
  const int k = static_cast<int>(plane - problem.cone_faces());
  Vec3 n(0.0);
  n[k / 2] = 1.0;
  return {n, problem.box[k] - middle[k / 2]};
}

}  // namespace

Vec3 Assembler::place(const ClippingProblem& problem, const CornerKey& key) {
  if (key[2] == apex_mark) return problem.cones[key[0]]->centre_real;
  const Vec3 middle = 0.5 * (problem.low + problem.high);
  if (key[2] < problem.cone_faces() + 6) {
    const RealPlane p = real_plane(problem, key[0], middle),
                    q = real_plane(problem, key[1], middle),
                    r = real_plane(problem, key[2], middle);
    const Vec3 pq = glm::cross(p.normal, q.normal);
    const double d = glm::dot(pq, r.normal);
    if (std::abs(d) > 1e-5) {
      const Vec3 x = p.offset * glm::cross(q.normal, r.normal) +
                     q.offset * glm::cross(r.normal, p.normal) + r.offset * pq;
      return middle + x / d;
    }
  }
  return problem.set.point(key[0], key[1], key[2]);
}

void Assembler::grow() {
  table_.assign(std::max<std::size_t>(1024, std::bit_ceil(keys_.size() * 4)), empty_slot);
  for (std::uint32_t i = 0; i < keys_.size(); ++i) {
    std::size_t slot = hash(keys_[i]) & (table_.size() - 1);
    while (table_[slot] != empty_slot) slot = (slot + 1) & (table_.size() - 1);
    table_[slot] = i;
  }
}

std::uint32_t Assembler::number(const CornerKey& key) {
  if (keys_.size() * 2 >= table_.size()) grow();
  std::size_t slot = hash(key) & (table_.size() - 1);
  while (table_[slot] != empty_slot) {
    if (same(keys_[table_[slot]], key)) return table_[slot];
    slot = (slot + 1) & (table_.size() - 1);
  }
  table_[slot] = static_cast<std::uint32_t>(keys_.size());
  keys_.push_back(key);
  return table_[slot];
}

void Assembler::assemble(const ClippingProblem& problem, const Lattice& lattice,
                         std::span<const FaceLoops> pieces, Hull& hull,
                         std::vector<Vec3>& normals) {
  keys_.clear();
  normals.clear();
  std::fill(table_.begin(), table_.end(), empty_slot);
  std::uint32_t cone = 0;
  for (const FaceLoops& piece : pieces) {
    const std::uint32_t corner_base = static_cast<std::uint32_t>(hull.loop_vertices.size());
    const std::uint32_t loop_base = static_cast<std::uint32_t>(hull.loop_ends.size());
    for (const CornerKey& key : piece.corners) hull.loop_vertices.push_back(number(key));
    for (std::uint32_t end : piece.loop_ends) hull.loop_ends.push_back(corner_base + end);
    for (std::uint32_t end : piece.face_ends) hull.face_loop_ends.push_back(loop_base + end);
    for (std::uint32_t f : piece.faces) {
      HullFace face;
      if (f >= problem.cone_faces()) {
        const int k = static_cast<int>(f - problem.cone_faces());
        face.edge = static_cast<std::uint32_t>(k);
        Vec3 out(0.0);
        out[k / 2] = k % 2 == 0 ? -1.0 : 1.0;
        normals.push_back(out);
      } else {
        while (f >= problem.first_face[cone + 1]) ++cone;
        const Cone& c = *problem.cones[cone];
        face.view = c.source_view[f - problem.first_face[cone]];
        face.edge = c.source[f - problem.first_face[cone]];
        normals.push_back(-c.normals[f - problem.first_face[cone]]);
      }
      hull.faces.push_back(face);
    }
  }
  places_.resize(keys_.size());
  Vec3 low(1e300), high(-1e300);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    places_[i] = place(problem, keys_[i]);
    low = glm::min(low, places_[i]);
    high = glm::max(high, places_[i]);
  }
  hull.vertices.resize(keys_.size());
  if (keys_.empty()) return;
  const Vec3 middle = 0.5 * (low + high);
  const double inverse = 1.0 / lattice.scale;
  hull.origin = lattice.origin + middle * inverse;
  for (std::size_t i = 0; i < keys_.size(); ++i)
    hull.vertices[i] = Vec3f((places_[i] - middle) * inverse);
}

}  // namespace polyhull::hull
