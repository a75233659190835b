// SPDX-License-Identifier: LGPL-2.1-or-later
#include "outage.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "builtin/default_rig.h"
#include "silhouette/silhouette.h"
#include "studio/cameras/camera_picture.h"

namespace polyhull::benchmark {
namespace {

Camera turned(Camera camera, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  camera.R = camera.R * Mat3(c, 0, s, 0, 1, 0, -s, 0, c);  // by the transpose of the turn
  return camera;
}

std::vector<Camera> viewpoints_of(const Rig& rig) {
  const auto azimuth = [](const Camera& camera) {
    return std::atan2(camera.centre().x, camera.centre().z);
  };
  std::vector<double> angles;
  for (const Camera& camera : rig.cameras) angles.push_back(azimuth(camera));
  std::sort(angles.begin(), angles.end());
  for (std::size_t i = 0, n = angles.size(); i < n; ++i) {
    const double next = i + 1 < n ? angles[i + 1] : angles[0] + 2.0 * std::numbers::pi;
    angles.push_back(0.5 * (angles[i] + next));
  }
  Camera small = rig.cameras[0];
  const double scale = 320.0 / small.width;
  small.width = 320;
  small.height = 240;
  small.K = Mat3(Vec3(scale, 0, 0), Vec3(0, scale, 0), Vec3(0, 0, 1)) * small.K;
  std::vector<Camera> views;
  for (const double angle : angles) views.push_back(turned(small, angle - azimuth(small)));
  return views;
}

/// A silhouette as the elements make it by default.
Rings contours(const Picture& picture) {
  Matte matte;
  load_matte(picture.pixels.data(), picture.width, 1, picture.width, picture.height, matte);
  BlurSettings settings;
  Blur blur;
  blur.set(settings);
  Field field;
  blur.apply(matte, field);
  return Contourer().find(field, {{TraceMethod::subpixel, corrected_sigma(settings, true)}, {}});
}

/// The mean of count(viewpoint) over the figure's area.
template <class Count>
double share(const Pictures& truth, const Count& count) {
  double sum = 0.0;
  for (std::size_t v = 0; v < truth.size(); ++v) sum += double(count(v)) / truth[v].area();
  return sum / double(truth.size());
}

int difference(const Bits& a, const Bits& b) {
  return a.beyond(b) + b.beyond(a);
}

}  // namespace

int Bits::area() const {
  int sum = 0;
  for (const std::uint64_t word : words) sum += std::popcount(word);
  return sum;
}

int Bits::beyond(const Bits& other) const {
  int sum = 0;
  for (std::size_t i = 0; i < words.size(); ++i) sum += std::popcount(words[i] & ~other.words[i]);
  return sum;
}

Outage::Outage(const Rig& rig, double start, bool refined)
    : rig_(rig), views_(viewpoints_of(rig)), refined_(refined) {
  for (int k = -1; k <= dense; ++k) instants_.push_back({k, k >= 0 && k < dense});
  for (int k = dense + 2; k < longest; k += 5) instants_.push_back({k, 5});
  options_.bounds = rig_.bounds;
  const auto subject = open_subject("");
  std::vector<CameraPicture> cameras;
  for (std::size_t i = 0; i < rig_.cameras.size(); ++i)
    cameras.emplace_back(rig_, static_cast<int>(i), subject);
  for (const Instant& instant : instants_) {
    std::vector<Rings>& rings = rings_.emplace_back();
    for (CameraPicture& camera : cameras) {
      Picture picture{camera.camera().width, camera.camera().height, 1, {}};
      picture.pixels.resize(static_cast<std::size_t>(picture.width) * picture.height);
      camera.set_time(start + frame_time * instant.frame);
      camera.matte(picture.pixels.data(), picture.width);
      rings.push_back(contours(picture));
    }
    const auto shown = subject->instant(start + frame_time * instant.frame);
    CoverageRaster::Mesh figure{shown->surface().positions, subject->triangles()};
    truth_.push_back(pictures(figure));
    shown_[whole].push_back(pictures(build(rings)));
  }
  shown_[frozen].assign(instants_.size(), shown_[whole][0]);
}

void Outage::lose(const std::vector<int>& missing) {
  for (const Source source : {without, held}) shown_[source] = shown_[whole];
  for (std::size_t i = 1; i < instants_.size(); ++i) {
    std::vector<Rings> rings = rings_[i];
    shown_[without][i] = pictures(build(rings, missing));
    if (instants_[i].frame >= dense) continue;
    for (const int m : missing) rings[m] = rings_[0][m];
    shown_[held][i] = pictures(build(rings));
  }
}

const Hull& Outage::build(const std::vector<Rings>& rings, const std::vector<int>& missing) {
  std::vector<Silhouette> silhouettes;
  std::vector<CameraContours> views;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    if (std::find(missing.begin(), missing.end(), static_cast<int>(i)) != missing.end()) continue;
    silhouettes.push_back({&rig_.cameras[i], &rings[i]});
    views.push_back({&rig_.cameras[i], &rings[i]});
  }
  const Hull& hull = builder_.build(silhouettes, options_);
  if (!refined_) return hull;
  try {
    return refiner_.refine(hull, views, 1.0, {.threads = 1});
  } catch (const std::exception&) {
    return hull;  // as the element does
  }
}

Pictures Outage::pictures(const Hull& hull) {
  CoverageRaster::Mesh mesh{hull.vertices, hull.triangles};
  mesh.origin = hull.origin;
  return pictures(mesh);
}

Pictures Outage::pictures(const CoverageRaster::Mesh& mesh) {
  Pictures result;
  for (const Camera& view : views_) {
    Bits& bits = result.emplace_back();
    bits.words.assign(320 * 240 / 64, 0);
    raster_.draw(view, mesh, [&](int y, std::span<const CoveredPixel> pixels) {
      for (const CoveredPixel& pixel : pixels)
        if (pixel.coverage >= 0.5f)
          bits.words[(y * 320 + pixel.x) / 64] |= std::uint64_t{1} << pixel.x % 64;
    });
  }
  return result;
}

double Outage::error(const Pictures& shown, std::size_t i) const {
  return share(truth_[i], [&](std::size_t v) { return difference(shown[v], truth_[i][v]); });
}

double Outage::cut_off(const Pictures& shown, std::size_t i) const {
  return share(truth_[i], [&](std::size_t v) { return truth_[i][v].beyond(shown[v]); });
}

double Outage::jump(const Pictures& before, const Pictures& after, std::size_t i) const {
  return share(truth_[i], [&](std::size_t v) {
    return difference(before[v], after[v]) - difference(truth_[i - 1][v], truth_[i][v]);
  });
}

Picture Outage::sheet() const {
  constexpr int width = 160, height = 200, frames[] = {1, 9, 24};
  Picture sheet{6 * width, source_count * height, 3, {}};
  for (int y = 0; y < sheet.height; ++y) {
    for (int x = 0; x < sheet.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(frames[x / width % 3]) + 1;
      const std::size_t v = x < 3 * width ? 0 : views_.size() / 2;
      const int left = x % width + 80, top = y % height + 20;
      const bool is = truth_[i][v].at(left, top), shows = shown_[y / height][i][v].at(left, top);
      const bool border = x % width == 0 || y % height == 0;
      const std::uint8_t dark = border ? 90 : 25;
      const std::uint8_t colours[2][2][3] = {{{dark, dark, dark}, {25, 110, 255}},
                                             {{240, 40, 40}, {240, 240, 240}}};
      for (const std::uint8_t value : colours[is][shows]) sheet.pixels.push_back(value);
    }
  }
  return sheet;
}

}  // namespace polyhull::benchmark
