// SPDX-License-Identifier: LGPL-2.1-or-later
#include "body_motion.h"
#include "hull/build/stage.h"

#include <algorithm>
#include <cmath>

namespace polyhull::benchmark {

using namespace test;

namespace {

constexpr double noise = 0.5;         // px
constexpr double first_second = 2.0;  // the figure walks at an even speed from 1.3 to 5 s
constexpr double frame_seconds = 0.04;
constexpr int frames = 25;

/// Steps from frame to frame, mm.
struct Steps {
  std::vector<double> lengths;
  TriangleSurface last;

  void add(const TriangleSurface& surface) {
    if (!last.triangles.empty()) lengths.push_back(distance_mm(last, surface));
    last = surface;
  }
  double mean() const {
    double sum = 0.0;
    for (const double length : lengths) sum += length;
    return sum / static_cast<double>(lengths.size());
  }
};

/// What noise moves the surface of each method, mm.
std::vector<double> moved_by_noise(const Rig& rig, const std::vector<Body>& bodies,
                                   const std::vector<Method>& methods) {
  std::vector<double> moved(methods.size(), 0.0);
  HullStage stage;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const BodyScene still = body_scene(rig, bodies[b], false);
    const BodyScene one = with_noise(still, noise, 2 * b + 1);
    const BodyScene other = with_noise(still, noise, 2 * b + 2);
    const Hull one_hull = hull_of(one, stage, 0), other_hull = hull_of(other, stage, 0);
    for (std::size_t m = 0; m < methods.size(); ++m) {
      const TriangleSurface from = surface_of(methods[m].surface(one, one_hull));
      const TriangleSurface to = surface_of(methods[m].surface(other, other_hull));
      moved[m] += distance_mm(from, to) / static_cast<double>(bodies.size());
    }
  }
  return moved;
}

/// The steps of the truth, and then of each method.
std::vector<Steps> walk(const Rig& rig, const std::vector<Method>& methods) {
  std::vector<Steps> steps(methods.size() + 1);
  HullStage stage;
  Body figure{"walking", open_subject("figure"), 0.0};
  for (int i = 0; i < frames; ++i) {
    figure.seconds = first_second + i * frame_seconds;
    const BodyScene scene = body_scene(rig, figure, false);
    const Hull& hull = hull_of(scene, stage, 0);
    steps[0].add(scene.truth);
    for (std::size_t m = 0; m < methods.size(); ++m) {
      steps[m + 1].add(surface_of(methods[m].surface(scene, hull)));
    }
  }
  return steps;
}

double worst(const Steps& steps, const Steps& truth) {
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.lengths.size(); ++i) {
    worst = std::max(worst, std::abs(steps.lengths[i] / truth.lengths[i] - 1.0));
  }
  return worst;
}

}  // namespace

void measure_motion(const std::string& rig_name, const std::vector<Body>& bodies,
                    const std::vector<Method>& methods, Table& table) {
  const Rig rig = body_rig(rig_name);
  std::vector<Method> all = methods;
  const auto hull = std::find_if(methods.begin(), methods.end(), [](const Method& method) {
    return method.name == std::string("hull");
  });
  const auto reference = static_cast<std::size_t>(hull - methods.begin());
  if (hull == methods.end()) all.push_back(body_methods(0).front());
  const std::vector<double> moved = moved_by_noise(rig, bodies, all);
  const std::vector<Steps> steps = walk(rig, methods);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    table.row("%s,%s,%.2f,%.3f,%.2f,%.3f,%.3f", rig_name.c_str(), methods[m].name, moved[m],
              moved[m] / moved[reference], steps[m + 1].mean(),
              steps[m + 1].mean() / steps[0].mean(), worst(steps[m + 1], steps[0]));
  }
  table.row("%s,truth,,,%.2f,1,0", rig_name.c_str(), steps[0].mean());
}

}  // namespace polyhull::benchmark
