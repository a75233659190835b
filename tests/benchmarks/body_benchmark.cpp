// SPDX-License-Identifier: LGPL-2.1-or-later
// How far surfaces made from silhouettes are from the body that cast them: five bodies, rings of
// cameras, one row for each rig and method, means over the bodies. body.csv holds the rows.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>

#include "measure.h"
#include "refine/refine.h"
#include "support/body_scenes.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::median, benchmark::now, benchmark::Table;

/// A way from a scene to a surface. It is given the scene's hull, which its time does not count.
struct Method {
  const char* name;
  std::function<Hull(const BodyScene&, const Hull&)> surface;
};

std::function<Hull(const BodyScene&, const Hull&)> refined(RefineQuality quality, int threads) {
  const auto refiner = std::make_shared<HullRefiner>();
  return [=](const BodyScene& scene, const Hull& hull) {
    std::vector<CameraContours> views;
    for (std::size_t k = 0; k < scene.cameras.size(); ++k)
      views.push_back({&scene.cameras[k], &scene.contours[k]});
    return refiner->refine(hull, views, 1.0,
                           {.quality = quality, .threads = threads, .reuse = false});
  };
}

/// A new method is a line here.
std::vector<Method> methods(int threads) {
  const auto stage = std::make_shared<HullStage>();
  return {
      {"hull",
       [=](const BodyScene& scene, const Hull&) { return hull_of(scene, *stage, threads); }},
      {"fast", refined(RefineQuality::fast, threads)},
      {"good", refined(RefineQuality::good, threads)},
      {"fine", refined(RefineQuality::fine, threads)},
  };
}

/// What one method costs, and how wrong it is.
struct Row {
  BodyError error;
  double wall = 0.0, processor = 0.0;  ///< ms, medians of the runs
  double triangles = 0.0;
};

Hull run(const Method& method, const BodyScene& scene, const Hull& hull, int runs, Row& row) {
  Hull surface;
  std::vector<double> wall, processor;
  for (int i = 0; i <= runs; ++i) {  // the first is not counted
    const double began = now(CLOCK_MONOTONIC), used = now(CLOCK_PROCESS_CPUTIME_ID);
    surface = method.surface(scene, hull);
    if (i == 0 && runs > 0) continue;
    wall.push_back(now(CLOCK_MONOTONIC) - began);
    processor.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - used);
  }
  row.wall = median(wall);
  row.processor = median(processor);
  row.triangles = static_cast<double>(surface.triangles.size()) / 3.0;
  return surface;
}

/// Where a sheet shows the body: what is covered in any of its pictures, and a little around it.
Rectangle region_of(const Surface& a, const Surface& b, const Camera& camera) {
  int left = camera.width, right = 0, top = camera.height, bottom = 0;
  for (const Surface* surface : {&a, &b}) {
    for (const Vec3& v : surface->vertices) {
      const auto p = camera.project_ideal(v);
      if (!p) continue;
      left = std::min(left, static_cast<int>(p->x) - 8);
      right = std::max(right, static_cast<int>(p->x) + 9);
      top = std::min(top, static_cast<int>(p->y) - 8);
      bottom = std::max(bottom, static_cast<int>(p->y) + 9);
    }
  }
  left = std::max(left, 0);
  top = std::max(top, 0);
  return {left, top, std::min(right, camera.width) - left, std::min(bottom, camera.height) - top};
}

/// Pictures of one scene side by side, in two rows: plaster above, colours below.
class Sheet {
 public:
  Sheet(const BodyScene& scene, const Hull& hull)
      : scene_(scene),
        camera_(scene.between.front()),
        region_(region_of(scene.truth, surface_of(hull), camera_)) {}
  void add(const Hull& surface) {
    columns_.push_back({plaster(surface_of(surface), camera_), textured(surface, scene_, camera_)});
  }
  /// The truth is the last column.
  void save(const std::string& path) {
    columns_.push_back({plaster(scene_.truth, camera_), scene_.seen.front()});
    const int across = static_cast<int>(columns_.size());
    Picture sheet{across * region_.width, 2 * region_.height, 3, {}};
    sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * sheet.height * 3);
    for (int column = 0; column < across; ++column) {
      for (int row = 0; row < 2; ++row) {
        paste(columns_[static_cast<std::size_t>(column)][static_cast<std::size_t>(row)],
              column * region_.width, row * region_.height, sheet);
      }
    }
    save_picture(sheet, path);
  }

 private:
  void paste(const Picture& from, int x, int y, Picture& sheet) const {
    for (int j = 0; j < region_.height; ++j) {
      const std::uint8_t* in = from.row(region_.y + j) + from.channels * region_.x;
      std::uint8_t* out = sheet.row(y + j) + 3 * x;
      for (int i = 0; i < region_.width; ++i) std::copy_n(in + from.channels * i, 3, out + 3 * i);
    }
  }
  const BodyScene& scene_;
  Camera camera_;
  Rectangle region_;
  std::vector<std::array<Picture, 2>> columns_;
};

void add(Row& mean, const Row& row, double share) {
  const auto more = [share](double& sum, double value) { sum += share * value; };
  more(mean.error.volume, row.error.volume);
  more(mean.error.mean, row.error.mean);
  more(mean.error.hausdorff, row.error.hausdorff);
  more(mean.error.overlap, row.error.overlap);
  more(mean.error.missing, row.error.missing);
  more(mean.error.outside, row.error.outside);
  more(mean.error.psnr, row.error.psnr);
  more(mean.wall, row.wall);
  more(mean.processor, row.processor);
  more(mean.triangles, row.triangles);
}

void print(Table& table, const std::string& rig, const std::string& scene, const char* method,
           const Row& row) {
  table.row("%s,%s,%s,%.3f,%.2f,%.1f,%.4f,%.2f,%.3f,%.3f,%.2f,%.2f,%.0f", rig.c_str(),
            scene.c_str(), method, row.error.volume, row.error.mean, row.error.hausdorff,
            row.error.overlap, row.error.psnr, 100.0 * row.error.missing, 100.0 * row.error.outside,
            row.wall, row.processor, row.triangles);
}

struct Options {
  std::vector<std::string> rigs{"4", "4far", "5", "6", "7", "8", "12"}, scenes, methods;
  std::string output = ".", pictures;
  bool no_psnr = false, each = false;
  int runs = 5, threads = 2;
};

bool wanted(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

void measure_rig(const std::string& name, const std::vector<Body>& bodies, const Options& options,
                 Table& table) {
  const Rig rig = body_rig(name);
  std::vector<Method> used;
  for (const Method& method : methods(options.threads)) {
    if (wanted(options.methods, method.name)) used.push_back(method);
  }
  std::vector<Row> means(used.size());
  for (const Body& body : bodies) {
    const BodyScene scene = body_scene(rig, body);
    HullStage stage;
    const Hull& hull = hull_of(scene, stage, options.threads);
    Sheet sheet(scene, hull);
    for (std::size_t m = 0; m < used.size(); ++m) {
      Row row;
      const Hull surface = run(used[m], scene, hull, options.runs, row);
      row.error = measure(surface, scene, !options.no_psnr);
      add(means[m], row, 1.0 / static_cast<double>(bodies.size()));
      if (options.each) print(table, name, body.name, used[m].name, row);
      if (!options.pictures.empty()) sheet.add(surface);
    }
    if (!options.pictures.empty())
      sheet.save(options.pictures + "/" + name + "-" + body.name + ".png");
  }
  for (std::size_t m = 0; m < used.size(); ++m) print(table, name, "mean", used[m].name, means[m]);
}

void run_all(const Options& options) {
  const char* data = std::getenv("POLYHULL_DATA");
  std::vector<Body> bodies = study_bodies(data ? data : "");
  if (bodies.size() < 5) {
    std::printf("No MakeHuman body in POLYHULL_DATA: only the synthetic figure is measured.\n");
  }
  std::erase_if(bodies, [&](const Body& body) { return !wanted(options.scenes, body.name); });
  if (bodies.empty()) throw std::runtime_error("no scene of that name");
  Table table(options.output + "/body.csv",
              "rig,scene,method,volume,mean_mm,hausdorff95_mm,iou_between,psnr_between,missing_pct,"
              "outside_pct,wall_ms,processor_ms,triangles");
  for (const std::string& rig : options.rigs) measure_rig(rig, bodies, options, table);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures surfaces made from silhouettes against the true body; writes body.csv."};
  Options options;
  app.add_option("--rig", options.rigs,
                 "Rings of that many cameras, or 4far: 0, 90, 225, 315 degrees");
  app.add_option("--scene", options.scenes, "Only these bodies");
  app.add_option("--method", options.methods, "Only these methods");
  app.add_option("--runs", options.runs, "Runs that are timed")->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "Threads of the methods")->check(CLI::Range(1, 64));
  app.add_flag("--no-psnr", options.no_psnr, "Leave out the textured pictures' error");
  app.add_flag("--each", options.each, "A row for each body, too");
  app.add_option("--pictures", options.pictures,
                 "Folder for sheets: methods and truth side by side")
      ->check(CLI::ExistingDirectory);
  app.add_option("--output", options.output, "Folder for the table")->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  try {
    run_all(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "body_benchmark: %s\n", error.what());
    return 1;
  }
  return 0;
}
