// SPDX-License-Identifier: LGPL-2.1-or-later
#include "body_methods.h"

#include <memory>

#include "hull/build/stage.h"
#include "refine/refine.h"
#include "support/camera_contours.h"

namespace polyhull::benchmark {

using test::BodyScene, test::hull_of;

namespace {

using Surfacer = std::function<Hull(const BodyScene&, const Hull&)>;

Surfacer intersected(int threads) {
  const auto stage = std::make_shared<HullStage>();
  return [=](const BodyScene& scene, const Hull&) { return hull_of(scene, *stage, threads); };
}

Surfacer refined(RefineQuality quality, int threads) {
  const auto refiner = std::make_shared<HullRefiner>();
  return [=](const BodyScene& scene, const Hull& hull) {
    return refiner->refine(hull, test::camera_contours(scene.cameras, scene.contours), 1.0,
                           {.quality = quality, .threads = threads, .reuse = false});
  };
}

Surfacer carved(int threads) {
  const auto refiner = std::make_shared<HullRefiner>();
  return [=](const BodyScene& scene, const Hull& hull) {
    return refiner->refine(hull, test::camera_contours(scene.cameras, scene.contours), 1.0,
                           {.threads = threads, .photo = true}, test::view_pixels(scene));
  };
}

}  // namespace

std::vector<Method> body_methods(int threads) {
  return {
      {"hull", intersected(threads)},
      {"fast", refined(RefineQuality::fast, threads)},
      {"good", refined(RefineQuality::good, threads)},
      {"fine", refined(RefineQuality::fine, threads)},
      {"photo", carved(threads), false},
  };
}

}  // namespace polyhull::benchmark
