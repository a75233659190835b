// SPDX-License-Identifier: LGPL-2.1-or-later
// How near calibrations come to the truth: errors of centre, rotation, focal length and distortion
// against the noise of the corners and the number of cameras, into calibration.csv, which
// calibration_plots.gp draws.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "base/stopwatch.h"
#include "command_line.h"
#include "support/calibration_takes.h"

using namespace polyhull;
using namespace polyhull::calibration;

namespace {

// Root mean squares over cameras and takes.
struct Row {
  double centre = 0.0, rotation = 0.0, focal = 0.0, k1 = 0.0, rms = 0.0, sure = 0.0, seconds = 0.0;
  double views = 0.0;
};

Row measure(int cameras, double noise, int takes) {
  Row row;
  for (int take = 0; take < takes; ++take) {
    RingSettings settings;
    settings.cameras = cameras;
    settings.noise = noise;
    settings.board = {13, 8, 0.08};
    settings.instants = 160;
    settings.near_views = 30;
    settings.seed = static_cast<unsigned>(1 + take);
    const TrueTake truth = make_ring(settings);
    const Stopwatch watch;
    const Calibration found = calibrate(truth.take, {});
    row.seconds += watch.seconds() / takes;
    const std::vector<CameraError> errors = errors_of(found.rig.cameras, truth.cameras);
    const double share = 1.0 / (takes * cameras);
    for (std::size_t c = 0; c < errors.size(); ++c) {
      const double focal = errors[c].lens[0] / truth.cameras[c].K[0][0];
      row.centre += share * glm::dot(errors[c].centre, errors[c].centre);
      row.rotation += share * glm::dot(errors[c].rotation, errors[c].rotation);
      row.focal += share * focal * focal;
      row.k1 += share * errors[c].lens[4] * errors[c].lens[4];
      row.sure += share * found.cameras[c].centre_sigma * found.cameras[c].centre_sigma;
    }
    row.rms += found.adjusted.rms / std::sqrt(2.0) / takes;
    row.views += static_cast<double>(truth.take.views.size()) / cameras / takes;
  }
  return row;
}

}  // namespace

int main(int count, char** values) {
  CommandLine command("calibration_benchmark",
                      "Errors of calibrations against noise and number of cameras.");
  std::string output = ".";
  int takes = 3;
  command.option("--output", &output, "Folder for calibration.csv");
  command.option("--takes", &takes, "Takes per row");
  if (const auto status = command.parse(count, values)) return *status;
  std::ofstream table(output + "/calibration.csv");
  table << "cameras,noise,views,centre_mm,centre_sigma_mm,rotation_deg,focal_percent,k1,rms_px,"
           "seconds\n";
  for (const int cameras : {4, 8, 16}) {
    for (const double noise : {0.1, 0.25, 0.5, 1.0}) {
      const Row row = measure(cameras, noise, takes);
      const std::string line =
          fmt::format("{},{},{:.0f},{:.4f},{:.4f},{:.5f},{:.5f},{:.6f},{:.4f},{:.2f}\n", cameras,
                      noise, row.views, 1e3 * std::sqrt(row.centre), 1e3 * std::sqrt(row.sure),
                      glm::degrees(std::sqrt(row.rotation)), 1e2 * std::sqrt(row.focal),
                      std::sqrt(row.k1), row.rms, row.seconds);
      table << line;
      std::printf("%s", line.c_str());
      std::fflush(stdout);
    }
  }
  return 0;
}
