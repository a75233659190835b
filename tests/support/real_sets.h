// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Real subjects seen by many calibrated cameras, from the folder that POLYHULL_DATA names; and how
/// well a surface made from some of them shows what the others saw.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/picture.h"
#include "base/rings.h"
#include "mesh/mesh.h"
#include "rig/camera.h"
#include "silhouette/silhouette.h"

namespace polyhull::test {

/// What one camera saw.
struct RealView {
  Camera camera;
  Picture picture;  ///< RGBA, as filmed
  Rings contours;   ///< keyed; real pixels
};

/// One instant, in metres of a world in which toys are as tall as people: the refiner's cells are
/// made for those.
struct RealSet {
  std::string name;
  std::vector<RealView> views;
  std::optional<Bounds> bounds;
};

/// \p picture (RGBA) of \p camera, keyed by \p settings. Throws Error as Silhouetter does.
RealView keyed(const Camera& camera, Picture picture, const SilhouetteSettings& settings);

/// \p camera with lengths \p metres times as large.
Camera scaled(Camera camera, double metres);

/// The Oxford dinosaur on blue cloth, 36 views, and Middlebury's dinoSparseRing on black, 16, keyed
/// as docs/keying.md says; nothing where \p data does not hold them. Throws Error where files are
/// broken.
std::optional<RealSet> oxford_dinosaur(const std::string& data);
std::optional<RealSet> middlebury_dinosaur(const std::string& data);

/// The views of \p set whose numbers are \p used, with the hull of their contours; not textured.
/// Views' pixels are the set's, which must outlive the mesh.
Mesh hull_mesh(const RealSet& set, const std::vector<std::size_t>& used);

/// \p hull of the mesh refined by its views.
Hull refined_hull(const Mesh& mesh, bool fine = false);

/// What a camera saw that was left out, without its lens: its picture inside its silhouette, even
/// grey outside; alpha is 255 inside.
Picture seen_by(const RealView& view);

/// \p mesh, textured, as the processor's renderer draws it for that camera on the same grey.
Picture drawn_for(const RealView& view, const Mesh& mesh);

/// How alike two pictures are, over some pixels.
struct Likeness {
  double psnr = 0.0;  ///< dB, red, green and blue
  /// Structural similarity of the luma (Wang, Bovik, Sheikh, Simoncelli 2004; Gaussian window of
  /// 1.5 px, 11 px across), the mean over these pixels.
  double ssim = 0.0;
};
/// Which pixels count.
enum class Within {
  silhouette,  ///< where \p seen is opaque; what is drawn elsewhere is taken for grey
  either,      ///< and where something is drawn
};
Likeness likeness(const Picture& drawn, const Picture& seen, Within within);

/// Of the pixels that \p seen or \p drawn show something at, the share at which both do.
double overlap(const Picture& drawn, const Picture& seen);

}  // namespace polyhull::test
