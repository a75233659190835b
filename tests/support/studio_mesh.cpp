// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "builtin/default_rig.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "mesh/texture_mesh.h"
#include "scene/scene.h"
#include "studio/cameras/camera_picture.h"

namespace polyhull::test {

Rig ring_rig(int count) {
  Rig rig = default_rig();
  const Camera like = rig.cameras.front();
  rig.cameras.clear();
  for (int k = 0; k < count; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / count;
    Camera camera = look_at({3.0 * std::sin(angle), 1.2, 3.0 * std::cos(angle)}, {0.0, 0.95, 0.0},
                            60.0, like.width, like.height);
    camera.K = like.K;
    camera.name = "cam" + std::to_string(k);
    rig.cameras.push_back(camera);
  }
  return rig;
}

StudioMesh studio_mesh(const Rig& rig, const std::string& subject, double seconds,
                       const SilhouetteSettings& settings) {
  StudioMesh out;
  PictureLook look;
  look.screen = {{44, 168, 66}, 0.15};
  look.shadow = 0.3;
  look.noise = 2.0;
  const std::size_t count = rig.cameras.size();
  out.pixels.resize(count);
  out.mesh.views.resize(count);
  std::vector<CameraContours> contours;
  for (std::size_t k = 0; k < count; ++k) {
    const Camera& camera = rig.cameras[k];
    CameraPicture picture(rig, static_cast<int>(k), open_subject(subject), PictureQuality::exact);
    picture.set_time(seconds);
    FrameView frame;
    frame.format = FrameFormat::rgba;
    frame.width = camera.width;
    frame.height = camera.height;
    frame.strides[0] = 4 * camera.width;
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(camera.height) * frame.strides[0]);
    frame.planes[0] = rgba.data();
    picture.picture(look, 0, false, rgba.data(), frame.strides[0]);
    Silhouetter silhouetter;
    silhouetter.set(settings);
    View& view = out.mesh.views[k].view;
    view.camera = camera.name;
    view.contours = silhouetter.process(frame);
    view.roi = bounding_rectangle(view.contours, camera.width, camera.height);
    view.width = camera.width;
    view.height = camera.height;
    view.format = PixelFormat::rgba;
    view.stride = 4 * view.roi.width;
    out.pixels[k].resize(static_cast<std::size_t>(view.stride) * view.roi.height);
    silhouetter.write_rgba(frame, view.roi, out.pixels[k].data(), view.stride);
    view.pixels = out.pixels[k];
    out.mesh.views[k].calibration = camera;
    contours.push_back({&camera, &view.contours});
  }
  HullStage stage;
  out.mesh.hull = stage.build(contours, {}, 0.0);
  TextureSettings texture;
  texture.metric = TextureMetric::viewing_angle;
  texture_mesh(out.mesh, texture);
  return out;
}

Picture studio_truth(const Camera& viewport, const std::string& subject, double seconds,
                     const std::array<std::uint8_t, 3>& background) {
  Rig rig = default_rig();
  rig.cameras = {viewport};
  CameraPicture camera(rig, 0, open_subject(subject), PictureQuality::exact);
  camera.set_time(seconds);
  PictureLook look;
  std::copy(background.begin(), background.end(), look.screen.colour);
  look.linear_light = true;
  Picture out{viewport.width, viewport.height, 4, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height * 4);
  camera.picture(look, 0, true, out.pixels.data(), 4 * out.width);
  return out;
}

EdgeError edge_error(const Picture& picture, const Picture& truth) {
  const auto covered = [&](int x, int y) { return truth.row(y)[4 * x + 3] >= 128; };
  constexpr int reach = 8;
  std::vector<bool> near(static_cast<std::size_t>(truth.width) * truth.height);
  for (int y = 0; y + 1 < truth.height; ++y) {
    for (int x = 0; x + 1 < truth.width; ++x) {
      if (covered(x, y) == covered(x + 1, y) && covered(x, y) == covered(x, y + 1)) continue;
      for (int j = std::max(y - reach, 0); j <= std::min(y + reach, truth.height - 1); ++j)
        for (int i = std::max(x - reach, 0); i <= std::min(x + reach, truth.width - 1); ++i)
          if ((i - x) * (i - x) + (j - y) * (j - y) <= reach * reach)
            near[static_cast<std::size_t>(j) * truth.width + i] = true;
    }
  }
  EdgeError out;
  double squares = 0.0;
  for (std::size_t p = 0; p < near.size(); ++p) {
    if (!near[p]) continue;
    ++out.pixels;
    for (std::size_t c = 0; c < 3; ++c) {
      const double off = std::abs(picture.pixels[4 * p + c] - truth.pixels[4 * p + c]);
      out.mean += off;
      squares += off * off;
    }
  }
  if (out.pixels > 0) {
    out.mean /= 3.0 * static_cast<double>(out.pixels);
    out.rms = std::sqrt(squares / (3.0 * static_cast<double>(out.pixels)));
  }
  return out;
}

}  // namespace polyhull::test
