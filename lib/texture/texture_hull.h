// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a hull and its cameras to a Texturing.
///
/// For triangle f with unit normal n_f, view k with centre C_k and a point p of f:
///   cos_fk(p)  = n_f . (C_k - p) / |C_k - p|                     the camera-normal angle's cosine
///   seen_fk    = share of f's area that is front-facing and has nothing of the hull on the segment
///                from p to C_k, from depth maps (visibility.h)
///   visible_f  = { k : seen_fk >= 1/2 },  best_f = argmax over visible_f of cos_fk(centroid)
///   weight_vk  = max(0, n_v . (C_k - v)/|C_k - v|) * sum(a_f seen_fk) / sum(a_f), over the
///                triangles f of area a_f around vertex v that face k; for the metrics
///                viewing_angle and lumigraph, which need the viewport, without the first factor
/// A face of camera k's own cone passes through C_k: cos_fk is 0 there, and it is never visible in
/// k.
///
/// Vertices of a visual hull lie on silhouettes by their nature, so a fade towards silhouette edges
/// cannot live at the vertices: a front made of strips between two silhouette vertices would fade
/// everywhere. It lives in each view's picture instead (OcclusionMap) and is looked up per
/// fragment.
///
/// After the direct and blending methods of the prototype (thesis, chapter 4); continuous weights
/// that fade towards occlusion boundaries after Buehler et al., Unstructured Lumigraph Rendering,
/// 2001.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/texturing.h"

namespace polyhull {

/// How hulls are textured; see Texturing.
struct TextureSettings {
  TextureMethod method = TextureMethod::blend;
  TextureMetric metric = TextureMetric::lumigraph;
  std::uint32_t cameras = 2;
  Vec3f untextured{128.0f / 255.0f};        ///< sRGB, 0..1
  TextureFill fill = TextureFill::inpaint;  ///< for FillColours, which has the pictures
  bool balance = false;                     ///< Texturing::gains from the pictures: ColourBalance
  double balance_time = 4.0;                ///< of it, seconds
  TextureAlign align = TextureAlign::off;   ///< for PictureAligner, which has the pictures
  bool memory = false;        ///< what was seen earlier fills what is not seen now: ColourMemory
  double memory_time = 60.0;  ///< of it: what was not seen for so many seconds counts half
  /// Off: every view sees every triangle that faces it, as in the prototype.
  bool occlusion = true;
  int map_size = 320;        ///< texels of the longer side of an OcclusionMap
  double fade_width = 12.0;  ///< pixels of the camera over which the fade rises from 0 to 1
  int threads = 0;           ///< of the pool; 0: all
  bool operator==(const TextureSettings&) const = default;
};

/// Counts and times (seconds) of one call, for `stats`.
struct TextureStatistics {
  std::uint64_t pieces = 0;   ///< of triangles that face a view, summed over the views
  std::uint64_t sampled = 0;  ///< of these: those that the edge of something before them may cross
  bool reused = false;        ///< nothing had changed
  double seconds_visibility = 0;  ///< with the maps
  double seconds_weights = 0;
};

/// Textures hulls one after the other and keeps the memory. Not for use by two threads at once.
class HullTexturer {
 public:
  HullTexturer();
  ~HullTexturer();
  HullTexturer(HullTexturer&&) noexcept;
  HullTexturer& operator=(HullTexturer&&) noexcept;

  /// \p cameras are the hull's views, at most 64 (HullFace::view indexes them). An empty hull gives
  /// an empty texturing. Throws Error for more than 64 cameras, for triangle indices that are no
  /// multiple of three or beyond the vertices, and for vertices that are not finite.
  /// The result is valid until the next call; the same hull, cameras and settings as in the last
  /// call give the last result at once.
  const Texturing& texture(const Hull& hull, std::span<const Camera> cameras,
                           const TextureSettings& settings);

  const TextureStatistics& statistics() const { return statistics_; }

 private:
  struct State;
  std::unique_ptr<State> state_;
  TextureStatistics statistics_;
};

/// HullTexturer for one hull. Throws Error as it does.
Texturing texture_hull(const Hull& hull, std::span<const Camera> cameras,
                       const TextureSettings& settings = {});

}  // namespace polyhull
