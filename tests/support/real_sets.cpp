// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/real_sets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "base/thread_pool.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "refine/refine.h"
#include "render/processor/processor_renderer.h"
#include "rig/import.h"
#include "rig/undistort.h"

namespace polyhull::test {
namespace {

constexpr std::uint8_t grey = 24;  // outside silhouettes

Picture grey_picture(const Camera& camera) {
  Picture out{camera.width, camera.height, 4, {}};
  out.pixels.assign(static_cast<std::size_t>(out.width) * out.height * 4, grey);
  return out;
}

/// All cameras' pictures, keyed by the same settings.
std::vector<RealView> keyed_files(const Rig& rig, const std::string& folder, double metres,
                                  const SilhouetteSettings& settings) {
  std::vector<RealView> views(rig.cameras.size());
  parallel_for(views.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Camera& camera = rig.cameras[k];
      views[k] =
          keyed(scaled(camera, metres), load_picture(folder + camera.name + ".png", 4), settings);
    }
  });
  return views;
}

Bounds scaled(const Vec3& low, const Vec3& high, double metres) {
  return {low * metres, high * metres};
}

/// Where row \p y crosses the rings, rising.
std::vector<double> crossings(const Rings& rings, double y) {
  std::vector<double> out;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const std::span<const Vec2f> ring = rings.ring(i);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2 a(ring[k]), b(ring[(k + 1) % ring.size()]);
      if ((a.y <= y) != (b.y <= y)) out.push_back(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// Between pixels linear; at the border the outermost.
std::array<std::uint8_t, 3> sampled(const Picture& picture, const Vec2& at) {
  const double u = std::clamp(at.x, 0.0, picture.width - 1.001);
  const double v = std::clamp(at.y, 0.0, picture.height - 1.001);
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  std::array<std::uint8_t, 3> out{};
  for (int c = 0; c < 3; ++c) {
    const auto value = [&](int i, int j) -> double { return picture.row(y + j)[4 * (x + i) + c]; };
    const double upper = (1.0 - a) * value(0, 0) + a * value(1, 0);
    const double lower = (1.0 - a) * value(0, 1) + a * value(1, 1);
    out[c] = static_cast<std::uint8_t>(std::lround((1.0 - b) * upper + b * lower));
  }
  return out;
}

/// A plane of numbers, blurred by the window of SSIM; beyond the border as at it.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;

  Plane(int across, int down)
      : width(across), height(down), values(static_cast<std::size_t>(across) * down) {}
  double& at(int x, int y) { return values[static_cast<std::size_t>(y) * width + x]; }
  double at(int x, int y) const { return values[static_cast<std::size_t>(y) * width + x]; }

  Plane blurred() const {
    constexpr int reach = 5;
    double taps[reach + 1], sum = 0.0;
    for (int i = 0; i <= reach; ++i) {
      taps[i] = std::exp(-i * i / (2.0 * 1.5 * 1.5));
      sum += i == 0 ? taps[i] : 2.0 * taps[i];
    }
    Plane rows(width, height), out(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int i = -reach; i <= reach; ++i)
          rows.at(x, y) += taps[std::abs(i)] / sum * at(std::clamp(x + i, 0, width - 1), y);
    for (int y = 0; y < height; ++y)
      for (int i = -reach; i <= reach; ++i)
        for (int x = 0; x < width; ++x)
          out.at(x, y) += taps[std::abs(i)] / sum * rows.at(x, std::clamp(y + i, 0, height - 1));
    return out;
  }
};

bool is_grey(const std::uint8_t* pixel) {
  return pixel[0] == grey && pixel[1] == grey && pixel[2] == grey;
}

/// The pixels that count, one channel, 0 or 255.
Picture counted(const Picture& drawn, const Picture& seen, Within within) {
  Picture out{seen.width, seen.height, 1, {}};
  out.pixels.resize(seen.pixels.size() / 4);
  for (std::size_t p = 0; p < out.pixels.size(); ++p) {
    const bool also = within == Within::either && !is_grey(drawn.pixels.data() + 4 * p);
    out.pixels[p] = seen.pixels[4 * p + 3] == 255 || also ? 255 : 0;
  }
  return out;
}

/// Rec. 601 luma; even grey where \p mask is 0.
Plane luma_of(const Picture& picture, const Picture& mask) {
  Plane out(picture.width, picture.height);
  for (std::size_t p = 0; p < out.values.size(); ++p) {
    const std::uint8_t* c = picture.pixels.data() + 4 * p;
    out.values[p] = mask.pixels[p] ? 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2] : grey;
  }
  return out;
}

Plane product(const Plane& a, const Plane& b) {
  Plane out(a.width, a.height);
  for (std::size_t p = 0; p < out.values.size(); ++p) out.values[p] = a.values[p] * b.values[p];
  return out;
}

double ssim_of(const Picture& drawn, const Picture& seen, const Picture& mask) {
  const Plane a = luma_of(drawn, mask), b = luma_of(seen, mask);
  const Plane mean_a = a.blurred(), mean_b = b.blurred();
  const Plane aa = product(a, a).blurred(), bb = product(b, b).blurred(),
              ab = product(a, b).blurred();
  constexpr double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
  double sum = 0.0, count = 0.0;
  for (std::size_t p = 0; p < a.values.size(); ++p) {
    if (!mask.pixels[p]) continue;
    const double m = mean_a.values[p], n = mean_b.values[p];
    sum += (2 * m * n + c1) * (2 * (ab.values[p] - m * n) + c2) /
           ((m * m + n * n + c1) * (aa.values[p] - m * m + bb.values[p] - n * n + c2));
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

}  // namespace

RealView keyed(const Camera& camera, Picture picture, const SilhouetteSettings& settings) {
  FrameView frame;
  frame.format = FrameFormat::rgbx;
  frame.width = picture.width;
  frame.height = picture.height;
  frame.planes[0] = picture.pixels.data();
  frame.strides[0] = 4 * static_cast<std::ptrdiff_t>(picture.width);
  Silhouetter silhouetter;
  silhouetter.set(settings);
  Rings contours = silhouetter.process(frame);
  return {camera, std::move(picture), std::move(contours)};
}

Camera scaled(Camera camera, double metres) {
  camera.t *= metres;
  return camera;
}

std::optional<RealSet> oxford_dinosaur(const std::string& data) {
  const std::string folder = data + "/oxford_dino/";
  if (!std::filesystem::exists(folder + "images")) return {};
  import::Options options;
  options.width = 720;
  options.height = 576;
  options.name = "viff.%03d";
  const Rig rig = import::projection_matrices({folder + "dino_Ps_metric.txt"}, options);
  SilhouetteSettings settings;
  settings.key.key = KeyColour::blue;
  settings.key.screen = {{66, 82, 112}};
  settings.key.foreground = {{110, 104, 98}};
  settings.key.clip_black = 0.25;
  settings.key.clip_white = 0.9;
  settings.key.roi = {4, 6, 690, 562};
  settings.blur.sigma = 0.6;
  settings.approximate.tolerance = 0.25;
  settings.approximate.min_area = 400.0;
  constexpr double metres = 7.0;
  return RealSet{"oxford", keyed_files(rig, folder + "images/", metres, settings),
                 scaled({-0.07, -0.12, 0.38}, {0.07, 0.055, 0.6}, metres)};
}

std::optional<RealSet> middlebury_dinosaur(const std::string& data) {
  const std::string folder = data + "/middlebury_dinoSparseRing/";
  if (!std::filesystem::exists(folder + "dinoSR_par.txt")) return {};
  const Rig rig = import::middlebury(folder + "dinoSR_par.txt", {});
  SilhouetteSettings settings;
  settings.key.method = KeyMethod::difference;
  settings.key.key = KeyColour::custom;
  settings.key.colour = {0, 0, 0};
  settings.key.difference_low = 30.0;
  settings.key.difference_high = 60.0;
  settings.key.close = 5.0;
  settings.blur.sigma = 1.0;
  settings.approximate.tolerance = 0.25;
  settings.approximate.keep_largest = 1;
  settings.approximate.min_hole_area = 3000.0;
  constexpr double metres = 15.0;
  return RealSet{"middlebury", keyed_files(rig, folder, metres, settings),
                 scaled({-0.061897, -0.018874, -0.057845}, {0.010897, 0.068227, 0.015495}, metres)};
}

Mesh hull_mesh(const RealSet& set, const std::vector<std::size_t>& used) {
  Mesh mesh;
  std::vector<CameraContours> contours;
  for (const std::size_t k : used) {
    const RealView& from = set.views[k];
    contours.push_back({&from.camera, &from.contours});
    MeshView out;
    out.calibration = from.camera;
    out.view.camera = from.camera.name;
    out.view.width = from.picture.width;
    out.view.height = from.picture.height;
    out.view.roi = {0, 0, from.picture.width, from.picture.height};
    out.view.contours = from.contours;
    out.view.format = PixelFormat::rgba;
    out.view.stride = 4 * from.picture.width;
    out.view.pixels = from.picture.pixels;
    mesh.views.push_back(std::move(out));
  }
  HullOptions options;
  options.bounds = set.bounds;
  options.threads = 0;
  mesh.hull = HullStage().build(contours, options, 0.0);
  return mesh;
}

Hull refined_hull(const Mesh& mesh, bool fine) {
  std::vector<CameraContours> views;
  for (const MeshView& view : mesh.views) views.push_back({&view.calibration, &view.view.contours});
  return HullRefiner().refine(mesh.hull, views, 1.0,
                              {.quality = fine ? RefineQuality::fine : RefineQuality::good});
}

Picture seen_by(const RealView& view) {
  const Rings ideal = undistort_rings(view.camera, view.contours).rings;
  Picture out = grey_picture(view.camera);
  for (int y = 0; y < out.height; ++y) {
    const std::vector<double> edges = crossings(ideal, y);
    for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
      const int first = std::max(0, static_cast<int>(std::ceil(edges[i])));
      const int last = std::min(out.width - 1, static_cast<int>(std::floor(edges[i + 1])));
      for (int x = first; x <= last; ++x) {
        const auto colour = sampled(view.picture, view.camera.distort(Vec2(x, y)));
        std::copy_n(colour.begin(), 3, out.row(y) + 4 * x);
        out.row(y)[4 * x + 3] = 255;
      }
    }
  }
  return out;
}

Picture drawn_for(const RealView& view, const Mesh& mesh) {
  RenderFrame frame;
  frame.width = view.camera.width;
  frame.height = view.camera.height;
  frame.viewport = view.camera;
  frame.subjects.push_back({&mesh, {}, 1});
  RenderSettings settings;
  settings.edge_samples = 8;
  const Picture background = grey_picture(view.camera);
  Picture out = background;
  ProcessorRenderer renderer;
  const RenderPlan plan = renderer.plan(frame, settings);
  renderer.render(frame, plan, settings, background.pixels.data(), 4 * out.width, out.pixels.data(),
                  4 * out.width);
  return out;
}

Likeness likeness(const Picture& drawn, const Picture& seen, Within within) {
  const Picture mask = counted(drawn, seen, within);
  double sum = 0.0, count = 0.0;
  for (std::size_t p = 0; p < mask.pixels.size(); ++p) {
    if (!mask.pixels[p]) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double off = drawn.pixels[4 * p + c] - seen.pixels[4 * p + c];
      sum += off * off;
    }
    count += 3.0;
  }
  Likeness result;
  result.psnr = sum > 0.0 ? 10.0 * std::log10(255.0 * 255.0 * count / sum) : 99.0;
  result.ssim = ssim_of(drawn, seen, mask);
  return result;
}

double overlap(const Picture& drawn, const Picture& seen) {
  double both = 0.0, either = 0.0;
  for (std::size_t p = 0; p < seen.pixels.size(); p += 4) {
    const bool theirs = seen.pixels[p + 3] == 255, ours = !is_grey(drawn.pixels.data() + p);
    both += theirs && ours;
    either += theirs || ours;
  }
  return either > 0.0 ? both / either : 1.0;
}

}  // namespace polyhull::test
