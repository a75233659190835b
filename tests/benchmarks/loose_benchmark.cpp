// SPDX-License-Identifier: LGPL-2.1-or-later
// Loose pieces and handles of refined surfaces, where silhouettes are as real ones are: bodies in
// motion seen by rings of cameras, their mattes with edges that wander, bitten, with slivers of
// background, the cameras a pixel off. One row a rig, kind of fault and quality in loose.csv; and
// of folders with a rig.json and a mask for each camera (--folder).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "command_line.h"
#include "hull/build/stage.h"
#include "hull/measure.h"
#include "measure.h"
#include "refine/refine.h"
#include "silhouette/blur/blur.h"
#include "silhouette/contour/contourer.h"
#include "studio/cameras/camera_picture.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"
#include "support/matte_damage.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::now, benchmark::Table;

/// What a surface is made of.
struct Take {
  std::string name;
  std::vector<Camera> cameras;
  std::vector<Rings> contours;
  std::optional<Bounds> bounds;
  TriangleSurface truth;  // empty: not known
  long handles = 0;
};

/// Noise that is the same over some pixels: -1 to 1, by its place on a lattice.
class SmoothNoise {
 public:
  SmoothNoise(Dice& dice, double lattice) : lattice_(lattice) {
    for (float& value : values_) value = static_cast<float>(dice.between(-1.7, 1.7));
  }
  float at(int x, int y) const {
    const auto u = static_cast<float>(x / lattice_), v = static_cast<float>(y / lattice_);
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const float a = u - static_cast<float>(i), b = v - static_cast<float>(j);
    const auto value = [&](int p, int q) { return values_[(p & 63) + 64 * (q & 63)]; };
    return (1 - b) * ((1 - a) * value(i, j) + a * value(i + 1, j)) +
           b * ((1 - a) * value(i, j + 1) + a * value(i + 1, j + 1));
  }

 private:
  double lattice_;
  float values_[64 * 64];
};

struct Fault {
  const char* name;
  double edge;    ///< px, by which edges wander; masks are black and white then
  double camera;  ///< px, by which pictures are off
  int bites, slivers;
};

constexpr Fault faults[] = {{"clean", 0.0, 0.0, 0, 0},
                            {"noisy", 1.5, 1.0, 0, 0},
                            {"bitten", 1.5, 1.0, 5, 0},
                            {"slivered", 1.5, 1.0, 0, 4}};

/// A line of foreground from somewhere on the outline.
void add_sliver(Matte& matte, Dice& dice) {
  for (int attempt = 0; attempt < 20000; ++attempt) {
    const int x = dice.whole(2, matte.width - 3), y = dice.whole(2, matte.height - 3);
    if (matte.row(y)[x] < 128 || matte.row(y)[x + 1] >= 128) continue;
    const double angle = dice.between(0.0, 6.283), length = dice.between(20.0, 80.0);
    const double half = dice.between(1.0, 2.5);
    for (double at = -3.0; at < length; at += 0.5)
      for (double across = -half; across <= half; across += 0.5) {
        const int u = static_cast<int>(x + at * std::cos(angle) - across * std::sin(angle));
        const int v = static_cast<int>(y + at * std::sin(angle) + across * std::cos(angle));
        if (u > 0 && v > 0 && u < matte.width && v < matte.height) matte.row(v)[u] = 255;
      }
    return;
  }
}

Matte spoilt(const Matte& matte, const Fault& fault, Dice& dice) {
  Matte out = matte;
  if (fault.edge > 0.0) {
    const SmoothNoise across(dice, 9.0), along(dice, 9.0);
    const double dx = fault.camera * dice.between(-1.7, 1.7),
                 dy = fault.camera * dice.between(-1.7, 1.7);
    for (int y = 0; y < matte.height; ++y)
      for (int x = 0; x < matte.width; ++x) {
        const int u = static_cast<int>(std::lround(x + dx + fault.edge * across.at(x, y)));
        const int v = static_cast<int>(std::lround(y + dy + fault.edge * along.at(x, y)));
        const bool in = u >= 0 && v >= 0 && u < matte.width && v < matte.height;
        out.row(y)[x] = in && matte.row(v)[u] >= 128 ? 255 : 0;
      }
  }
  for (int y = 0; y < out.height; ++y) find_states(out.row(y), out.width, out.state_row(y));
  for (int i = 0; i < fault.bites; ++i) damage(out, Damage::bite, dice.between(8.0, 30.0), dice);
  for (int i = 0; i < fault.slivers; ++i) add_sliver(out, dice);
  for (int y = 0; y < out.height; ++y) find_states(out.row(y), out.width, out.state_row(y));
  return out;
}

/// As gaussblur and contourfind trace it.
Rings traced(const Matte& matte) {
  Blur blur;
  Field field;
  blur.set({});
  blur.apply(matte, field);
  return Contourer().find(field, {});
}

/// Vertices less edges plus triangles of each closed surface, and its volume.
struct Piece {
  long euler = 0;
  double volume = 0.0;
  Hull surface;
};

std::vector<Piece> pieces_of(const Hull& hull) {
  const std::vector<std::uint32_t> part = connected_parts(hull);
  std::map<std::uint32_t, Piece> pieces;
  std::vector<bool> used(hull.vertices.size());
  for (const std::uint32_t v : hull.triangles) used[v] = true;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) ++pieces[part[v]].euler;
  for (std::size_t t = 0; t < hull.triangles.size(); t += 3) {
    Piece& piece = pieces[part[hull.triangles[t]]];
    piece.surface.triangles.insert(piece.surface.triangles.end(), hull.triangles.begin() + t,
                                   hull.triangles.begin() + t + 3);
  }
  std::vector<Piece> sorted;
  for (auto& [root, piece] : pieces) {
    const auto triangles = static_cast<long>(piece.surface.triangles.size() / 3);
    piece.euler -= triangles / 2;
    piece.surface.origin = hull.origin;
    piece.surface.vertices = hull.vertices;
    piece.volume = enclosed_volume(piece.surface);
    sorted.push_back(std::move(piece));
  }
  std::sort(sorted.begin(), sorted.end(),
            [](const Piece& a, const Piece& b) { return a.volume > b.volume; });
  return sorted;
}

/// How many pixels of each camera's silhouette only \p piece covers, farther than \p reach pixels from
/// where \p rest does.
std::vector<int> needed_pixels(const Take& take, const TriangleSurface& piece,
                               const TriangleSurface& rest, int reach) {
  std::vector<int> pixels;
  for (std::size_t k = 0; k < take.cameras.size(); ++k) {
    const Picture own = coverage_of(piece, take.cameras[k]),
                  others = coverage_of(rest, take.cameras[k]);
    int count = 0;
    for (int y = 0; y < own.height; ++y)
      for (int x = 0; x < own.width; ++x) {
        if (own.row(y)[x] < 128) continue;
        bool covered = false;
        for (int v = std::max(0, y - reach); v <= std::min(own.height - 1, y + reach); ++v)
          for (int u = std::max(0, x - reach); u <= std::min(own.width - 1, x + reach); ++u)
            covered |= others.row(v)[u] >= 128;
        if (!covered && is_inside(take.contours[k], Vec2(x, y))) ++count;
      }
    pixels.push_back(count);
  }
  return pixels;
}

struct Sums {
  int instants = 0, with_loose = 0, loose = 0, needed = 0, hollows = 0;
  long handles = 0, fewer = 0;
  std::uint64_t dropped = 0;
  double largest = 0.0, farthest = 0.0, mean = 0.0, p95 = 0.0, ms = 0.0, volume = 0.0;
};

struct Options {
  std::vector<std::string> rigs{"5", "8", "12"}, kinds, qualities{"good", "fine"}, folders;
  std::string output = ".";
  int instants = 20, reach = 3;
  bool each = false, no_distance = false, no_needs = false;
};

TriangleSurface joined(const std::vector<Piece>& pieces, std::size_t without) {
  TriangleSurface out;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (i == without) continue;
    const TriangleSurface some = surface_of(pieces[i].surface);
    const auto shift = static_cast<std::uint32_t>(out.vertices.size());
    out.vertices.insert(out.vertices.end(), some.vertices.begin(), some.vertices.end());
    for (const auto& t : some.triangles)
      out.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
  return out;
}

void judge(const Take& take, const Hull& surface, const Options& options, Sums& sums) {
  const std::vector<Piece> pieces = pieces_of(surface);
  ++sums.instants;
  bool any = false;
  long handles = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    handles += piece.volume < 0.0 ? 0 : 1 - piece.euler / 2;
    sums.hollows += piece.volume < 0.0;
    if (i == 0 || piece.volume < 0.0) continue;
    any = true;
    ++sums.loose;
    sums.largest = std::max(sums.largest, 1e6 * piece.volume);
    if (options.no_needs) continue;
    const TriangleSurface own = surface_of(piece.surface), rest = joined(pieces, i);
    const double far = 1e3 * distance_between(own, surface_of(pieces[0].surface), 200).mean;
    sums.farthest = std::max(sums.farthest, far);
    const std::vector<int> needed = needed_pixels(take, own, rest, options.reach);
    sums.needed += std::ranges::any_of(needed, [](int pixels) { return pixels > 0; });
    if (!options.each) continue;
    std::printf("  %s: piece of %.3f cm3, %.1f mm off; pixels that need it:", take.name.c_str(),
                1e6 * piece.volume, far);
    for (const int pixels : needed) std::printf(" %d", pixels);
    std::printf("\n");
  }
  if (handles != take.handles && options.each)
    std::printf("  %s: %ld handles, %ld in truth\n", take.name.c_str(), handles, take.handles);
  sums.with_loose += any;
  sums.handles += std::max(0l, handles - take.handles);
  sums.fewer += std::max(0l, take.handles - handles);
  sums.volume += 1e3 * pieces[0].volume;
  if (take.truth.triangles.empty() || options.no_distance) return;
  const TriangleSurface made = surface_of(surface);
  const SurfaceDistance to = distance_between(made, take.truth, 20000),
                        from = distance_between(take.truth, made, 20000);
  sums.mean += 500.0 * (to.mean + from.mean);
  sums.p95 += 1e3 * std::max(to.p95, from.p95);
}

RefineQuality quality_of(const std::string& name) {
  return name == "fast"   ? RefineQuality::fast
         : name == "fine" ? RefineQuality::fine
                          : RefineQuality::good;
}

void measure(const std::string& rig, const char* fault, const std::vector<Take>& takes,
             const Options& options, Table& table) {
  for (const std::string& quality : options.qualities) {
    Sums sums;
    HullStage stage;
    HullRefiner refiner;
    for (const Take& take : takes) {
      const auto views = camera_contours(take.cameras, take.contours);
      HullOptions hull_options;
      hull_options.bounds = take.bounds;
      const Hull& hull = stage.build(views, hull_options, 0.0);
      const double began = now(CLOCK_PROCESS_CPUTIME_ID);
      const Hull surface = refiner.refine(
          hull, views, 1.0, {.quality = quality_of(quality), .threads = 1, .reuse = false});
      sums.ms += now(CLOCK_PROCESS_CPUTIME_ID) - began;
      judge(take, surface, options, sums);
    }
    const double share = 1.0 / std::max(1, sums.instants);
    table.row("%s,%s,%s,%d,%d,%d,%d,%d,%.2f,%.1f,%ld,%ld,%.2f,%.2f,%.2f,%.2f", rig.c_str(), fault,
              quality.c_str(), sums.instants, sums.with_loose, sums.loose, sums.needed,
              sums.hollows, sums.largest, sums.farthest, sums.handles, sums.fewer,
              share * sums.volume, share * sums.mean, share * sums.p95, share * sums.ms);
  }
}

/// The figure in motion, and the body of $POLYHULL_DATA turned.
std::vector<Body> bodies(int count) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string path = std::string(data ? data : "") + "/meshes/makehuman_body_metres.obj";
  const auto figure = open_subject("figure");
  const auto human = std::filesystem::exists(path) ? open_subject(path) : figure;
  std::vector<Body> made;
  for (int i = 0; i < count; ++i) {
    const bool turned = i % 4 == 3 && human != figure;
    made.push_back({(turned ? "human-" : "figure-") + std::to_string(i), turned ? human : figure,
                    turned ? 0.2 * i : 0.35 * i});
  }
  return made;
}

/// Each kind of fault in the mattes of each of \p clean.
void measure_faults(const std::string& rig, const std::vector<Take>& clean,
                    const std::vector<std::vector<Matte>>& mattes, const Options& options,
                    Table& table) {
  for (const Fault& fault : faults) {
    if (!options.kinds.empty() &&
        std::ranges::find(options.kinds, fault.name) == options.kinds.end())
      continue;
    std::vector<Take> takes = clean;
    for (std::size_t i = 0; i < takes.size(); ++i) {
      Dice dice(1000 * i + 7);
      for (const Matte& matte : mattes[i])
        takes[i].contours.push_back(traced(spoilt(matte, fault, dice)));
    }
    measure(rig, fault.name, takes, options, table);
  }
}

void measure_rig(const std::string& name, const Options& options, Table& table) {
  const Rig rig = body_rig(name);
  std::vector<std::vector<Matte>> mattes;
  std::vector<Take> clean;
  for (const Body& body : bodies(options.instants)) {
    mattes.push_back(mattes_of(body.subject, rig, body.seconds));
    Take take{body.name, rig.cameras, {}, rig.bounds, {}, 0};
    const TruthMesh truth = truth_mesh(*body.subject, rig, body.seconds);
    Hull hull;
    for (const auto& p : truth.positions) hull.vertices.emplace_back(p);
    hull.triangles = truth.triangles;
    take.truth = surface_of(hull);
    for (const Piece& piece : pieces_of(hull))
      if (is_closed(piece.surface)) take.handles += 1 - piece.euler / 2;
    clean.push_back(std::move(take));
  }
  measure_faults(name, clean, mattes, options, table);
}

/// As it is, or with faults, where they are named, of as many instants.
void measure_folder(const std::string& folder, Options options, Table& table) {
  const Rig rig = load_rig(folder + "/rig.json");
  std::vector<Matte> mattes;
  for (const Camera& camera : rig.cameras) {
    const Picture mask = load_picture(folder + "/" + camera.name + ".png", 1);
    load_matte(mask.pixels.data(), mask.width, 1, mask.width, mask.height, mattes.emplace_back());
  }
  const std::size_t count = options.kinds.empty() ? 1 : static_cast<std::size_t>(options.instants);
  if (options.kinds.empty()) options.kinds = {"clean"};
  std::vector<Take> takes;
  for (std::size_t i = 0; i < count; ++i)
    takes.push_back({std::to_string(i), rig.cameras, {}, rig.bounds, {}, 0});
  measure_faults(folder, takes, std::vector(count, mattes), options, table);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("loose_benchmark",
                      "Counts the loose pieces and handles of refined surfaces; writes loose.csv.");
  Options options;
  command.option("--rig", &options.rigs, "Rings of that many cameras");
  command.option("--fault", &options.kinds, "Only these kinds of fault");
  command.option("--quality", &options.qualities, "Qualities");
  command.option("--instants", &options.instants, "Instants of each rig").range(0, 10000);
  command.option("--reach", &options.reach, "Pixels within which what covers a silhouette will do")
      .range(0, 100);
  command.option("--folder", &options.folders,
                 "Instead of rings, folders with a rig.json and a mask of each camera");
  command.flag("--each", &options.each, "A line for each piece");
  command.flag("--no-distance", &options.no_distance, "Leave out distances");
  command.flag("--no-needs", &options.no_needs, "Leave out which pieces are needed");
  command.option("--output", &options.output, "Folder for the table").existing_folder();
  return command.run(argc, argv, [&] {
    Table table(
        options.output + "/loose.csv",
        "rig,fault,quality,instants,with_loose,loose,needed,hollows,largest_cm3,farthest_mm,"
        "handles,handles_lost,volume_l,mean_mm,p95_mm,ms");
    for (const std::string& folder : options.folders) measure_folder(folder, options, table);
    if (options.folders.empty())
      for (const std::string& rig : options.rigs) measure_rig(rig, options, table);
    return 0;
  });
}
