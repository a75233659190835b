// SPDX-License-Identifier: LGPL-2.1-or-later
// The part of Simplifier that reads how the mesh hangs together and writes it anew.
#include <algorithm>
#include <utility>

#include "hull/surface/simplify.h"

namespace polyhull::hull {

void Simplifier::connect() {
  const auto& t = hull_->triangles;
  const std::uint32_t half_edges = static_cast<std::uint32_t>(t.size());
  opposite_.assign(half_edges, none);
  leaving_.assign(hull_->vertices.size(), none);
  edges_ = {hull_->triangles, opposite_, leaving_};
  // Half-edges by their lower vertex, then matched within each small list.
  std::vector<std::uint32_t> start(hull_->vertices.size() + 1, 0), list(half_edges);
  const auto lower = [&](std::uint32_t h) { return std::min(t[h], t[following(h)]); };
  for (std::uint32_t h = 0; h < half_edges; ++h) ++start[lower(h) + 1];
  for (std::size_t v = 0; v + 1 < start.size(); ++v) start[v + 1] += start[v];
  std::vector<std::uint32_t> at(start.begin(), start.end() - 1);
  for (std::uint32_t h = 0; h < half_edges; ++h) {
    list[at[lower(h)]++] = h;
    leaving_[t[h]] = h;
  }
  for (std::size_t v = 0; v + 1 < start.size(); ++v)
    for (std::uint32_t i = start[v]; i < start[v + 1]; ++i)
      for (std::uint32_t k = i + 1; k < start[v + 1]; ++k)
        if (t[list[i]] == t[following(list[k])] && t[following(list[i])] == t[list[k]])
          edges_.link(list[i], list[k]);
  face_of_.resize(half_edges / 3);
  for (std::uint32_t f = 0; f < hull_->faces.size(); ++f) {
    const HullFace& face = hull_->faces[f];
    for (std::uint32_t k = 0; k < face.triangle_count; ++k) face_of_[face.first_triangle + k] = f;
  }
  moved_.assign(hull_->vertices.size(), 0.0);
  dead_.assign(half_edges / 3, 0);
}

/// Whether each half-edge has its partner and each vertex one fan. Without that walks around a
/// vertex need not end.
bool Simplifier::manifold() const {
  std::vector<std::uint32_t> leaving(hull_->vertices.size(), 0);
  for (std::size_t h = 0; h < opposite_.size(); ++h) {
    if (opposite_[h] == none || opposite_[opposite_[h]] != h) return false;
    ++leaving[hull_->triangles[h]];
  }
  for (std::size_t v = 0; v < leaving.size(); ++v) {
    if (leaving[v] == 0) continue;
    std::uint32_t h = leaving_[v];
    do {
      if (leaving[v]-- == 0) return false;
      h = edges_.turn(h);
    } while (h != leaving_[v]);
    if (leaving[v] != 0) return false;
  }
  return true;
}

/// Vertices without the unused, triangles by face, and loops from where faces meet.
void Simplifier::rebuild() {
  Hull& hull = *hull_;
  const std::uint32_t triangles = static_cast<std::uint32_t>(face_of_.size());
  std::vector<std::vector<std::uint32_t>> of_face(hull.faces.size());
  for (std::uint32_t t = 0; t < triangles; ++t)
    if (!dead_[t]) of_face[face_of_[t]].push_back(t);
  std::vector<char> used(hull.vertices.size(), 0);
  for (std::uint32_t t = 0; t < triangles; ++t)
    if (!dead_[t])
      for (int k = 0; k < 3; ++k) used[hull.triangles[3 * t + k]] = 1;
  std::vector<std::uint32_t> number(hull.vertices.size(), none);
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < number.size(); ++v)
    if (used[v]) {
      hull.vertices[kept] = hull.vertices[v];
      number[v] = kept++;
    }
  hull.vertices.resize(kept);
  std::vector<std::uint32_t> out;
  std::vector<HullFace> faces;
  hull.loop_vertices.clear(), hull.loop_ends.clear(), hull.face_loop_ends.clear();
  std::vector<char> seen(hull.triangles.size(), 0);
  for (std::uint32_t f = 0; f < of_face.size(); ++f) {
    if (of_face[f].empty()) continue;
    HullFace face = hull.faces[f];
    face.first_triangle = static_cast<std::uint32_t>(out.size() / 3);
    face.triangle_count = static_cast<std::uint32_t>(of_face[f].size());
    for (std::uint32_t t : of_face[f])
      for (int k = 0; k < 3; ++k) out.push_back(number[hull.triangles[3 * t + k]]);
    const auto border = [&](std::uint32_t h) { return face_of_[opposite_[h] / 3] != f; };
    for (std::uint32_t t : of_face[f])
      for (std::uint32_t first = 3 * t; first < 3 * t + 3; ++first) {
        if (seen[first] || !border(first)) continue;
        for (std::uint32_t h = first; !seen[h];) {
          seen[h] = 1;
          hull.loop_vertices.push_back(number[hull.triangles[h]]);
          h = following(h);
          while (!border(h)) h = following(opposite_[h]);
        }
        hull.loop_ends.push_back(static_cast<std::uint32_t>(hull.loop_vertices.size()));
      }
    hull.face_loop_ends.push_back(static_cast<std::uint32_t>(hull.loop_ends.size()));
    faces.push_back(face);
  }
  hull.triangles = std::move(out);
  hull.faces = std::move(faces);
}

}  // namespace polyhull::hull
