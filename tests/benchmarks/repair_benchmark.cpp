// SPDX-License-Identifier: LGPL-2.1-or-later
// What hullbuild's repair mends of holes and specks in mattes, what it touches of undamaged ones,
// and what it costs: repair.tsv. The truth is the hull of the same mattes undamaged; damage is the
// volume that differs, counted at random points. Usage: repair_benchmark FOLDER [SCENES]
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "hull/build/hull_builder.h"
#include "hull/repair/repair.h"
#include "support/figure.h"
#include "support/matte_damage.h"
#include "support/membership.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

struct Row {
  const char* name;
  int cameras, holes, bites, specks;  ///< holes … in mattes taken at random
};

struct Scene {
  Rig rig;
  std::vector<Matte> mattes;
  std::vector<Rings> truth;
};

struct Sums {
  double volume = 0, before = 0, after = 0, area = 0, touched = 0;
  std::vector<double> milliseconds, sound_milliseconds, hull_milliseconds;
};

std::vector<Silhouette> views_of(const Rig& rig, const std::vector<Rings>& rings) {
  std::vector<Silhouette> views;
  for (std::size_t i = 0; i < rings.size(); ++i) views.push_back({&rig.cameras[i], &rings[i]});
  return views;
}

/// Two of three scenes are the studio's figure, the third is the walking figure of capsules.
Scene make_scene(int cameras, int number) {
  Scene scene{ring_around_person(cameras, number), {}, {}};
  const double time = 0.9 * number;
  if (number % 3 != 2) {
    scene.mattes = mattes_of(open_subject(""), scene.rig, time);
  } else {
    for (const Camera& camera : scene.rig.cameras)
      scene.mattes.push_back(
          matte_of(standing_silhouette(camera, time), camera.width, camera.height));
  }
  for (const Matte& matte : scene.mattes) scene.truth.push_back(contours_of(matte));
  return scene;
}

std::vector<Rings> mended(const Rig& rig, const std::vector<Rings>& rings,
                          const std::vector<ViewRepair>& repairs) {
  std::vector<Rings> result;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    result.push_back(without_rings(rings[i], repairs[i].leave_out));
  return result;
}

std::vector<SilhouetteMembership::Answer> inside(const Rig& rig, const std::vector<Rings>& rings,
                                                 std::span<const Vec3> points) {
  const std::vector<Silhouette> views = views_of(rig, rings);
  return SilhouetteMembership(views, {}).ask(points);
}

/// Milliseconds of processor time, the least of five.
template <class Work>
double processor_time(Work work) {
  double least = 1e300;
  for (int i = 0; i < 5; ++i) {
    timespec begin{}, end{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    work();
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    least = std::min(least, 1e3 * static_cast<double>(end.tv_sec - begin.tv_sec) +
                                1e-6 * static_cast<double>(end.tv_nsec - begin.tv_nsec));
  }
  return least;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void measure(Scene scene, const Row& row, int number, std::span<const Vec3> points, Sums& sums) {
  const RepairOptions options{.repair = Repair::both};
  const auto sound =
      mended(scene.rig, scene.truth, find_repairs(views_of(scene.rig, scene.truth), options));
  for (std::size_t i = 0; i < sound.size(); ++i) {
    sums.area += total_area(scene.truth[i]);
    sums.touched += std::abs(total_area(sound[i]) - total_area(scene.truth[i]));
  }
  sums.sound_milliseconds.push_back(
      processor_time([&] { find_repairs(views_of(scene.rig, scene.truth), options); }));
  Dice dice(100 + number);
  const auto spoil = [&](Damage kind, int count) {
    for (int i = 0; i < count; ++i)
      damage(scene.mattes[dice.whole(0, row.cameras - 1)], kind, dice.between(5.0, 60.0), dice);
  };
  spoil(Damage::hole, row.holes), spoil(Damage::bite, row.bites), spoil(Damage::speck, row.specks);
  std::vector<Rings> torn;
  for (const Matte& matte : scene.mattes) torn.push_back(contours_of(matte));
  const std::vector<Silhouette> views = views_of(scene.rig, torn);
  const std::vector<Rings> after = mended(scene.rig, torn, find_repairs(views, options));
  sums.milliseconds.push_back(processor_time([&] { find_repairs(views, options); }));
  HullBuilder builder;
  sums.hull_milliseconds.push_back(
      processor_time([&] { builder.build(views, {.bounds = scene.rig.bounds, .reuse = false}); }));
  const auto in_truth = inside(scene.rig, scene.truth, points);
  const auto in_torn = inside(scene.rig, torn, points), in_after = inside(scene.rig, after, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    sums.volume += in_truth[i] == SilhouetteMembership::inside;
    sums.before += in_truth[i] != in_torn[i];
    sums.after += in_truth[i] != in_after[i];
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: repair_benchmark FOLDER [SCENES]\n"), 2;
  const int scenes = argc > 2 ? std::atoi(argv[2]) : 24;
  constexpr Row rows[] = {
      {"3 holes", 12, 3, 0, 0},          {"3 holes", 8, 3, 0, 0},           {"8 holes", 8, 8, 0, 0},
      {"3 holes, 3 specks", 8, 3, 0, 3}, {"3 bites", 8, 0, 3, 0},           {"3 holes", 6, 3, 0, 0},
      {"2 holes", 4, 2, 0, 0},           {"2 holes, 2 specks", 4, 2, 0, 2},
  };
  Dice dice(7);
  std::vector<Vec3> points;
  for (int i = 0; i < 200000; ++i)
    points.emplace_back(dice.between(-0.8, 0.8), dice.between(-0.05, 2.0), dice.between(-0.8, 0.8));
  std::string table =
      "cameras\tdamage\tlost %\tleft %\tundone %\tof sound area touched %\tms\tms "
      "sound\tms hull\n";
  for (const Row& row : rows) {
    Sums sums;
    for (int number = 0; number < scenes; ++number)
      measure(make_scene(row.cameras, number), row, number, points, sums);
    char line[256];
    std::snprintf(line, sizeof line, "%d\t%s\t%.2f\t%.2f\t%.1f\t%.4f\t%.2f\t%.2f\t%.2f\n",
                  row.cameras, row.name, 100.0 * sums.before / sums.volume,
                  100.0 * sums.after / sums.volume, 100.0 * (1.0 - sums.after / sums.before),
                  100.0 * sums.touched / sums.area, median(sums.milliseconds),
                  median(sums.sound_milliseconds), median(sums.hull_milliseconds));
    std::fputs(line, stdout), std::fflush(stdout);
    table += line;
  }
  std::ofstream(std::string(argv[1]) + "/repair.tsv") << table;
}
