// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/plan/forecast.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "base/thread_pool.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "refine/refine.h"
#include "silhouette/contour/contourer.h"
#include "studio/plan/placing.h"
#include "studio/plan/sights.h"

namespace polyhull {
namespace {

constexpr std::size_t samples = 10000;         // on each surface
constexpr std::size_t seen_points_each = 800;  // on each body, for what is seen
constexpr double tolerance = 0.5;              // px, of the contours
constexpr double least_step = 1.0;             // degrees from camera to camera
constexpr int longest_side = 2048;             // px of simulated pictures

std::vector<Rings> contours_of(const StageBody& body, const std::vector<Camera>& cameras) {
  std::vector<Rings> contours(cameras.size());
  parallel_each(cameras.size(), 1, 0, [&](std::size_t k) {
    const Picture picture = coverage_of(body.positions, body.triangles, cameras[k]);
    Matte matte;
    load_matte(picture.pixels.data(), picture.width, 1, picture.width, picture.height, matte);
    ContourSettings settings;
    settings.approximate.tolerance = tolerance;
    contours[k] = Contourer().find(matte, settings);
  });
  return contours;
}

/// Half way from each camera to the next around the stage.
std::vector<Camera> cameras_between(const std::vector<Camera>& cameras, const Stage& stage) {
  std::vector<std::size_t> order(cameras.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return azimuth_of(cameras[a]) < azimuth_of(cameras[b]);
  });
  std::vector<Camera> between;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Camera &from = cameras[order[k]], &to = cameras[order[(k + 1) % order.size()]];
    double step = azimuth_of(to) - azimuth_of(from);
    if (k + 1 == order.size()) step += 360.0;
    if (step < least_step) continue;  // one above the other
    const double angle = glm::radians(azimuth_of(from) + 0.5 * step);
    const double distance = 0.5 * (distance_of(from) + distance_of(to));
    const double height = 0.5 * (from.centre().y + to.centre().y);
    between.push_back(aimed(from,
                            Vec3(distance * std::sin(angle), height, distance * std::cos(angle)),
                            stage.middle()));
  }
  return between;
}

double overlap_of(const Picture& a, const Picture& b) {
  std::size_t both = 0, either = 0;
  for (std::size_t p = 0; p < a.pixels.size(); ++p) {
    const bool ours = a.pixels[p] >= 128, theirs = b.pixels[p] >= 128;
    both += ours && theirs;
    either += ours || theirs;
  }
  return either ? static_cast<double>(both) / static_cast<double>(either) : 1.0;
}

std::vector<Vec3f> positions_of(const Hull& hull) {
  std::vector<Vec3f> positions;
  for (const Vec3f& v : hull.vertices) positions.emplace_back(hull.origin + Vec3(v));
  return positions;
}

/// Adds what comes out of one body.
class Simulation {
 public:
  Simulation(const std::vector<Camera>& cameras, const Stage& stage)
      : cameras_(cameras), between_(cameras_between(cameras, stage)) {
    options_.bounds = stage.bounds();
    options_.threads = pool_threads();
    options_.reuse = false;
  }
  void add(const StageBody& body, Forecast& forecast) {
    const std::vector<Rings> contours = contours_of(body, cameras_);
    std::vector<CameraContours> views;
    for (std::size_t k = 0; k < cameras_.size(); ++k) views.push_back({&cameras_[k], &contours[k]});
    const Hull& hull = stage_.build(views, options_, 0.0);
    const TriangleSurface truth = body.surface(), rough = surface_of(hull);
    forecast.hull_mean += 500.0 * (distance_between(rough, truth, samples).mean +
                                   distance_between(truth, rough, samples).mean);
    const Hull& refined = refiner_.refine(hull, views, 1.0, {.reuse = false});
    const TriangleSurface surface = surface_of(refined);
    const SurfaceDistance out = distance_between(surface, truth, samples),
                          in = distance_between(truth, surface, samples);
    forecast.refined_mean += 500.0 * (out.mean + in.mean);
    forecast.refined_p95 += 1000.0 * std::max(out.p95, in.p95);
    for (const Camera& camera : between_) {
      forecast.overlap += overlap_of(coverage_of(positions_of(refined), refined.triangles, camera),
                                     coverage_of(body.positions, body.triangles, camera)) /
                          static_cast<double>(between_.size());
    }
  }

 private:
  const std::vector<Camera>& cameras_;
  std::vector<Camera> between_;
  HullOptions options_;
  HullStage stage_;
  HullRefiner refiner_;
};

void count_seen(const std::vector<Camera>& cameras, const std::vector<StageBody>& bodies,
                Forecast& forecast) {
  const std::vector<SurfacePoint> points = surface_points(bodies, seen_points_each);
  const std::vector<Sight> sights = sights_of(cameras, bodies, points);
  Sight all = no_sight(points.size());
  for (const Sight& sight : sights) add(sight, all);
  forecast.unseen = error_of(all).unseen;
  const auto least = static_cast<int>(255.0 * std::sin(glm::radians(15.0)));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto count = std::count_if(sights.begin(), sights.end(),
                                     [&](const Sight& sight) { return sight.facing[i] > least; });
    forecast.seen_by[std::min<std::ptrdiff_t>(count, 2)] +=
        1.0 / static_cast<double>(points.size());
  }
}

double share_of_stage(const std::vector<Camera>& cameras, const Stage& stage) {
  constexpr int steps = 20;
  const Bounds box = stage.bounds();
  int seen = 0;
  for (int i = 0; i < steps * steps * steps; ++i) {
    const Vec3 share((i % steps + 0.5) / steps, (i / steps % steps + 0.5) / steps,
                     (i / steps / steps + 0.5) / steps);
    const Vec3 point = box.min + share * (box.max - box.min);
    seen += std::all_of(cameras.begin(), cameras.end(), [&](const Camera& camera) {
      const auto p = camera.project(point);
      return p && p->x >= -0.5 && p->y >= -0.5 && p->x <= camera.width - 0.5 &&
             p->y <= camera.height - 0.5;
    });
  }
  return static_cast<double>(seen) / (steps * steps * steps);
}

}  // namespace

Forecast forecast_of(const std::vector<Camera>& cameras, const Stage& stage) {
  Forecast forecast;
  std::vector<StageBody> whole;
  forecast.cut.resize(cameras.size());
  std::vector<Camera> named = coarse(cameras, longest_side);
  // The hull's stage asks for different names.
  for (std::size_t k = 0; k < named.size(); ++k) named[k].name = fmt::format("{}", k);
  forecast.spread = spread_for(cameras, stage);
  for (StageBody& body : stage_bodies(stage, forecast.spread)) {
    ++forecast.all_places;
    bool held = true;
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      const bool its = holds(cameras[k], body);
      forecast.cut[k] += !its;
      held = held && its;
    }
    if (held) whole.push_back(std::move(body));
  }
  forecast.stage_share = share_of_stage(cameras, stage);
  forecast.places = static_cast<int>(whole.size());
  if (whole.empty()) return forecast;
  Simulation simulation(named, stage);
  for (const StageBody& body : whole) simulation.add(body, forecast);
  for (double* sum :
       {&forecast.hull_mean, &forecast.refined_mean, &forecast.refined_p95, &forecast.overlap}) {
    *sum /= static_cast<double>(whole.size());
  }
  count_seen(named, whole, forecast);
  return forecast;
}

std::string text_of(const Forecast& forecast, const std::vector<Camera>& cameras) {
  const std::string where =
      forecast.spread >= 1.0 ? "all over the stage"
      : forecast.spread > 0.0
          ? fmt::format("on the inner {:.0f} % of the stage's way to its corners",
                        100.0 * forecast.spread)
          : std::string("in the middle of the stage");
  std::string text = fmt::format(
      "a person of 1.75 m simulated {}, at {} of {} places seen whole by all cameras:\n", where,
      forecast.places, forecast.all_places);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    if (forecast.cut[k] == 0) continue;
    text += fmt::format(
        "  {} has the person not whole in its picture at {} of them: move it back, turn it, or "
        "give "
        "it a wider lens\n",
        cameras[k].name, forecast.cut[k]);
  }
  if (forecast.places > 0) {
    text += fmt::format(
        "  hull                 {:6.1f} mm from the body in the mean\n"
        "  refined surface      {:6.1f} mm, 95 % of it within {:.1f} mm\n"
        "  half way between two cameras its outline shares {:.1f} % with the body's\n"
        "  of the body's surface {:.1f} % are seen by no camera, {:.1f} % by one, {:.1f} % by "
        "more\n",
        forecast.hull_mean, forecast.refined_mean, forecast.refined_p95, 100.0 * forecast.overlap,
        100.0 * forecast.seen_by[0], 100.0 * forecast.seen_by[1], 100.0 * forecast.seen_by[2]);
  }
  return text + fmt::format("  all cameras see {:.0f} % of the stage's volume\n",
                            100.0 * forecast.stage_share);
}

std::string table_of(const std::vector<Camera>& cameras, const Stage& stage) {
  std::string text =
      "name       azimuth   distance         x         z    height      pan     tilt   looks at "
      "height   px per m   off facing\n";
  for (const Camera& camera : cameras) {
    const Vec3 centre = camera.centre(), axis = glm::transpose(camera.R) * Vec3(0, 0, 1);
    const double along = std::hypot(axis.x, axis.z);
    double off = 180.0;
    for (const Camera& other : cameras) {
      if (&other != &camera) off = std::min(off, off_facing(camera, other));
    }
    const double pan = glm::degrees(std::atan2(axis.x, axis.z)),
                 tilt = glm::degrees(std::atan2(axis.y, along));
    text += fmt::format(
        "{:10} {:7.1f}   {:6.2f} m  {:6.2f} m  {:6.2f} m  {:6.2f} m  {:7.1f}  {:7.1f}   "
        "{:13.2f} m   {:8.0f}   {:10.1f}\n",
        camera.name, azimuth_of(camera), distance_of(camera), centre.x, centre.z, centre.y,
        pan < -0.05 ? pan + 360.0 : std::abs(pan), tilt,
        centre.y + axis.y / std::max(along, 1e-6) * distance_of(camera),
        camera.K[0][0] / camera.to_camera(stage.middle()).z, off);
  }
  return text +
         "azimuth: where it stands, pan: where it looks, degrees from +z towards +x, which is\n"
         "counter-clockwise from above; tilt: degrees above the horizon; x, z from the stage's "
         "middle\n";
}

}  // namespace polyhull
