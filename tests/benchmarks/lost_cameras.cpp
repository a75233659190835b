// SPDX-License-Identifier: LGPL-2.1-or-later
#include "lost_cameras.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <set>

#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "hull/build/stage.h"
#include "hull/measure.h"
#include "refine/refine.h"
#include "sheet.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"

namespace polyhull::benchmark {

using namespace test;

namespace {

/// Ten choices at most of \p lost of \p cameras, evenly among all.
std::vector<std::vector<std::size_t>> choices(std::size_t cameras, int lost) {
  std::vector<std::vector<std::size_t>> all;
  for (unsigned bits = 0; bits < 1u << cameras; ++bits) {
    if (std::popcount(bits) != lost) continue;
    std::vector<std::size_t>& choice = all.emplace_back();
    for (std::size_t k = 0; k < cameras; ++k)
      if (bits >> k & 1) choice.push_back(k);
  }
  constexpr std::size_t most = 10;
  std::vector<std::vector<std::size_t>> some;
  const std::size_t count = std::min(most, all.size());
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

/// None, one, and all but three and two.
std::vector<std::vector<std::size_t>> losses_of(std::size_t cameras) {
  std::set<int> numbers{0, 1};
  for (const std::size_t left : {3, 2}) numbers.insert(static_cast<int>(cameras - left));
  std::vector<std::vector<std::size_t>> all;
  for (const int lost : numbers)
    for (auto& choice : choices(cameras, lost)) all.push_back(std::move(choice));
  return all;
}

BodyScene without(const BodyScene& scene, const std::vector<std::size_t>& lost) {
  BodyScene left = scene;
  for (auto k = lost.rbegin(); k != lost.rend(); ++k) {
    const auto at = static_cast<std::ptrdiff_t>(*k);
    left.cameras.erase(left.cameras.begin() + at);
    left.contours.erase(left.contours.begin() + at);
    left.silhouettes.erase(left.silhouettes.begin() + at);
    left.pictures.erase(left.pictures.begin() + at);
  }
  return left;
}

Hull hull_within(const BodyScene& scene, const Bounds& bounds) {
  HullStage stage;
  HullOptions options;
  options.bounds = bounds;
  options.threads = 1;
  return stage.build(camera_contours(scene.cameras, scene.contours), options, 0.0);
}

/// One, where it cannot be refined.
Hull refined(const BodyScene& scene, const Hull& hull) {
  try {
    return HullRefiner().refine(hull, camera_contours(scene.cameras, scene.contours), 1.0,
                                {.threads = 1, .reuse = false});
  } catch (const std::exception&) {
    return hull;
  }
}

struct Result {
  std::string body;
  double volume = 0.0;  // over that with all cameras
  BodyError hull, surface;
};

std::string names(const std::vector<std::size_t>& lost) {
  std::string text;
  for (const std::size_t k : lost) text += (text.empty() ? "" : "+") + std::to_string(k);
  return text.empty() ? "none" : text;
}

Rectangle region_of(const Picture& picture) {
  int left = picture.width, right = 0, top = picture.height, bottom = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (picture.row(y)[4 * x + 3] != 0) {
        left = std::min(left, x), right = std::max(right, x);
        top = std::min(top, y), bottom = std::max(bottom, y);
      }
  constexpr int margin = 60;
  left = std::max(left - margin, 0), top = std::max(top - margin / 2, 0);
  return {left, top, std::min(right + margin, picture.width) - left,
          std::min(bottom + margin / 2, picture.height) - top};
}

}  // namespace

std::vector<NamedRig> shipped_rigs() {
  const char* source = std::getenv("POLYHULL_SOURCE");
  const std::string folder = std::string(source ? source : ".") + "/pipelines/rigs/";
  return {{"four", default_rig()},
          {"five", load_rig(folder + "five.json")},
          {"eight", load_rig(folder + "eight.json")}};
}

void study_losses(Table& table, const NamedRig& rig, const std::string& sheets) {
  const char* data = std::getenv("POLYHULL_DATA");
  std::vector<Body> bodies = study_bodies(data ? data : "");
  std::erase_if(bodies, [](const Body& body) {
    return body.name == "figure-3" || body.name == "makehuman-60";
  });
  const std::vector<std::vector<std::size_t>> losses = losses_of(rig.rig.cameras.size());
  std::vector<std::vector<Result>> results(losses.size());
  for (const Body& body : bodies) {
    const BodyScene scene = body_scene(rig.rig, body);
    const double whole = enclosed_volume(hull_within(scene, *rig.rig.bounds));
    std::vector<std::vector<Picture>> columns(losses.size());
    parallel_for(losses.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const BodyScene left = without(scene, losses[i]);
        const Hull hull = hull_within(left, *rig.rig.bounds);
        const Hull surface = refined(left, hull);
        results[i].push_back({body.name, enclosed_volume(hull) / whole, measure(hull, left, false),
                              measure(surface, left, false)});
        if (sheets.empty()) continue;
        for (std::size_t k = 0; k < scene.between.size(); ++k)
          columns[i].push_back(textured(surface, left, scene.between[k]));
      }
    });
    if (sheets.empty()) continue;
    // Across the losses, down the places between cameras; the truth last.
    const Rectangle part = region_of(scene.seen.front());
    columns.push_back(scene.seen);
    Sheet sheet(static_cast<int>(columns.size()), static_cast<int>(scene.between.size()), part);
    for (std::size_t c = 0; c < columns.size(); ++c)
      for (std::size_t r = 0; r < columns[c].size(); ++r)
        sheet.put(columns[c][r], static_cast<int>(c), static_cast<int>(r));
    sheet.save(sheets + "/" + rig.name + "-" + body.name + ".png");
  }
  for (std::size_t i = 0; i < losses.size(); ++i)
    for (const Result& r : results[i])
      table.row("%s,%zu,%s,%s,%.3f,%.3f,%.1f,%.1f,%.3f,%.3f,%.1f,%.1f,%.3f", rig.name.c_str(),
                losses[i].size(), names(losses[i]).c_str(), r.body.c_str(), r.volume, r.hull.volume,
                r.hull.mean, r.hull.hausdorff, r.hull.overlap, r.surface.volume, r.surface.mean,
                r.surface.hausdorff, r.surface.overlap);
}

void study_colours(Table& table, const NamedRig& rig) {
  constexpr int frames[] = {1, 2, 3, 5, 10};
  const auto figure = open_subject("figure");
  for (const double seconds : {1.6, 4.4, 7.6}) {
    const auto scene_at = [&](int frame) {
      return body_scene(rig.rig, {"", figure, seconds + 0.04 * frame});
    };
    const BodyScene scene = scene_at(0);
    const auto psnr = [&](const BodyScene& left, const std::vector<Picture>& seen) {
      const Hull surface = refined(left, hull_within(left, *rig.rig.bounds));
      double sum = 0.0;
      for (const double db : psnr_from(surface, left, {}, scene.between, seen)) sum += db;
      return sum / static_cast<double>(seen.size());
    };
    table.row("%s,%.1f,whole,,%.2f", rig.name.c_str(), seconds, psnr(scene, scene.seen));
    for (std::size_t k = 0; k < scene.cameras.size(); ++k)
      table.row("%s,%.1f,without,%zu,%.2f", rig.name.c_str(), seconds, k,
                psnr(without(scene, {k}), scene.seen));
    for (const int frame : frames)
      table.row("%s,%.1f,frozen,%d,%.2f", rig.name.c_str(), seconds, frame,
                psnr(scene, scene_at(frame).seen));
  }
}

}  // namespace polyhull::benchmark
