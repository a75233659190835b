// SPDX-License-Identifier: LGPL-2.1-or-later
#include "body_frames.h"

#include <cmath>

#include "mesh/texture_mesh.h"
#include "silhouette/contour/contourer.h"
#include "silhouette/silhouette.h"

namespace polyhull::benchmark {

using test::BodyScene;

Take::Take(BodyScene from, double tolerance) : scene(std::move(from)) {
  for (std::size_t k = 0; k < scene.cameras.size(); ++k) {
    const Picture& picture = scene.pictures[k];
    Matte matte;
    load_matte(picture.pixels.data() + 3, 4 * picture.width, 4, picture.width, picture.height,
               matte);
    ContourSettings settings;
    settings.approximate.tolerance = tolerance;
    MeshView& out = views.views.emplace_back();
    out.calibration = scene.cameras[k];
    out.view.camera = out.calibration.name;
    out.view.width = picture.width;
    out.view.height = picture.height;
    scene.contours[k] = out.view.contours = Contourer().find(matte, settings);
    out.view.roi = bounding_rectangle(out.view.contours, picture.width, picture.height);
    out.view.format = PixelFormat::rgba;
    out.view.stride = 4 * picture.width;
    const std::size_t first =
        4 * (static_cast<std::size_t>(out.view.roi.y) * picture.width + out.view.roi.x);
    out.view.pixels = std::span(picture.pixels).subspan(first);
    vertices += out.view.contours.points.size();
  }
}

Picture drawn(ProcessorRenderer& renderer, const RenderSubject& subject, const Camera& viewport,
              int width, int height, int samples, std::uint8_t before) {
  RenderFrame frame;
  frame.width = width;
  frame.height = height;
  frame.viewport = viewport;
  frame.subjects = {subject};
  RenderSettings settings;
  settings.edge_samples = samples;
  Picture out{width, height, 4, {}};
  out.pixels.assign(static_cast<std::size_t>(width) * height * 4, before);
  const Picture background = out;
  const RenderPlan plan = renderer.plan(frame, settings);
  renderer.render(frame, plan, settings, background.pixels.data(), 4 * width, out.pixels.data(),
                  4 * width);
  return out;
}

void add_error(const Take& take, const RenderSubject& subject, BetweenError& sum) {
  ProcessorRenderer renderer;
  for (std::size_t k = 0; k < take.scene.between.size(); ++k) {
    const Camera& camera = take.scene.between[k];
    const Picture& truth = take.scene.seen[k];
    const auto picture = [&](std::uint8_t before) {
      return drawn(renderer, subject, camera, camera.width, camera.height, 8, before);
    };
    const Picture seen = picture(behind_bodies), black = picture(0), white = picture(255);
    double both = 0.0, either = 0.0, squares = 0.0, count = 0.0;
    for (std::size_t p = 0; p < seen.pixels.size(); p += 4) {
      const int through = white.pixels[p] - black.pixels[p];
      const bool ours = through < 128, theirs = truth.pixels[p + 3] >= 128;
      both += ours && theirs;
      either += ours || theirs;
      if (through == 255 && truth.pixels[p + 3] == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = seen.pixels[p + c] - truth.pixels[p + c];
        squares += off * off;
      }
      count += 3.0;
    }
    sum.overlap += both / either;
    sum.psnr += 10.0 * std::log10(255.0 * 255.0 * count / squares);
    sum.views += 1.0;
  }
}

RenderSubject textured_subject(Mesh& mesh) {
  TextureSettings settings;
  settings.metric = TextureMetric::viewing_angle;
  texture_mesh(mesh, settings);
  return {&mesh, {}, 0, nullptr};
}

}  // namespace polyhull::benchmark
