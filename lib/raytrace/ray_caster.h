// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rays against triangle meshes: a small owner of an Embree 3 scene.
///
/// A ray is origin + s * direction with s in [near, far]; s is in units of the direction's length,
/// so with Camera::ray() as direction s is the depth along the camera's z axis. All threads may ask
/// at once; adding, moving, removing and commit() need the object to themselves.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "base/vector.h"

namespace polyhull {

/// A stretch of a straight line.
struct Ray {
  Vec3f origin{0.0f};
  float near = 0.0f;
  Vec3f direction{0.0f, 0.0f, 1.0f};  ///< need not be normalised
  float far = std::numeric_limits<float>::infinity();
};

/// The nearest intersection of a ray.
struct RayHit {
  static constexpr std::uint32_t none = 0xffffffffu;
  float distance = std::numeric_limits<float>::infinity();  ///< s of the ray
  std::uint32_t mesh = none;                                ///< as returned by add_mesh()
  std::uint32_t triangle = none;                            ///< index of the triangle in that mesh
  float u = 0.0f;  ///< the point is (1 - u - v) p0 + u p1 + v p2
  float v = 0.0f;
  Vec3f normal{0.0f};  ///< cross(p1 - p0, p2 - p0) up to a positive factor, not normalised
  bool hit() const { return mesh != none; }
};

class RayCaster {
 public:
  /// What pays: rays that are traced fast, or a tree that is built fast, for meshes that live for a
  /// frame.
  enum class For { many_rays, one_frame };

  /// Throws Error (unsupported) when Embree cannot start on this machine.
  explicit RayCaster(For use = For::many_rays);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// Adds a mesh (the data are copied) and returns its number; numbers of removed meshes are used
  /// again. Throws Error for indices beyond the positions, and (unsupported) for lack of memory.
  std::uint32_t add_mesh(std::span<const Vec3f> positions,
                         std::span<const std::uint32_t> triangles);

  /// Gives the mesh new positions. Throws Error where they are not as many as it had.
  void move_mesh(std::uint32_t mesh, std::span<const Vec3f> positions);

  /// Takes the mesh out; its number is free.
  void remove_mesh(std::uint32_t mesh);

  /// Builds what changed; needed before the next ray. Throws Error (unsupported) where Embree
  /// cannot.
  void commit();

  /// The nearest intersection; RayHit::hit() is false where there is none.
  RayHit intersect(const Ray& ray) const;

  /// Whether anything lies on the ray between near and far.
  bool occluded(const Ray& ray) const;

  /// Many rays at once, in packets of eight in the order given: faster where neighbours in the list
  /// go similar ways. hits (occluded: one byte per ray, 0 or 1) has as many places as rays.
  /// \p coherent tells Embree that they do (camera rays, rays to one light).
  void intersect(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent = true) const;
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked,
                bool coherent = true) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
