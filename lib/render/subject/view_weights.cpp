// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject/view_weights.h"

#include <algorithm>
#include <cmath>

#include "render/subject/hull_vertices.h"

namespace polyhull {
namespace {

/// What does not depend on the view.
struct Gaze {
  Vec3f to_eye{0.0f};   ///< unit length
  float needed = 0.0f;  ///< the viewport's pixels to a length on the surface
};

/// One camera, relative to the mesh's origin.
struct Look {
  Vec3f centre, forward;
  float focal;
};

float by_viewing_angle(const Vec3f& to_camera, const Gaze& gaze) {
  // Never 0 for a view that sees the point: it may be the only one.
  const float near = 0.5f + 0.5f * glm::dot(to_camera, gaze.to_eye);
  return std::max(near * near * near * near, 1e-3f);
}

/// By the angle and by the resolution, which is also set as \p resolution.
float by_lumigraph(const Look& look, const Vec3f& p, const Vec3f& normal, const Vec3f& to_camera,
                   const Gaze& gaze, float& resolution) {
  constexpr float half = 0.0669873f;  // the square of sin 15 degrees
  const float square = (0.5f - 0.5f * glm::dot(to_camera, gaze.to_eye)) / half;
  const float angle = 1.0f / (1.0f + square * square);
  const float depth = glm::dot(look.forward, p - look.centre);
  const float facing = std::max(glm::dot(normal, to_camera), 0.0f);
  const float has = look.focal * facing;
  const float needed = gaze.needed * std::max(depth, 0.0f);
  resolution = has < needed ? has / needed : 1.0f;
  return angle * resolution;
}

}  // namespace

ViewWeights::ViewWeights(const Mesh& mesh, const MeshEye& eye) : views_(mesh.views.size()) {
  const Texturing& texturing = *mesh.texturing;
  const std::vector<Vec3f>& vertices = mesh.hull.vertices;
  weights_.assign(vertices.size() * views_, 0.0f);
  std::vector<Gaze> gazes;
  if (texturing.metric != TextureMetric::camera_normal) {
    gazes.resize(vertices.size());
    const Vec3f from(eye.place - mesh.hull.origin);
    const auto pixel_size = static_cast<float>(eye.pixel_size);
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const Vec3f way = from - vertices[v];
      const float distance = glm::length(way);
      gazes[v].to_eye = way / distance;
      const float obliquity = std::max(glm::dot(texturing.normals[v], gazes[v].to_eye), 0.1f);
      gazes[v].needed = obliquity / (distance * pixel_size);
    }
  }
  const bool lumigraph = texturing.metric == TextureMetric::lumigraph;
  std::vector<float> finest(lumigraph ? vertices.size() : 0);  // by vertex: the largest resolution
  for (std::size_t k = 0; k < views_; ++k) {
    if (!can_colour(mesh.views[k].view)) continue;
    const Camera& camera = mesh.views[k].calibration;
    const Look look{Vec3f(camera.centre() - mesh.hull.origin),
                    Vec3f(glm::transpose(camera.R) * Vec3(0, 0, 1)),
                    static_cast<float>(std::abs(camera.K[0][0]))};
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      float weight = texturing.weights[v * views_ + k];
      if (texturing.metric == TextureMetric::camera_normal) {
        weight *= weight;  // the better view prevails, with less of a ghost from the other
      } else if (weight > 0.0f) {
        const Vec3f to_camera = glm::normalize(look.centre - vertices[v]);
        float resolution = 1.0f;
        weight *= lumigraph ? by_lumigraph(look, vertices[v], texturing.normals[v], to_camera,
                                           gazes[v], resolution)
                            : by_viewing_angle(to_camera, gazes[v]);
        if (lumigraph) finest[v] = std::max(finest[v], resolution);
      }
      weights_[v * views_ + k] = weight;
    }
  }
  for (std::size_t v = 0; v < finest.size(); ++v)
    if (finest[v] > 0.0f && finest[v] < 1.0f)
      for (std::size_t k = 0; k < views_; ++k) weights_[v * views_ + k] /= finest[v];
}

}  // namespace polyhull
