// SPDX-License-Identifier: LGPL-2.1-or-later
// What texturing costs: medians of wall and processor time on two threads and of processor time on
// one, of a body of 36,000 triangles and of the hull, in rings of cameras; and how much of the
// visible area is judged as rays judge it.
#include <cstdio>

#include "measure.h"
#include "seen_truth.h"
#include "studio_mesh.h"
#include "texture/texture_hull.h"
#include "texture/visibility.h"

namespace {

using namespace polyhull;
using benchmark::median, benchmark::now;

struct Times {
  double wall = 0.0, processor = 0.0, visibility = 0.0, weights = 0.0;
};

Times measure(const Hull& hull, std::span<const Camera> cameras, int threads, int rounds) {
  HullTexturer texturer;
  std::vector<double> wall, processor, visibility, weights;
  for (int round = -2; round < rounds; ++round) {
    TextureSettings settings{.metric = TextureMetric::camera_normal};
    settings.threads = threads;
    settings.fade_width += 1e-6 * round;  // so that nothing is reused
    const double wall_before = now(CLOCK_MONOTONIC), before = now(CLOCK_PROCESS_CPUTIME_ID);
    texturer.texture(hull, cameras, settings);
    if (round < 0) continue;
    processor.push_back(now(CLOCK_PROCESS_CPUTIME_ID) - before);
    wall.push_back(now(CLOCK_MONOTONIC) - wall_before);
    visibility.push_back(1e3 * texturer.statistics().seconds_visibility);
    weights.push_back(1e3 * texturer.statistics().seconds_weights);
  }
  return {median(wall), median(processor), median(visibility), median(weights)};
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 30;
  benchmark::Table table(std::string(argc > 1 ? argv[1] : ".") + "/texture.csv",
                         "mesh,triangles,cameras,wall_ms,processor_ms,one_thread_ms,visibility_ms,"
                         "weights_ms,sampled_percent,agreement_percent");
  const Hull body = test::dense_body();
  for (const bool dense : {true, false}) {
    for (const int count : {4, 8}) {
      const Rig rig = test::ring_rig(count);
      const Hull hull = dense ? body : test::studio_mesh(rig, "figure", 3.0, {}).mesh.hull;
      const std::vector<float> truth = test::seen_by_rays(hull, rig.cameras);
      std::vector<Sight> sights(rig.cameras.size());
      const MeshFaces faces = find_faces(hull, 0);
      Seer seer;
      std::uint64_t pieces = 0, sampled = 0;
      for (std::size_t k = 0; k < sights.size(); ++k) {
        seer.look(hull, faces, rig.cameras[k], static_cast<int>(k), {}, sights[k]);
        pieces += sights[k].pieces;
        sampled += sights[k].sampled;
      }
      const double agreed =
          test::agreement(hull, rig.cameras.size(), truth,
                          [&](std::size_t k, std::size_t f) { return sights[k].share[f]; });
      const Times two = measure(hull, rig.cameras, 2, rounds);
      const Times one = measure(hull, rig.cameras, 1, rounds);
      table.row("%s,%zu,%d,%.2f,%.2f,%.2f,%.2f,%.2f,%.1f,%.3f", dense ? "body" : "hull",
                hull.triangles.size() / 3, count, two.wall, two.processor, one.processor,
                one.visibility, one.weights, 100.0 * sampled / pieces, 100.0 * agreed);
    }
  }
  return 0;
}
