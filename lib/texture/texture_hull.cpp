// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/texture_hull.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "texture/texture_loops.h"
#include "texture/visibility.h"

namespace polyhull {
namespace {

void check(const Hull& hull, std::span<const Camera> cameras) {
  if (cameras.size() > 64) {
    throw Error(Error::Kind::unsupported, "A mesh has {} views; texturing handles at most 64.",
                cameras.size());
  }
  if (hull.triangles.size() % 3 != 0) {
    throw Error(Error::Kind::bad_input,
                "A mesh has {} triangle corners, which is not a multiple of three.",
                hull.triangles.size());
  }
  for (const std::uint32_t index : hull.triangles) {
    if (index >= hull.vertices.size()) {
      throw Error(Error::Kind::bad_input, "A mesh has vertex index {} but only {} vertices.", index,
                  hull.vertices.size());
    }
  }
  for (const Vec3f& v : hull.vertices)
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw Error(Error::Kind::bad_input, "A mesh has a vertex that is not finite.");
}

/// The surface's own, or the sum of those of the triangles around.
std::vector<Vec3f> vertex_normals(const Hull& hull, const MeshFaces& faces) {
  if (hull.normals.size() == hull.vertices.size()) return hull.normals;
  std::vector<Vec3f> sums(hull.vertices.size(), Vec3f(0.0f));
  for (std::size_t f = 0; f < faces.area.size(); ++f) {
    const Vec3f normal = faces.area[f] * Vec3f(faces.nx[f], faces.ny[f], faces.nz[f]);
    for (int i = 0; i < 3; ++i) sums[hull.triangles[3 * f + i]] += normal;
  }
  for (Vec3f& normal : sums) {
    const float length = glm::length(normal);
    normal = length > 0.0f ? normal / length : Vec3f(0.0f, 1.0f, 0.0f);
  }
  return sums;
}

/// The views of a few triangles: Texturing's visible and best of begin .. end.
void choose(const std::vector<Sight>& sights, std::size_t begin, std::size_t end, Texturing& out) {
  std::vector<float> highest(end - begin, 0.0f);
  for (std::size_t k = 0; k < sights.size(); ++k) {
    const float* share = sights[k].share.data();
    const float* cosine = sights[k].cosine.data();
    for (std::size_t f = begin; f < end; ++f) {
      const bool visible = share[f] >= 0.5f;
      out.visible[f] |= static_cast<std::uint64_t>(visible) << k;
      const bool better = visible && cosine[f] > highest[f - begin];
      highest[f - begin] = better ? cosine[f] : highest[f - begin];
      out.best[f] = better ? static_cast<std::int8_t>(k) : out.best[f];
    }
  }
}

/// Texturing's weights of the vertices begin .. end.
void weigh(const Hull& hull, std::span<const Camera> cameras, const std::vector<Sight>& sights,
           std::size_t begin, std::size_t end, Texturing& out) {
  const std::size_t views = sights.size();
  const bool by_normal = out.metric == TextureMetric::camera_normal;
  std::vector<float> weights(end - begin);
  for (std::size_t k = 0; k < views; ++k) {
    const Vec3f eye(cameras[k].centre() - hull.origin);
    TextureLoops::best().weigh({end - begin, &hull.vertices[begin].x},
                               by_normal ? &out.normals[begin].x : nullptr, &eye.x,
                               &sights[k].sums[2 * begin], weights.data());
    for (std::size_t v = begin; v < end; ++v) out.weights[v * views + k] = weights[v - begin];
  }
}

bool same_triangles(const HullFace& a, const HullFace& b) {
  return a.view == b.view && a.first_triangle == b.first_triangle &&
         a.triangle_count == b.triangle_count;
}

}  // namespace

struct HullTexturer::State {
  // What the last result was made of.
  Hull hull;
  std::vector<Camera> cameras;
  TextureSettings settings;
  Texturing texturing;
  bool made = false;
  // Memory that stays.
  std::vector<Sight> sights;
  std::mutex mutex;
  std::vector<std::unique_ptr<Seer>> seers;  // that nobody uses

  bool same(const Hull& mesh, std::span<const Camera> views, const TextureSettings& wanted) const;
  void keep(const Hull& mesh, std::span<const Camera> views, const TextureSettings& wanted);
  void look(const Hull& mesh, const MeshFaces& faces, std::span<const Camera> views,
            const TextureSettings& wanted);
};

bool HullTexturer::State::same(const Hull& mesh, std::span<const Camera> views,
                               const TextureSettings& wanted) const {
  return made && wanted == settings && mesh.origin == hull.origin &&
         mesh.vertices == hull.vertices && mesh.normals == hull.normals &&
         mesh.triangles == hull.triangles &&
         std::equal(mesh.faces.begin(), mesh.faces.end(), hull.faces.begin(), hull.faces.end(),
                    same_triangles) &&
         std::equal(views.begin(), views.end(), cameras.begin(), cameras.end());
}

void HullTexturer::State::keep(const Hull& mesh, std::span<const Camera> views,
                               const TextureSettings& wanted) {
  hull.origin = mesh.origin;
  hull.vertices = mesh.vertices;
  hull.normals = mesh.normals;
  hull.triangles = mesh.triangles;
  hull.faces = mesh.faces;
  cameras.assign(views.begin(), views.end());
  settings = wanted;
  made = true;
}

/// Each view's sight, views side by side.
void HullTexturer::State::look(const Hull& mesh, const MeshFaces& faces,
                               std::span<const Camera> views, const TextureSettings& wanted) {
  const SightSettings how{wanted.occlusion, wanted.method == TextureMethod::blend, wanted.map_size,
                          wanted.fade_width};
  sights.resize(views.size());
  parallel_for(views.size(), 1, wanted.threads, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<Seer> seer;
    {
      const std::lock_guard lock(mutex);
      if (!seers.empty()) {
        seer = std::move(seers.back());
        seers.pop_back();
      }
    }
    if (!seer) seer = std::make_unique<Seer>();
    for (std::size_t k = begin; k < end; ++k)
      seer->look(mesh, faces, views[k], static_cast<int>(k), how, sights[k]);
    const std::lock_guard lock(mutex);
    seers.push_back(std::move(seer));
  });
}

HullTexturer::HullTexturer() : state_(std::make_unique<State>()) {}
HullTexturer::~HullTexturer() = default;
HullTexturer::HullTexturer(HullTexturer&&) noexcept = default;
HullTexturer& HullTexturer::operator=(HullTexturer&&) noexcept = default;

const Texturing& HullTexturer::texture(const Hull& hull, std::span<const Camera> cameras,
                                       const TextureSettings& settings) {
  State& state = *state_;
  statistics_ = {};
  statistics_.reused = state.same(hull, cameras, settings);
  if (statistics_.reused) return state.texturing;
  state.made = false;
  check(hull, cameras);
  Texturing& out = state.texturing;
  out = {};
  out.method = settings.method;
  out.metric = settings.metric;
  out.cameras = std::max<std::uint32_t>(settings.cameras, 1);
  out.untextured = settings.untextured;
  if (!hull.empty()) {
    Stopwatch watch;
    const MeshFaces faces = find_faces(hull, settings.threads);
    state.look(hull, faces, cameras, settings);
    statistics_.seconds_visibility = watch.lap();
    const std::size_t count = faces.area.size();
    out.visible.assign(count, 0);
    out.best.assign(count, -1);
    out.weights.resize(hull.vertices.size() * cameras.size());
    out.normals = vertex_normals(hull, faces);
    parallel_for(count, 2048, settings.threads, [&](std::size_t begin, std::size_t end) {
      choose(state.sights, begin, end, out);
    });
    parallel_for(hull.vertices.size(), 2048, settings.threads,
                 [&](std::size_t begin, std::size_t end) {
                   weigh(hull, cameras, state.sights, begin, end, out);
                 });
    statistics_.seconds_weights = watch.lap();
    for (Sight& sight : state.sights) {
      statistics_.pieces += sight.pieces;
      statistics_.sampled += sight.sampled;
      if (settings.occlusion && settings.method == TextureMethod::blend)
        out.maps.push_back(std::move(sight.map));
    }
  }
  state.keep(hull, cameras, settings);
  return out;
}

Texturing texture_hull(const Hull& hull, std::span<const Camera> cameras,
                       const TextureSettings& settings) {
  return HullTexturer().texture(hull, cameras, settings);
}

}  // namespace polyhull
