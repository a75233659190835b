// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The reference picture: path tracing without approximation of the light that this project draws.
///
/// Through each point of a pixel: mirrors are followed (ideal reflection, Schlick's Fresnel term,
/// up to `mirror_depth` of them), and a diffuse point x shows base colour / pi times
///   E(x) = E_direct(x) + int L_1(y) cos dw,
/// E_direct the light of the scene's lights, and of its environment, that reaches x, L_1(y) the sky's radiance where there is
/// nothing (an environment's only by way of mirrors, since E_direct has the rest), and what the surface y seen from x in direction w sends: its emission (unless it is one of the lights, which E_direct has), base
/// colour / pi times E_direct(y), and by mirrors what they show of the same; so one diffuse bounce.
/// Subjects show their given colour in all of these. A pixel is the mean over its square; light
/// sources seen directly or in mirrors count as white, so that their edges can be smooth.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/picture.h"
#include "raytrace/traced_scene.h"

namespace polyhull {

/// How paths are traced.
struct PathOptions {
  int mirror_depth = 6;  ///< how many mirrors a ray follows
  int threads = 0;       ///< of the pool, 0: all
  /// Ways to each light and bounces for each point that the camera sees. Mirrors and edges need few
  /// camera rays, soft shadows many ways.
  int light_samples = 1;
  int bounce_samples = 1;
  /// Of a thin lens around the camera's centre, metres; 0: a pinhole. Each sample goes through its own
  /// place of the lens, from the pixel's place on the plane of what is sharp, which lies at depth
  /// `focus_distance`.
  float aperture = 0.0f;
  float focus_distance = 3.0f;
};

/// Adds samples first .. first + count - 1 of each pixel to \p sums (linear picture values, row by
/// row, camera.width * camera.height of them), in rows \p row_begin .. \p row_end - 1 (-1: to the
/// last). Different samples make independent pictures whose mean converges to the reference; the
/// result does not depend on the number of threads.
void trace_paths(const TracedScene& scene, const Camera& camera, std::uint32_t first,
                 std::uint32_t count, const PathOptions& options, std::span<Vec3f> sums,
                 int row_begin = 0, int row_end = -1);

/// The picture after \p samples samples per pixel, RGBA with alpha 255.
Picture trace_picture(const TracedScene& scene, const Camera& camera, std::uint32_t samples,
                      const PathOptions& options = {});

/// sums / samples as an 8-bit sRGB picture, RGBA with alpha 255.
Picture develop(std::span<const Vec3f> sums, float samples, int width, int height);

}  // namespace polyhull
