// SPDX-License-Identifier: LGPL-2.1-or-later
// Which cameras should colour a body: the error of the refined surface's picture by hulltexture's
// metric and number of cameras, from where the cameras stand, a quarter of the way and half way to
// the next; cameras.csv, means over the bodies.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <numeric>

#include "body_methods.h"
#include "command_line.h"
#include "hull/build/stage.h"
#include "measure.h"
#include "support/body_scenes.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::Method, benchmark::Table;

constexpr std::array shares = {0.0, 0.25, 0.5};  // of the way to the next camera

struct Way {
  const char* name;
  TextureMetric metric;
};
constexpr Way ways[] = {
    {"camera-normal", TextureMetric::camera_normal},
    {"viewing-angle", TextureMetric::viewing_angle},
    {"lumigraph", TextureMetric::lumigraph},
};

struct Options {
  std::vector<std::string> rigs{"4far", "5", "8"}, scenes;
  std::vector<int> cameras{1, 2, 3, 4};
  std::string output = ".", method = "good";
  bool each = false;
};

/// By way, number of cameras and share, dB.
using Sums = std::vector<std::array<double, shares.size()>>;

Sums measure_body(const std::string& rig_name, const Body& body, const Method& method,
                  const Options& options) {
  const Rig rig = body_rig(rig_name);
  const BodyScene scene = body_scene(rig, body, false);
  HullStage stage;
  const Hull surface = method.surface(scene, hull_of(scene, stage, 2));
  Sums sums(std::size(ways) * options.cameras.size());
  for (std::size_t s = 0; s < shares.size(); ++s) {
    const std::vector<Camera> from = cameras_between(scene.cameras, shares[s]);
    const std::vector<Picture> seen = pictures_of(rig, from, body);
    std::size_t row = 0;
    for (const Way& way : ways) {
      for (const int cameras : options.cameras) {
        TextureSettings settings;
        settings.metric = way.metric;
        settings.cameras = static_cast<std::uint32_t>(cameras);
        const std::vector<double> psnr = psnr_from(surface, scene, settings, from, seen);
        sums[row++][s] =
            std::accumulate(psnr.begin(), psnr.end(), 0.0) / static_cast<double>(psnr.size());
      }
    }
  }
  return sums;
}

void print(Table& table, const std::string& rig, const std::string& body, const Options& options,
           const Sums& sums) {
  std::size_t row = 0;
  for (const Way& way : ways) {
    for (const int cameras : options.cameras) {
      const auto& psnr = sums[row++];
      table.row("%s,%s,%s,%d,%.2f,%.2f,%.2f", rig.c_str(), body.c_str(), way.name, cameras, psnr[0],
                psnr[1], psnr[2]);
    }
  }
}

void run_all(const Options& options) {
  const char* data = std::getenv("POLYHULL_DATA");
  std::vector<Body> bodies = study_bodies(data ? data : "");
  std::erase_if(bodies, [&](const Body& body) {
    return !options.scenes.empty() && std::find(options.scenes.begin(), options.scenes.end(),
                                                body.name) == options.scenes.end();
  });
  std::vector<Method> methods = benchmark::body_methods(2);
  std::erase_if(methods, [&](const Method& m) { return m.name != options.method; });
  if (bodies.empty() || methods.empty()) throw std::runtime_error("no such scene or method");
  Table table(options.output + "/cameras.csv",
              "rig,scene,metric,cameras,psnr_at,psnr_quarter,psnr_between");
  for (const std::string& rig : options.rigs) {
    Sums means;
    for (const Body& body : bodies) {
      const Sums sums = measure_body(rig, body, methods.front(), options);
      if (options.each) print(table, rig, body.name, options, sums);
      means.resize(sums.size());
      for (std::size_t i = 0; i < sums.size(); ++i)
        for (std::size_t s = 0; s < shares.size(); ++s)
          means[i][s] += sums[i][s] / static_cast<double>(bodies.size());
    }
    print(table, rig, "mean", options, means);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("cameras_benchmark",
                      "Measures which cameras should colour a body; writes cameras.csv.");
  Options options;
  command.option("--rig", &options.rigs, "Rings of that many cameras, or 4far");
  command.option("--scene", &options.scenes, "Only these bodies");
  command.option("--method", &options.method, "The surface: hull, fast, good or fine");
  command.option("--cameras", &options.cameras, "How many are blended");
  command.flag("--each", &options.each, "A row for each body, too");
  command.option("--output", &options.output, "Folder for the table").existing_folder();
  return command.run(argc, argv, [&] {
    run_all(options);
    return 0;
  });
}
