// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mask_contours.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

#include "base/error.h"
#include "base/picture.h"
#include "mask_picture.h"
#include "rig/undistort.h"
#include "silhouette/silhouette.h"

namespace polyhull {
namespace {

MaskPicture read(const std::string& path, const Camera& camera) {
  MaskPicture mask = load_mask_picture(path);
  const Picture& picture = mask.picture;
  if (picture.width != camera.width || picture.height != camera.height) {
    throw Error(Error::Kind::bad_input,
                "{}: the picture is {}x{}, camera {} has {}x{}; pictures must cover the camera's "
                "full frame.",
                path, picture.width, picture.height, camera.name, camera.width, camera.height);
  }
  if (!mask.note.empty()) std::cerr << "note: " << path << ": " << mask.note << "\n";
  return mask;
}

Rings trace(const Picture& picture, const MaskSettings& settings) {
  Blur blur;
  BlurSettings blur_settings;
  blur_settings.sigma = settings.sigma;
  blur.set(blur_settings);
  Field field;
  Matte matte;
  load_matte(picture.row(0), picture.width, 1, picture.width, picture.height, matte);
  blur.apply(matte, field);
  ContourSettings contours;
  contours.trace.corrected_sigma = corrected_sigma(blur_settings, true);
  contours.approximate.tolerance = settings.tolerance;
  contours.approximate.keep_largest = settings.keep_largest;
  return Contourer().find(field, contours);
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

Rings rings_of(const std::string& path, const Camera& camera, const MaskSettings& settings) {
  const MaskPicture mask = read(path, camera);
  return mask.to_key ? key(mask.picture, path, settings) : trace(mask.picture, settings);
}

}  // namespace

Rings contours_of_mask(const std::string& path, const Camera& camera,
                       const MaskSettings& settings) {
  return undistort_rings(camera, rings_of(path, camera, settings)).rings;
}

Rings contours_of_picture(const std::string& path, const Camera& camera,
                          const MaskSettings& settings) {
  const Rings all = rings_of(path, camera, settings);
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
