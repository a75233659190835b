// SPDX-License-Identifier: LGPL-2.1-or-later
// What hulltexture's memory=on brings: the figure moves before a few cameras, and at every twentieth
// frame its refined surface (or its hull), textured with and without memory, is drawn from places
// where no camera stands, against what is to be seen there. Writes memory.csv, and with --pictures
// sheets: without, with, the truth.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "command_line.h"
#include "hull/build/stage.h"
#include "measure.h"
#include "mesh/texture_mesh.h"
#include "refine/refine.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using polyhull::benchmark::median, polyhull::benchmark::now, polyhull::benchmark::Table;

/// A subject as it is at one instant, turning about the vertical once in ten seconds times \p speed.
class Turning : public Subject {
 public:
  Turning(std::shared_ptr<const Subject> body, double instant, double speed)
      : body_(std::move(body)), instant_(instant), speed_(speed) {
    triangles_ = body_->triangles();
    vertex_count_ = body_->vertex_count();
  }
  void pose(double seconds, SubjectFrame& frame) const override {
    body_->pose(instant_, frame);
    const double a = speed_ * 2.0 * std::numbers::pi / 10.0 * seconds;
    const Mat3 turn(Vec3(std::cos(a), 0, -std::sin(a)), Vec3(0, 1, 0),
                    Vec3(std::sin(a), 0, std::cos(a)));
    for (Vec3f& p : frame.positions) p = Vec3f(turn * Vec3(p));
    for (Vec3f& n : frame.normals) n = Vec3f(turn * Vec3(n));
  }
  Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float width) const override {
    return body_->albedo(triangle, at, width);
  }

 private:
  std::shared_ptr<const Subject> body_;
  double instant_, speed_;
};

/// A picture's part.
struct Crop {
  Rectangle box;
  std::vector<std::uint8_t> pixels;
};

struct Frame {
  Hull surface;
  std::vector<Crop> pictures, truths;
};

struct Take {
  Rig rig;
  std::vector<Camera> viewers;
  std::vector<Frame> frames;
};

Crop cropped(const Picture& picture) {
  Crop out;
  int left = picture.width, right = 0, top = picture.height, bottom = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      if (picture.row(y)[4 * x + 3] == 0) continue;
      left = std::min(left, x), right = std::max(right, x + 1);
      top = std::min(top, y), bottom = y + 1;
    }
  left = std::max(left - 8, 0), top = std::max(top - 8, 0);
  right = std::min(right + 8, picture.width), bottom = std::min(bottom + 8, picture.height);
  out.box = {left, top, right - left, bottom - top};
  for (int y = top; y < bottom; ++y)
    out.pixels.insert(out.pixels.end(), picture.row(y) + 4 * left, picture.row(y) + 4 * right);
  return out;
}

struct Options {
  std::vector<std::string> scenes{"turn-half", "walk-half", "walk-3", "walk-4"};
  std::string output = ".", pictures;
  int every = 20, frames = 241, threads = 1;
  bool hull = false;
};

std::vector<double> azimuths(const std::string& name) {
  if (name == "half") return {0.0, 60.0, 120.0};
  if (name == "3") return {0.0, 120.0, 240.0};
  if (name == "4") return {0.0, 90.0, 180.0, 270.0};
  return {0.0, 90.0, 225.0, 315.0};
}

std::vector<double> viewpoints(const std::string& name) {
  if (name == "half") return {210.0, 270.0, 330.0};
  if (name == "3") return {60.0, 180.0, 300.0};
  if (name == "4") return {45.0, 135.0, 225.0, 315.0};
  return {45.0, 157.0, 270.0};
}

Frame frame_of(const Take& take, const std::shared_ptr<const Subject>& subject, double seconds,
               HullRefiner& refiner, bool plain) {
  const Body body{"figure", subject, seconds};
  BodyScene scene = body_scene(take.rig, body, false);
  HullStage stage;
  Frame out;
  const Hull& hull = hull_of(scene, stage, 0);
  out.surface =
      plain ? hull : refiner.refine(hull, camera_contours(scene.cameras, scene.contours), 1.0, {});
  for (const Picture& p : scene.pictures) out.pictures.push_back(cropped(p));
  for (const Picture& p : pictures_of(take.rig, take.viewers, body))
    out.truths.push_back(cropped(p));
  return out;
}

Take record(const std::string& name, const Options& options) {
  const std::size_t dash = name.find('-');
  const std::string motion = name.substr(0, dash), rig = name.substr(dash + 1);
  Take take;
  take.rig = body_rig(azimuths(rig));
  take.viewers = body_rig(viewpoints(rig)).cameras;
  std::shared_ptr<const Subject> subject = open_subject("figure");
  if (motion != "walk")
    subject = std::make_shared<Turning>(subject, 7.0, motion == "turn" ? 1.0 : 0.0);
  HullRefiner refiner;
  for (int n = 0; n < options.frames; ++n)
    take.frames.push_back(frame_of(take, subject, 0.04 * n, refiner, options.hull));
  return take;
}

Mesh mesh_of(const Take& take, std::size_t n) {
  Mesh mesh;
  mesh.hull = take.frames[n].surface;
  mesh.capture_time = 40'000'000 * static_cast<std::int64_t>(n);
  for (std::size_t k = 0; k < take.rig.cameras.size(); ++k) {
    const Crop& crop = take.frames[n].pictures[k];
    MeshView out;
    out.calibration = take.rig.cameras[k];
    out.view.camera = out.calibration.name;
    out.view.width = out.calibration.width;
    out.view.height = out.calibration.height;
    out.view.roi = crop.box;
    out.view.format = PixelFormat::rgba;
    out.view.stride = 4 * crop.box.width;
    out.view.pixels = crop.pixels;
    mesh.views.push_back(std::move(out));
  }
  return mesh;
}

/// Of pictures against the truth.
struct Error {
  double sum = 0.0, count = 0.0;
  double psnr() const { return 10.0 * std::log10(255.0 * 255.0 * count / std::max(sum, 1e-9)); }
};

/// Without and with: over the subject, and where the two differ by more than two codes.
struct Pair {
  Error all[2], where[2];
  double gain() const { return all[1].psnr() - all[0].psnr(); }
};

void add(const Picture (&pictures)[2], const Crop& truth, Pair& pair) {
  for (int y = 0; y < truth.box.height; ++y)
    for (int x = 0; x < truth.box.width; ++x) {
      const std::uint8_t* t =
          &truth.pixels[4 * (static_cast<std::size_t>(y) * truth.box.width + x)];
      if (t[3] < 255) continue;
      const std::size_t at = 4 * static_cast<std::size_t>(truth.box.x + x);
      const std::uint8_t* p[2] = {pictures[0].row(truth.box.y + y) + at,
                                  pictures[1].row(truth.box.y + y) + at};
      int differs = 0;
      double off[2] = {};
      for (int c = 0; c < 3; ++c) {
        differs = std::max(differs, std::abs(p[0][c] - p[1][c]));
        for (int way = 0; way < 2; ++way) off[way] += (p[way][c] - t[c]) * (p[way][c] - t[c]);
      }
      for (int way = 0; way < 2; ++way) {
        pair.all[way].sum += off[way];
        pair.all[way].count += 3.0;
        if (differs <= 2) continue;
        pair.where[way].sum += off[way];
        pair.where[way].count += 3.0;
      }
    }
}

/// Side by side, the truth's part.
void save(const Picture (&pictures)[2], const Crop& truth, const std::string& path) {
  const Rectangle& box = truth.box;
  Picture sheet{3 * box.width, box.height, 3, {}};
  sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * sheet.height * 3);
  for (int y = 0; y < box.height; ++y)
    for (int x = 0; x < 3 * box.width; ++x) {
      const int n = x / box.width, column = x % box.width;
      const std::uint8_t* from =
          n < 2 ? pictures[n].row(box.y + y) + 4 * (box.x + column)
                : &truth.pixels[4 * (static_cast<std::size_t>(y) * box.width + column)];
      std::copy_n(from, 3, sheet.row(y) + 3 * x);
    }
  save_picture(sheet, path);
}

void measure(const std::string& name, const Options& options, Table& table) {
  const Take take = record(name, options);
  MeshTexturer texturers[2];
  std::vector<double> times[2];
  Pair total;
  double worst = 99.0;
  for (std::size_t n = 0; n < take.frames.size(); ++n) {
    Mesh meshes[2] = {mesh_of(take, n), mesh_of(take, n)};
    for (int way = 0; way < 2; ++way) {
      TextureSettings settings;
      settings.metric = TextureMetric::lumigraph;
      settings.memory = way == 1;
      settings.threads = options.threads;
      const double before = now(CLOCK_PROCESS_CPUTIME_ID);
      texturers[way].texture(meshes[way], settings);
      times[way].push_back(now(CLOCK_PROCESS_CPUTIME_ID) - before);
    }
    if (n % options.every != 0) continue;
    Pair here;
    for (std::size_t v = 0; v < take.viewers.size(); ++v) {
      const Picture pictures[2] = {drawn(meshes[0], take.viewers[v]),
                                   drawn(meshes[1], take.viewers[v])};
      add(pictures, take.frames[n].truths[v], here);
      if (!options.pictures.empty())
        save(pictures, take.frames[n].truths[v],
             options.pictures + "/" + name + "-" + std::to_string(n) + "-" + std::to_string(v) +
                 ".png");
    }
    worst = std::min(worst, here.gain());
    for (int way = 0; way < 2; ++way) {
      total.all[way].sum += here.all[way].sum, total.all[way].count += here.all[way].count;
      total.where[way].sum += here.where[way].sum, total.where[way].count += here.where[way].count;
    }
  }
  const MemoryStatistics& last = texturers[1].memory_statistics();
  const bool acts = total.where[0].count > 0.0;
  table.row("%s,%.2f,%.2f,%.2f,%.1f,%.2f,%.1f,%.1f,%zu,%.2f,%.1f,%.1f", name.c_str(),
            total.all[0].psnr(), total.all[1].psnr(), worst,
            100.0 * total.where[0].count / total.all[0].count,
            acts ? total.where[1].psnr() - total.where[0].psnr() : 0.0, median(times[0]),
            median(times[1]), last.points, last.trust, last.error, last.error_without);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CommandLine command("memory_benchmark", "What remembered colours bring");
  command.option("--output", &options.output, "folder of memory.csv");
  command.option("--pictures", &options.pictures, "folder for sheets");
  command.option("--scenes", &options.scenes, "MOTION-RIG: turn, walk, stand; half, 3, 4, 4far");
  command.option("--every", &options.every, "which frames are drawn");
  command.option("--frames", &options.frames, "of 40 ms");
  command.option("--threads", &options.threads, "");
  command.flag("--hull", &options.hull, "not the refined surface");
  if (const auto status = command.parse(argc, argv)) return *status;
  Table table(
      options.output + "/memory.csv",
      "scene,without_db,with_db,least_gain,acts_percent,gain_where,ms_without,ms_with,points,"
      "trust,error,error_without");
  for (const std::string& name : options.scenes) measure(name, options, table);
}
