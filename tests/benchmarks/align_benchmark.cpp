// SPDX-License-Identifier: LGPL-2.1-or-later
// What hulltexture's align=flow brings: refined surfaces of the bodies of body_benchmark, textured
// from the cameras with and without it, drawn from half way between cameras and from the cameras'
// own places, against what is to be seen there; the two takes turns in one run. Writes align.csv,
// and with --pictures sheets: without, with, the truth. --motion: the figure's walk, and how its
// pictures change from frame to frame.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "command_line.h"
#include "hull/build/stage.h"
#include "measure.h"
#include "mesh/texture_mesh.h"
#include "refine/refine.h"
#include "render/processor/processor_renderer.h"
#include "sheet.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::median, benchmark::now, benchmark::Table;

constexpr std::uint8_t grey = 24;  // the scenes'

/// The refined surface with the scene's pictures; the cameras' principal points wrong by \p wrong
/// pixels, each in a direction of its own.
Mesh mesh_of(const BodyScene& scene, double wrong) {
  HullStage stage;
  HullRefiner refiner;
  Mesh mesh;
  mesh.hull = refiner.refine(hull_of(scene, stage, 2),
                             camera_contours(scene.cameras, scene.contours), 1.0, {});
  for (std::size_t k = 0; k < scene.cameras.size(); ++k) {
    const Picture& picture = scene.pictures[k];
    MeshView out;
    out.calibration = scene.cameras[k];
    const double direction = 2.4 * static_cast<double>(k);
    out.calibration.K[2] += wrong * Vec3(std::cos(direction), std::sin(direction), 0.0);
    out.view.width = picture.width;
    out.view.height = picture.height;
    out.view.roi = {0, 0, picture.width, picture.height};
    out.view.format = PixelFormat::rgba;
    out.view.stride = 4 * picture.width;
    out.view.pixels = picture.pixels;
    mesh.views.push_back(std::move(out));
  }
  return mesh;
}

Picture drawn(const Mesh& mesh, const Camera& camera) {
  ProcessorRenderer renderer;
  RenderFrame frame;
  RenderSettings settings;
  settings.edge_samples = 8;
  frame.subjects.push_back({&mesh, {}, 1});
  frame.width = camera.width;
  frame.height = camera.height;
  frame.viewport = camera;
  Picture background{camera.width, camera.height, 4, {}};
  background.pixels.assign(static_cast<std::size_t>(camera.width) * camera.height * 4, grey);
  Picture out = background;
  const RenderPlan plan = renderer.plan(frame, settings);
  renderer.render(frame, plan, settings, background.pixels.data(), 4 * out.width, out.pixels.data(),
                  4 * out.width);
  return out;
}

/// A picture and what is to be seen.
struct Pair {
  Picture picture, truth;
};

bool counts(const Pair& pair, std::size_t p) {
  if (pair.truth.pixels[4 * p + 3] > 0) return true;
  for (std::size_t c = 0; c < 3; ++c)
    if (pair.picture.pixels[4 * p + c] != grey) return true;
  return false;
}

/// Of a picture's pixels against the truth.
struct Error {
  double sum = 0.0, count = 0.0;
  double psnr() const { return 10.0 * std::log10(255.0 * 255.0 * count / std::max(sum, 1e-9)); }
};

/// Over the pixels that the body or the surface covers; with \p other only those that differ from it
/// by more than two codes.
void add_error(const Pair& pair, const Picture* other, Error& error) {
  for (std::size_t p = 0; p < pair.picture.pixels.size() / 4; ++p) {
    if (!counts(pair, p)) continue;
    int differs = 0;
    double sum = 0.0;
    for (std::size_t i = 4 * p; i < 4 * p + 3; ++i) {
      const double off = pair.picture.pixels[i] - pair.truth.pixels[i];
      sum += off * off;
      if (other) differs = std::max(differs, std::abs(pair.picture.pixels[i] - other->pixels[i]));
    }
    if (other && differs <= 2) continue;
    error.sum += sum;
    error.count += 3.0;
  }
}

/// The mean change from one pair to the next, codes: the picture's over the truth's.
double flicker(const Pair& last, const Pair& next) {
  double ours = 0.0, theirs = 0.0;
  for (std::size_t p = 0; p < next.picture.pixels.size() / 4; ++p) {
    if (!counts(next, p)) continue;
    for (std::size_t i = 4 * p; i < 4 * p + 3; ++i) {
      ours += std::pow(next.picture.pixels[i] - last.picture.pixels[i], 2.0);
      theirs += std::pow(next.truth.pixels[i] - last.truth.pixels[i], 2.0);
    }
  }
  return std::sqrt(ours / theirs);
}

/// Side by side, what is not background of the last.
void save(const std::vector<Picture>& pictures, const std::string& path) {
  const Picture& truth = pictures.back();
  int left = truth.width, right = 0, top = truth.height, bottom = 0;
  for (int y = 0; y < truth.height; ++y)
    for (int x = 0; x < truth.width; ++x) {
      if (truth.row(y)[4 * x + 3] == 0) continue;
      left = std::min(left, x);
      right = std::max(right, x + 1);
      top = std::min(top, y);
      bottom = y + 1;
    }
  const int count = static_cast<int>(pictures.size());
  benchmark::Sheet sheet(count, 1, {left, top, right - left, bottom - top});
  for (int n = 0; n < count; ++n) sheet.put(pictures[static_cast<std::size_t>(n)], n, 0);
  sheet.save(path);
}

struct Options {
  std::vector<std::string> rigs{"4", "4far", "5", "8"}, scenes;
  std::string output = ".", pictures, metric = "viewing-angle";
  int runs = 5, threads = 1;
  double wrong = 0.0;
  bool motion = false;
};

/// Pictures from some places without and with.
struct Gain {
  double psnr[2] = {};  ///< means over the places
  double least = 99.0;  ///< of the worst place
  Error where[2];       ///< where the two differ
  void add(const Gain& other, double share) {
    for (int way = 0; way < 2; ++way) {
      psnr[way] += share * other.psnr[way];
      where[way].sum += other.where[way].sum;
      where[way].count += other.where[way].count;
    }
    least = std::min(least, other.least);
  }
};

struct Row {
  Gain between, own;
  double cost[2] = {};
};

void texture(Mesh& mesh, bool align, const Options& options) {
  TextureSettings settings;
  settings.metric = options.metric == "camera-normal" ? TextureMetric::camera_normal
                                                      : TextureMetric::viewing_angle;
  settings.align = align ? TextureAlign::flow : TextureAlign::off;
  settings.threads = options.threads;
  texture_mesh(mesh, settings);  // anew: nothing is known of the last
}

Gain measure(const Mesh (&meshes)[2], const std::vector<Camera>& cameras,
             const std::vector<Picture>& truths) {
  Gain gain;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    const Pair pairs[2] = {{drawn(meshes[0], cameras[k]), truths[k]},
                           {drawn(meshes[1], cameras[k]), truths[k]}};
    Error all[2];
    for (int way = 0; way < 2; ++way) {
      add_error(pairs[way], nullptr, all[way]);
      add_error(pairs[way], &pairs[1 - way].picture, gain.where[way]);
      gain.psnr[way] += all[way].psnr() / static_cast<double>(cameras.size());
    }
    gain.least = std::min(gain.least, all[1].psnr() - all[0].psnr());
  }
  return gain;
}

Row measure_scene(const std::string& rig, const BodyScene& scene, const Options& options) {
  Row row;
  const Mesh mesh = mesh_of(scene, options.wrong);
  Mesh meshes[2] = {mesh, mesh};
  std::vector<double> costs[2];
  for (int run = 0; run <= options.runs; ++run)
    for (int way = 0; way < 2; ++way) {
      const double used = now(CLOCK_PROCESS_CPUTIME_ID);
      texture(meshes[way], way == 1, options);
      if (run > 0) costs[way].push_back(now(CLOCK_PROCESS_CPUTIME_ID) - used);
    }
  for (int way = 0; way < 2; ++way) row.cost[way] = median(costs[way]);
  row.between = measure(meshes, scene.between, scene.seen);
  row.own = measure(meshes, scene.cameras, scene.pictures);
  if (!options.pictures.empty())
    for (std::size_t k = 0; k < scene.between.size(); k += 2)
      save(
          {drawn(meshes[0], scene.between[k]), drawn(meshes[1], scene.between[k]), scene.seen[k]},
          options.pictures + "/align-" + rig + "-" + scene.name + "-" + std::to_string(k) + ".png");
  return row;
}

void print(Table& table, const std::string& rig, const std::string& scene, const Row& row) {
  const auto gain = [](const Error(&where)[2]) {
    return where[0].count > 0.0 ? where[1].psnr() - where[0].psnr() : 0.0;
  };
  table.row("%s,%s,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f", rig.c_str(), scene.c_str(),
            row.between.psnr[0], row.between.psnr[1], row.between.least, gain(row.between.where),
            row.own.psnr[0], row.own.psnr[1], row.own.least, gain(row.own.where),
            row.cost[1] - row.cost[0]);
}

void add(Row& mean, const Row& row, double share) {
  mean.between.add(row.between, share);
  mean.own.add(row.own, share);
  for (int way = 0; way < 2; ++way) mean.cost[way] += share * row.cost[way];
}

/// Frames of the figure's walk from half way between the first two cameras.
void measure_motion(const std::string& name, const test::Body& figure, const Options& options) {
  const Rig rig = body_rig(name);
  Pair last[2];
  double sum[2] = {};
  constexpr int frames = 8;
  for (int frame = 0; frame <= frames; ++frame) {
    test::Body body = figure;
    body.seconds = 2.0 + frame / 25.0;
    const BodyScene scene = body_scene(rig, body);
    Mesh mesh = mesh_of(scene, options.wrong);
    for (int way = 0; way < 2; ++way) {
      texture(mesh, way == 1, options);
      Pair next{drawn(mesh, scene.between.front()), scene.seen.front()};
      if (frame > 0) sum[way] += flicker(last[way], next) / frames;
      last[way] = std::move(next);
    }
  }
  std::printf("%s: change from frame to frame over the truth's: off %.3f, flow %.3f\n",
              name.c_str(), sum[0], sum[1]);
}

void run_all(const Options& options) {
  const char* data = std::getenv("POLYHULL_DATA");
  std::vector<test::Body> bodies = study_bodies(data ? data : "");
  if (options.motion) {
    for (const std::string& name : options.rigs) measure_motion(name, bodies.front(), options);
    return;
  }
  std::erase_if(bodies, [&](const test::Body& body) {
    return !options.scenes.empty() && std::find(options.scenes.begin(), options.scenes.end(),
                                                body.name) == options.scenes.end();
  });
  Table table(options.output + "/align.csv",
              "rig,scene,between_off,between_flow,between_least_gain,between_where_it_acts,own_off,"
              "own_flow,own_least_gain,own_where_it_acts,flow_ms");
  for (const std::string& name : options.rigs) {
    const Rig rig = body_rig(name);
    Row mean;
    for (const test::Body& body : bodies) {
      const Row row = measure_scene(name, body_scene(rig, body), options);
      print(table, name, body.name, row);
      add(mean, row, 1.0 / static_cast<double>(bodies.size()));
    }
    print(table, name, "mean", mean);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("align_benchmark",
                      "Measures what hulltexture's align=flow brings; writes align.csv.");
  Options options;
  command.option("--rig", &options.rigs, "As body_benchmark's");
  command.option("--scene", &options.scenes, "Only these bodies");
  command.option("--metric", &options.metric, "viewing-angle or camera-normal");
  command.option("--wrong", &options.wrong, "Pixels by which the cameras' calibration is wrong");
  command.option("--runs", &options.runs, "Runs that are timed").range(1, 1000);
  command.option("--threads", &options.threads, "Threads of the texturing");
  command.flag("--motion", &options.motion, "Measure the walk instead");
  command.option("--pictures", &options.pictures, "Folder for sheets").existing_folder();
  command.option("--output", &options.output, "Folder for the table").existing_folder();
  return command.run(argc, argv, [&] {
    run_all(options);
    return 0;
  });
}
