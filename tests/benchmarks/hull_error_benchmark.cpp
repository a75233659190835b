// SPDX-License-Identifier: LGPL-2.1-or-later
// What a faster hull costs in truth: a body with a known surface is seen by eight cameras as masks,
// the masks become contours with tolerances from 0.25 to 8 px, the contours hulls; beside them
// voxel hulls of several sizes from the finest contours. hull_error.csv holds time against the
// hull's silhouettes' overlap with the body's (in its own cameras and in others), its volume, and
// its distance to the body.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "benchmarks/measure.h"
#include "command_line.h"
#include "hull/build/hull_builder.h"
#include "silhouette/blur/blur.h"
#include "silhouette/contour/approximate.h"
#include "silhouette/contour/trace.h"
#include "silhouette/silhouette.h"
#include "support/scenes.h"
#include "true_body.h"
#include "voxel_hull.h"

namespace polyhull::test {
namespace {

constexpr int cameras = 8;

/// The traced boundary of a soft mask, before approximation.
Rings trace(const Picture& mask) {
  Matte matte;
  load_matte(mask.pixels.data(), mask.width, 1, mask.width, mask.height, matte);
  BlurSettings settings;
  settings.sigma = 0.7;
  Blur blur;
  blur.set(settings);
  Field field;
  blur.apply(matte, field);
  Tracer tracer;
  Rings rings;
  tracer.trace(field, {TraceMethod::subpixel, corrected_sigma(settings, true)}, rings);
  return rings;
}

double timed(const std::function<void()>& work) {
  return benchmark::median_ms(work, 0.5, 5, 200);
}

class Study {
 public:
  Study(const std::string& body_path, const std::string& output)
      : body_(load_surface(body_path)),
        table_(output + "/hull_error.csv",
               "method,setting,contour_vertices,ms,triangles,iou_own,iou_others,volume,body_volume,"
               "hausdorff_mm,body_to_hull_max_mm,hull_to_body_mean_mm") {
    Vec3 low = body_.vertices[0], high = low;
    for (const Vec3& v : body_.vertices) {
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
    bounds_ = {low - 0.25, high + 0.25};
    const Vec3 middle = (low + high) * 0.5;
    for (int i = 0; i < 2 * cameras;
         ++i) {  // every second one is left out of the hull, to look from
      const double angle = M_PI * i / cameras;
      const Vec3 centre =
          middle + Vec3(3.5 * std::cos(angle), 0.4 + 0.5 * (i / 2 % 3), 3.5 * std::sin(angle));
      Camera camera = look_at("cam" + std::to_string(i), centre, middle, 1100, 1024, 768, M_PI / 2);
      (i % 2 ? others_ : own_).push_back(camera);
      (i % 2 ? other_masks_ : own_masks_).push_back(mask_of(body_, camera, 4));
    }
    for (const Picture& mask : own_masks_) traced_.push_back(trace(mask));
  }

  void run() {
    std::vector<Rings> finest;
    for (double tolerance : {0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0}) {
      std::vector<Rings> rings(traced_.size());
      Approximator approximator;
      ApproximateSettings settings;
      settings.tolerance = tolerance;
      for (std::size_t i = 0; i < rings.size(); ++i)
        approximator.approximate(traced_[i], {}, settings, rings[i]);
      if (finest.empty()) finest = rings;
      HullBuilder builder;
      HullOptions options;
      options.bounds = bounds_;
      options.reuse = false;
      const auto views = views_of(rings);
      const Hull* hull = nullptr;
      const double ms = timed([&] { hull = &builder.build(views, options); });
      report("exact", tolerance, rings, ms, *hull);
    }
    for (int cells : {32, 48, 64, 96, 128, 192, 256}) {
      VoxelHull voxels(bounds_, cells);
      const auto views = views_of(finest);
      const Hull* hull = nullptr;
      const double ms = timed([&] { hull = &voxels.build(views); });
      report("voxels", cells, finest, ms, *hull);
    }
  }

 private:
  std::vector<Silhouette> views_of(const std::vector<Rings>& rings) const {
    std::vector<Silhouette> views;
    for (std::size_t i = 0; i < rings.size(); ++i) views.push_back({&own_[i], &rings[i]});
    return views;
  }

  void report(const char* method, double setting, const std::vector<Rings>& rings, double ms,
              const Hull& hull) {
    const TriangleSurface surface = surface_of(hull);
    std::size_t vertices = 0;
    for (const Rings& r : rings) vertices += r.points.size();
    double own = 0.0, others = 0.0;
    for (std::size_t i = 0; i < own_.size(); ++i) {
      own += intersection_over_union(mask_of(surface, own_[i], 2), own_masks_[i]) /
             double(own_.size());
      others += intersection_over_union(mask_of(surface, others_[i], 2), other_masks_[i]) /
                double(own_.size());
    }
    const auto out = distance_between(surface, body_, 40000),
               in = distance_between(body_, surface, 40000);
    table_.row("%s,%g,%zu,%.3f,%zu,%.5f,%.5f,%.6f,%.6f,%.2f,%.2f,%.3f", method, setting, vertices,
               ms, surface.triangles.size(), own, others, volume_of(surface), volume_of(body_),
               1e3 * std::max(out.greatest, in.greatest), 1e3 * in.greatest, 1e3 * out.mean);
  }

  TriangleSurface body_;
  benchmark::Table table_;
  Bounds bounds_;
  std::vector<Camera> own_, others_;
  std::vector<Picture> own_masks_, other_masks_;
  std::vector<Rings> traced_;
};

}  // namespace
}  // namespace polyhull::test

int main(int argc, char** argv) {
  polyhull::CommandLine command(
      "hull_error_benchmark",
      "Measures the hull's error against its time and writes hull_error.csv.");
  const char* data = std::getenv("POLYHULL_DATA");
  std::string body = std::string(data ? data : "") + "/meshes/makehuman_body_metres.obj",
              output = ".";
  command.option("--body", &body, "OBJ file of a closed body in metres");
  command.option("--output", &output, "Folder for the table").existing_folder();
  return command.run(argc, argv, [&] {
    polyhull::test::Study(body, output).run();
    return 0;
  });
}
