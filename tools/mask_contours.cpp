// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mask_contours.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/picture.h"
#include "rig/undistort.h"
#include "silhouette/silhouette.h"

namespace polyhull {
namespace {

Matte matte_of(const Picture& picture) {
  const int channel = picture.channels == 2 || picture.channels == 4 ? picture.channels - 1 : 0;
  Matte matte;
  load_matte(picture.row(0) + channel, picture.channels * picture.width, picture.channels,
             picture.width, picture.height, matte);
  return matte;
}

Picture read(const std::string& path, const Camera& camera) {
  Picture picture = load_picture(path);
  if (picture.width != camera.width || picture.height != camera.height) {
    throw Error(Error::Kind::bad_input,
                "{}: the picture is {}x{}, camera {} has {}x{}; pictures must cover the camera's "
                "full frame.",
                path, picture.width, picture.height, camera.name, camera.width, camera.height);
  }
  return picture;
}

Rings trace(const Picture& picture, const MaskSettings& settings) {
  Blur blur;
  BlurSettings blur_settings;
  blur_settings.sigma = settings.sigma;
  blur.set(blur_settings);
  Field field;
  blur.apply(matte_of(picture), field);
  ContourSettings contours;
  contours.trace.corrected_sigma = corrected_sigma(blur_settings, true);
  contours.approximate.tolerance = settings.tolerance;
  contours.approximate.keep_largest = settings.keep_largest;
  return Contourer().find(field, contours);
}

bool is_coloured(const Picture& picture) {
  if (picture.channels != 3) return false;
  std::size_t coloured = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); i += picture.channels) {
    const std::uint8_t* p = picture.pixels.data() + i;
    if (std::max({p[0], p[1], p[2]}) - std::min({p[0], p[1], p[2]}) >= 32) ++coloured;
  }
  return coloured * 100 > static_cast<std::size_t>(picture.width) * picture.height;
}

Rings key(const Picture& picture, const std::string& path, const MaskSettings& settings) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(picture.width) * picture.height * 4);
  for (std::size_t i = 0; i < pixels.size() / 4; ++i)
    std::copy_n(picture.pixels.data() + i * picture.channels, 3, pixels.data() + 4 * i);
  FrameView frame;
  frame.format = FrameFormat::rgbx;
  frame.width = picture.width;
  frame.height = picture.height;
  frame.planes[0] = pixels.data();
  frame.strides[0] = 4 * static_cast<std::ptrdiff_t>(picture.width);
  SilhouetteSettings silhouette;
  silhouette.key.key = KeyColour::automatic;
  silhouette.blur.sigma = settings.sigma;
  silhouette.approximate.tolerance = settings.tolerance;
  silhouette.approximate.keep_largest = settings.keep_largest;
  silhouette.keep_matte = false;
  Silhouetter silhouetter;
  silhouetter.set(silhouette);
  Rings rings = silhouetter.process(frame);
  if (std::as_const(silhouetter).keyer().calibration().lacks == KeyLack::screen)
    throw Error(Error::Kind::bad_input,
                "{}: no coloured screen was found in it; give a mask instead: a grey picture with "
                "the subject white, or one with the subject in its alpha.",
                path);
  return rings;
}

}  // namespace

Rings contours_of_mask(const std::string& path, const Camera& camera,
                       const MaskSettings& settings) {
  return undistort_rings(camera, trace(read(path, camera), settings)).rings;
}

Rings contours_of_picture(const std::string& path, const Camera& camera,
                          const MaskSettings& settings) {
  Picture picture = read(path, camera);
  // A mask whose alpha says nothing is in its colours.
  const bool opaque = picture.channels == 4 && [&] {
    for (std::size_t i = 3; i < picture.pixels.size(); i += 4)
      if (picture.pixels[i] != 255) return false;
    return true;
  }();
  if (opaque) picture = load_picture(path, 3);
  const Rings all = is_coloured(picture) ? key(picture, path, settings) : trace(picture, settings);
  const auto area = [&](std::size_t i) {
    const std::span<const Vec2f> ring = all.ring(i);
    double sum = 0.0;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2 a(ring[k]), b(ring[(k + 1) % ring.size()]);
      sum += 0.5 * cross(a, b);
    }
    return std::abs(sum);
  };
  double largest = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) largest = std::max(largest, area(i));
  Rings rings;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (area(i) < 1e-3 * largest) continue;
    rings.points.insert(rings.points.end(), all.ring(i).begin(), all.ring(i).end());
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
  if (rings.empty())
    throw Error(
        Error::Kind::bad_input,
        "{}: no subject was found in it; take the pictures while the subject stands on the stage.",
        path);
  return rings;
}

}  // namespace polyhull
