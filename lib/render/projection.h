// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Clip-space matrices, placing, and the rectangles of the screen that things can touch.
///
/// Row 0 of a picture is row 0 of the framebuffer, so clip y points down on screen as pixels do:
///   clip = (2 (u + 1/2) / w - 1, 2 (v + 1/2) / h - 1, ...) * z   for the pinhole pixel (u, v).
/// Outside-counter-clockwise triangles are therefore clockwise in the framebuffer.
#pragma once

#include <span>
#include <vector>

#include "base/vector.h"
#include "mesh/mesh.h"
#include "rig/camera.h"
#include "scene/reflection.h"

namespace polyhull {

/// World to camera coordinates, homogeneous.
Mat4 view_matrix(const Camera& camera);

/// Camera coordinates to clip space for depths \p near to \p far.
Mat4 clip_from_camera(const Camera& camera, double near, double far);

/// \p camera for a picture of another size, the same field of view.
Camera resized(const Camera& camera, int width, int height);

/// The rays through a pinhole camera's pixels, in scene directions with depth 1.
struct PixelRays {
  Vec3f x{0.0f}, y{0.0f}, origin{0.0f};
  PixelRays() = default;
  explicit PixelRays(const Camera& camera);
  Vec3f at(int column, int row) const {
    return static_cast<float>(column) * x + static_cast<float>(row) * y + origin;
  }
};

/// The rays' images in a mirror of the unit normal \p normal.
PixelRays reflected(const PixelRays& rays, const Vec3f& normal);

/// About which point a subject is turned and scaled. Only with one that does not move with the
/// subject do its feet stay on the floor whatever it does, and does a turn turn its walk, too.
enum class Pivot {
  rig_origin,  ///< the origin of the rig's world, most often the middle of the studio's floor
  box,         ///< the centre of the hull's bounding box in the scene's axes
  centroid,    ///< the centre of gravity of the hull's volume
  point,       ///< SubjectPlacement::pivot_point
};

/// How a subject is placed: moved by `translate` metres, turned by `rotate` degrees about x, then
/// y, then z, and scaled, about its pivot.
struct SubjectPlacement {
  Vec3 translate{0.0};
  Vec3 rotate{0.0};
  double scale = 1.0;
  Pivot pivot = Pivot::rig_origin;
  Vec3 pivot_point{0.0};  ///< scene metres, as the subject stands before it is placed
  bool operator==(const SubjectPlacement&) const = default;
};

/// From the mesh's world coordinates (its own up and unit) to scene metres with y up.
Mat4 place_in_scene(const Mesh& mesh, const SubjectPlacement& placement);

/// The pixels that the convex hull of \p points can touch, with a margin of one pixel, cut to the
/// picture. Points behind the eye are handled: the part of the hull in front of it counts.
Rectangle screen_rectangle(std::span<const Vec3> points, const Mat4& clip_from_scene, int width,
                           int height);

/// The pixels that a mesh touches: as above but from its vertices one by one, the whole picture as
/// soon as it reaches behind the eye.
Rectangle screen_rectangle(std::span<const Vec3f> points, const Mat4& clip_from_scene, int width,
                           int height);

/// What both rectangles cover; empty where there is nothing.
Rectangle intersection(const Rectangle& a, const Rectangle& b);

/// The smallest rectangle that holds both; empty ones do not count.
Rectangle bounding(const Rectangle& a, const Rectangle& b);

/// The box around the points; of none, the origin.
Bounds bounds_of(std::span<const Vec3f> points);
/// The eight corners of a box.
std::vector<Vec3> corners(const Bounds& bounds);

}  // namespace polyhull
