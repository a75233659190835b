// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Bodies whose true surface and colours are known, seen by a few cameras, and how far a surface
/// made from what the cameras see is from the body. Five bodies, cameras of 1024 x 768, f = 700 px,
/// 3 m from the bodies' axis, ideal mattes: the yardstick of docs/benchmarks-body.md.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/picture.h"
#include "base/rings.h"
#include "hull/build/stage.h"
#include "hull/hull.h"
#include "mesh/mesh.h"
#include "refine/refine.h"
#include "rig/rig.h"
#include "studio/figure/subject.h"
#include "support/surface.h"
#include "texture/texture_hull.h"

namespace polyhull::test {

/// A subject at one instant of its motion.
struct Body {
  std::string name;
  std::shared_ptr<const Subject> subject;
  double seconds = 0.0;
};

/// The figure at 0, 3 and 7 s; and the body of the folder \p data (as POLYHULL_DATA names it),
/// turned two ways, if it is there.
std::vector<Body> study_bodies(const std::string& data);

/// Cameras at these azimuths in degrees from +x towards +z, rising; as those of the built-in rig,
/// but all 1.2 m high, 3 m away, and looking at a height of 0.95 m.
Rig body_rig(const std::vector<double>& azimuths);
/// "4" to "64": a ring of as many; "4far": 0, 90, 225, 315 degrees; a rig file that ends in .json.
/// Throws Error for other names.
Rig body_rig(const std::string& name);

/// A body and what a rig's cameras see of it. Pictures are RGBA on an even grey, alpha the share of
/// each pixel that the body covers.
struct BodyScene {
  std::string name;  ///< the body's
  TriangleSurface truth;
  std::vector<Camera> cameras;
  std::vector<Rings> contours;       ///< per camera: within half a pixel of the picture's alpha
  std::vector<Picture> silhouettes;  ///< per camera: what the contours hold, one channel
  std::vector<Picture> pictures;     ///< per camera
  std::vector<Camera> between;       ///< half way between neighbours, the same height and distance
  std::vector<Picture> seen;         ///< what those would see
};

/// \p between: false leaves `between` and `seen` empty.
BodyScene body_scene(const Rig& rig, const Body& body, bool between = true);
std::vector<BodyScene> body_scenes(const Rig& rig, const std::vector<Body>& bodies);

/// The scene with every vertex of its contours moved by Gaussian noise of the standard deviation
/// \p pixels in x and in y; nothing else changes.
BodyScene with_noise(const BodyScene& scene, double pixels, std::uint64_t seed);

/// The scene's pictures, for refining by colours.
std::vector<ViewPixels> view_pixels(const BodyScene& scene);

/// The scene's silhouettes intersected by \p stage, which is not to hold what it knows already.
const Hull& hull_of(const BodyScene& scene, HullStage& stage, int threads);

/// How far a surface is from the truth.
struct BodyError {
  double unsound = 0.0;    ///< 0 for a closed, oriented 2-manifold, else 1
  double volume = 0.0;     ///< over the true one
  double mean = 0.0;       ///< mm; mean distance, of both directions
  double hausdorff = 0.0;  ///< mm; 95 % of the points are nearer, of both directions the larger
  double overlap = 0.0;    ///< of the silhouettes half way between cameras: of both over of either
  double missing = 0.0;    ///< of the area within the contours, the share that is not covered
  double outside = 0.0;    ///< what is covered beyond them, over their area
  double psnr = 0.0;       ///< dB, textured, half way between cameras; 0 where it was not asked for
};

/// Means over the scene's cameras. \p psnr: whether to draw it textured. The pixels of the body and
/// of the surface count, red, green and blue as they are in the picture.
BodyError measure(const Hull& hull, const BodyScene& scene, bool psnr);

/// How far it is from one surface to the other: mm, the mean of both directions' mean distances.
double distance_mm(const TriangleSurface& a, const TriangleSurface& b);

/// What \p camera sees of the surface: 0..255 by coverage, one channel.
Picture coverage_of(const TriangleSurface& surface, const Camera& camera);

/// The surface as plaster under a lamp beside the camera, RGB on the scenes' grey.
Picture plaster(const TriangleSurface& surface, const Camera& camera);

/// The hull with the scene's pictures, which it borrows, as views; not textured yet.
Mesh mesh_of(const Hull& hull, const BodyScene& scene);

/// A textured mesh as composite draws it by the processor; RGBA on the scenes' grey.
Picture drawn(const Mesh& mesh, const Camera& camera);

/// The hull coloured from the scene's cameras, as composite draws it by the processor; RGBA on the
/// scenes' grey.
Picture textured(const Hull& hull, const BodyScene& scene, const Camera& camera);

/// Each camera moved \p share of the way to the next around the stage, at the same height and
/// distance: 0 leaves it, 0.5 is half way.
std::vector<Camera> cameras_between(const std::vector<Camera>& cameras, double share);
/// What \p cameras would see of the body, as BodyScene::pictures.
std::vector<Picture> pictures_of(const Rig& rig, const std::vector<Camera>& cameras,
                                 const Body& body);
/// BodyError::psnr of the hull textured by \p settings, from each of \p cameras, which would see
/// \p seen of the body.
std::vector<double> psnr_from(const Hull& hull, const BodyScene& scene,
                              const TextureSettings& settings, const std::vector<Camera>& cameras,
                              const std::vector<Picture>& seen);

}  // namespace polyhull::test
