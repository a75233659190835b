// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mask_contours.h"

#include <algorithm>

#include "base/error.h"
#include "base/picture.h"
#include "silhouette/approximate.h"
#include "silhouette/blur.h"
#include "silhouette/silhouette.h"
#include "silhouette/trace.h"

namespace polyhull {
namespace {

Matte matte_of(const Picture& picture) {
  const int channel = picture.channels == 2 || picture.channels == 4 ? picture.channels - 1 : 0;
  Matte matte;
  matte.resize(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    std::uint8_t* row = matte.row(y);
    BlockState* states = matte.state_row(y);
    std::fill_n(states, blocks_across(picture.width), BlockState{0});
    for (int x = 0; x < picture.width; ++x) {
      row[x] = picture.row(y)[x * picture.channels + channel];
      states[x / matte_block] |= row[x] == 0     ? block_empty
                                 : row[x] == 255 ? block_full
                                                 : block_mixed;
    }
  }
  return matte;
}

}  // namespace

Rings contours_of_mask(const std::string& path, const Camera& camera,
                       const MaskSettings& settings) {
  const Picture picture = load_picture(path);
  if (picture.width != camera.width || picture.height != camera.height) {
    throw Error(Error::Kind::bad_input, path + ": the mask is " + std::to_string(picture.width) +
                                            "x" + std::to_string(picture.height) + ", camera " +
                                            camera.name + " has " + std::to_string(camera.width) +
                                            "x" + std::to_string(camera.height) +
                                            "; masks must cover the camera's full frame");
  }
  Blur blur;
  BlurSettings blur_settings;
  blur_settings.sigma = settings.sigma;
  blur.set(blur_settings);
  Field field;
  blur.apply(matte_of(picture), field);
  Tracer tracer;
  TraceSettings trace;
  trace.corrected_sigma = corrected_sigma(blur_settings, true);
  Rings traced, rings;
  tracer.trace(field, trace, traced);
  Approximator approximator;
  ApproximateSettings approximate;
  approximate.tolerance = settings.tolerance;
  approximator.approximate(traced, {}, approximate, rings);
  if (camera.has_distortion()) {
    for (Vec2f& p : rings.points) p = Vec2f(camera.undistort(Vec2(p)));
  }
  return rings;
}

}  // namespace polyhull
