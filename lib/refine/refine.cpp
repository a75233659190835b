// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/refine.h"

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "refine/cell_surface.h"
#include "refine/fine_field.h"
#include "refine/flow.h"
#include "refine/frame.h"
#include "refine/input.h"
#include "refine/photo/photo.h"
#include "refine/plate.h"
#include "refine/thin_parts.h"
#include "rig/undistort.h"

namespace polyhull {
namespace {

using namespace refine;

/// First widely, to where outlines of half a pixel's tolerance say, then near the rims alone, a hair
/// further out, so that silhouettes are covered.
constexpr RimFit fits[] = {
    {.radius = 1.4f, .target = -0.02f, .stride = 2}, {0.75f, 0.0f}, {0.5f, 0.015f}, {0.5f, 0.015f}};

/// Rims are held softly and their normals firmly: a rim that few other rays support moves with every
/// half pixel of an outline, the normal hardly. The flow has thinned what is not held; the ties keep
/// it so where nothing else decides.
constexpr PlateSettings coarse_plate{.steps = 20, .value = 4.0f, .normal = 0.5f, .tie = 0.1f},
    middle_plate{.steps = 30, .value = 4.0f, .normal = 0.5f, .tie = 0.08f};

/// What a quality does.
struct Recipe {
  double cell = 0.024;    ///< metres
  int flows = 6;          ///< on the coarse grid
  int coarse_plates = 4;  ///< with rims found anew
  int plates = 2;
  int plate_steps = middle_plate.steps;
  std::size_t stride = 2;  ///< of the rays, until the fine grid
};

Recipe recipe_of(const RefineSettings& settings) {
  Recipe recipe;
  if (settings.quality == RefineQuality::fast) {
    recipe.plates = 1;
    recipe.plate_steps = 8;
  }
  if (settings.quality == RefineQuality::fine) recipe.cell = 0.016;
  if (settings.cell > 0.0) recipe.cell = settings.cell;
  return recipe;
}

/// Cells around a part's box: for the plate's band and the blurs.
constexpr int margin = 4, coarse_margin = 3;
/// How far outside the hull H is told apart.
constexpr float least_hull = -3.3f;
/// What is thinner than twice this has no node of the fine grid for certain.
constexpr float thinnest = 0.45f;
/// How often the pictures are asked.
constexpr int photo_rounds = 3;

}  // namespace

struct HullRefiner::State {
  Hull surface;
  RefineStatistics statistics;
  // What the last surface was made of.
  Hull last_hull;
  std::vector<Camera> last_cameras;
  std::vector<Rings> last_rings;
  RefineSettings last_settings;
  double last_unit = 0.0;
  bool valid = false;

  LocalFrame frame;
  Recipe recipe;
  int threads = 0;
  std::vector<Rings> outlines;  // pinhole pixels
  HullDistance distance;
  std::vector<SilhouetteMapper> mappers;
  std::vector<Level> coarse, middle, fine;
  ContactRays rays;
  FlowMemory flow_memory;
  PlateSolver solver;
  FitMemory fit_memory;
  CellMarcher marcher;
  CellSurface cells;
  PhotoCarver carver;

  bool unchanged(const Hull& hull, std::span<const CameraContours> views, double unit,
                 const RefineSettings& settings) const;
  void remember(const Hull& hull, std::span<const CameraContours> views, double unit,
                const RefineSettings& settings);
  void refine(const Hull& hull, std::span<const CameraContours> views,
              std::span<const ViewPixels> pictures);
  void set_up_views(const Hull& hull, const std::vector<Box>& boxes,
                    std::span<const CameraContours> views);
  void set_up_levels(const std::vector<Box>& boxes);
  void flow(std::vector<Level>& levels, int count, float sigma, float rim_step);
  void plate(std::vector<Level>& levels, int count, PlateSettings settings);
  void start_middle();
  void fit();
  void carve(std::span<const CameraContours> views, std::span<const ViewPixels> pictures);
  void keep_thin();
  void take();
};

bool HullRefiner::State::unchanged(const Hull& hull, std::span<const CameraContours> views,
                                   double unit, const RefineSettings& settings) const {
  if (!valid || settings != last_settings || unit != last_unit ||
      views.size() != last_cameras.size() || hull.origin != last_hull.origin ||
      hull.vertices != last_hull.vertices || hull.triangles != last_hull.triangles)
    return false;
  for (std::size_t k = 0; k < views.size(); ++k)
    if (*views[k].camera != last_cameras[k] || *views[k].rings != last_rings[k]) return false;
  return true;
}

void HullRefiner::State::remember(const Hull& hull, std::span<const CameraContours> views,
                                  double unit, const RefineSettings& settings) {
  last_hull = hull;
  last_cameras.clear();
  last_rings.clear();
  for (const CameraContours& view : views) {
    last_cameras.push_back(*view.camera);
    last_rings.push_back(*view.rings);
  }
  last_settings = settings;
  last_unit = unit;
  valid = true;
}

/// Distances in each picture, as fine as the cell is there.
void HullRefiner::State::set_up_views(const Hull& hull, const std::vector<Box>& boxes,
                                      std::span<const CameraContours> views) {
  Vec3f low(1e30f), high(-1e30f);  // of all that is looked at
  for (const Box& box : boxes) {
    low = glm::min(low, box.low - (margin + 9.0f));  // whole vectors of nodes
    high = glm::max(high, box.high + (margin + 9.0f));
  }
  outlines.resize(views.size());
  distance.views.resize(views.size());
  mappers.resize(std::max(mappers.size(), 2 * views.size()));
  const Box bounds = bounds_of(hull, frame);
  distance.low = bounds.low;
  distance.high = bounds.high;
  parallel_for(views.size(), 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      outlines[k] = undistort_rings(*views[k].camera, *views[k].rings).rings;
      ContactView placed = view_in(frame, *views[k].camera);
      placed.coarse = std::move(distance.views[k].coarse);
      placed.fine = std::move(distance.views[k].fine);
      distance.views[k] = std::move(placed);
    }
  });
  parallel_for(2 * views.size(), 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ContactView& view = distance.views[i / 2];
      const float depth = view.project(Vec3f(0.0f)).z;
      const float pixels = std::max(view.focal / std::max(depth, 1.0f), 0.5f);
      view.beyond = -3.6f * pixels;
      const PictureBox within = view.box_of(low, high);
      if (i % 2 == 0)
        mappers[i].draw(view.coarse, outlines[i / 2],
                        {.texel = std::max(0.7f * pixels, 1.0f),
                         .reach = 2,
                         .margin = 3.6f * pixels,
                         .everywhere = true},
                        within);
      else
        mappers[i].draw(
            view.fine, outlines[i / 2],
            {.texel = std::max(0.25f * pixels, 0.5f), .reach = 4, .margin = 1.5f * pixels}, within);
    }
  });
}

void HullRefiner::State::set_up_levels(const std::vector<Box>& boxes) {
  middle.resize(boxes.size());
  coarse.resize(boxes.size());
  fine.resize(boxes.size());
  std::vector<float> mixed;
  for (std::size_t p = 0; p < boxes.size(); ++p) {
    Level& level = middle[p];
    level.grid = grid_over(boxes[p].low, boxes[p].high, 1.0f, margin);
    distance.fill(level.grid, least_hull, level.hull, threads);
    Level& half = coarse[p];
    half.grid = grid_over(boxes[p].low, boxes[p].high, 2.0f, coarse_margin);
    half.hull.resize(half.grid.size());
    for (int z = 0; z < half.grid.nz; ++z)
      for (int y = 0; y < half.grid.ny; ++y)
        sample_row(level.grid, level.hull.data(), half.grid, y, z, mixed,
                   half.hull.data() + half.grid.node(0, y, z));
    for (float& value : half.hull) value = std::max(outside, value);
    half.values = half.hull;
    statistics.nodes += level.grid.size();
  }
  statistics.parts = static_cast<std::uint32_t>(boxes.size());
}

void HullRefiner::State::flow(std::vector<Level>& levels, int count, float sigma, float rim_step) {
  for (int i = 0; i < count; ++i) {
    for (Level& level : levels) blur(level.grid, level.values, sigma, flow_memory, threads);
    find_rims(rays, levels, rim_step, i % 2 == 0 ? RimSearch::everywhere : RimSearch::near,
              recipe.stride, threads);
    for (std::size_t p = 0; p < levels.size(); ++p)
      pull_to_rims(levels[p], rays, static_cast<std::uint32_t>(p),
                   {.sigma = 0.75f * sigma, .stride = recipe.stride}, flow_memory, threads);
  }
}

void HullRefiner::State::plate(std::vector<Level>& levels, int count, PlateSettings settings) {
  settings.stride = recipe.stride;
  for (int i = 0; i < count; ++i) {
    find_rims(rays, levels, 0.5f, i == 0 ? RimSearch::everywhere : RimSearch::near, recipe.stride,
              threads);
    for (std::size_t p = 0; p < levels.size(); ++p) {
      settings.band = 2.5f * levels[p].grid.cell;
      solver.solve(levels[p], rays, static_cast<std::uint32_t>(p), settings, threads);
    }
  }
}

/// The coarse surface on the middle grid.
void HullRefiner::State::start_middle() {
  for (std::size_t p = 0; p < middle.size(); ++p) {
    Level& level = middle[p];
    const Grid& grid = level.grid;
    level.values.resize(grid.size());
    parallel_for(
        static_cast<std::size_t>(grid.nz), 4, threads, [&](std::size_t begin, std::size_t end) {
          std::vector<float> mixed;
          for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
            for (int y = 0; y < grid.ny; ++y) {
              const std::size_t row = grid.node(0, y, z);
              float* values = level.values.data() + row;
              const float* hull = level.hull.data() + row;
              sample_row(coarse[p].grid, coarse[p].values.data(), grid, y, z, mixed, values);
              for (int x = 0; x < grid.nx; ++x)
                values[x] = hull[x] <= least_hull ? outside : std::max(outside, values[x]);
            }
        });
  }
}

void HullRefiner::State::fit() {
  for (std::size_t p = 0; p < middle.size(); ++p) make_fine(middle[p], distance, fine[p], threads);
  find_rims(rays, middle, 0.5f, RimSearch::everywhere, 1, threads);
  for (const RimFit& fit : fits) {
    find_rims(rays, fine, 0.15f, RimSearch::near, fit.stride, threads);
    for (std::size_t p = 0; p < fine.size(); ++p) {
      fit_to_rims(fine[p], rays, static_cast<std::uint32_t>(p), fit, fit_memory, threads);
      if (&fit == fits) cut_at_hull(fine[p], threads);  // later fits keep to it
    }
  }
}

void HullRefiner::State::keep_thin() {
  find_rims(rays, fine, 0.15f, RimSearch::near, 1, threads);
  statistics.thin_rays =
      static_cast<std::uint32_t>(keep_thin_parts(fine, rays, distance, thinnest));
}

/// Each round sees further into hollows. Rays that lost their contact get it back where they are
/// nearest to one.
void HullRefiner::State::carve(std::span<const CameraContours> views,
                               std::span<const ViewPixels> pictures) {
  carver.set_up(views, pictures, distance.views, threads);
  bool carved = false;
  for (int round = 0; round < photo_rounds; ++round)
    for (std::size_t p = 0; p < fine.size(); ++p) {
      cells.clear();
      marcher.march(fine[p], cells, threads);
      carved |= carver.carve(fine[p], cells, {}, threads);
    }
  if (!carved) return;
  find_rims(rays, fine, 0.25f, RimSearch::everywhere, 1, threads);
  for (const RimFit& fit : std::span(fits).subspan(1)) {
    find_rims(rays, fine, 0.15f, RimSearch::near, fit.stride, threads);
    for (std::size_t p = 0; p < fine.size(); ++p)
      fit_to_rims(fine[p], rays, static_cast<std::uint32_t>(p), fit, fit_memory, threads);
  }
}

void HullRefiner::State::take() {
  surface.origin = frame.origin;
  surface.vertices.resize(cells.points.size());
  surface.normals.resize(cells.points.size());
  const double unit = 1.0 / frame.cells;
  parallel_for(cells.points.size(), 4096, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      surface.vertices[i] = Vec3f(frame.turned_back(Vec3(cells.points[i])) * unit);
      surface.normals[i] = Vec3f(frame.turned_back(Vec3(cells.normals[i])));
    }
  });
  surface.triangles.swap(cells.triangles);  // whose are cleared next
  surface.faces.assign(
      1, {-1, HullFace::no_edge, 0, static_cast<std::uint32_t>(surface.triangles.size() / 3)});
  surface.loop_vertices.clear(), surface.loop_ends.clear(), surface.face_loop_ends.clear();
}

void HullRefiner::State::refine(const Hull& hull, std::span<const CameraContours> views,
                                std::span<const ViewPixels> pictures) {
  Stopwatch watch;
  const std::vector<Box> boxes = boxes_of(hull, frame, 2.0f * margin);
  check_size(boxes, margin, recipe.cell);
  set_up_views(hull, boxes, views);
  set_up_levels(boxes);
  statistics.seconds_distances = watch.lap();
  std::vector<OutlineView> outline_views;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const float depth = distance.views[k].project(Vec3f(0.0f)).z;
    const float pixels = distance.views[k].focal / std::max(depth, 1.0f);
    outline_views.push_back(
        outline_in(frame, *views[k].camera, outlines[k], std::max(0.5f * pixels, 1.0f)));
  }
  trace_rays(outline_views, middle, threads, rays);
  statistics.rays = static_cast<std::uint32_t>(rays.rays.size());
  statistics.seconds_rays = watch.lap();
  flow(coarse, recipe.flows, 2.0f, 0.5f);
  statistics.seconds_flow = watch.lap();
  plate(coarse, recipe.coarse_plates, coarse_plate);
  statistics.seconds_plate = watch.lap();
  start_middle();
  PlateSettings middle_settings = middle_plate;
  middle_settings.steps = recipe.plate_steps;
  plate(middle, recipe.plates, middle_settings);
  for (int i = 0; i < 2; ++i) {
    find_rims(rays, middle, 0.4f, i == 0 ? RimSearch::everywhere : RimSearch::near, recipe.stride,
              threads);
    for (std::size_t p = 0; p < middle.size(); ++p)
      pull_to_rims(middle[p], rays, static_cast<std::uint32_t>(p),
                   {.sigma = 1.4f, .target = -0.04f, .stride = recipe.stride}, flow_memory,
                   threads);
  }
  statistics.seconds_plate += watch.lap();
  fit();
  statistics.seconds_fine = watch.lap();
  if (!pictures.empty()) {
    carve(views, pictures);
    statistics.seconds_photo = watch.lap();
  }
  keep_thin();
  statistics.seconds_fine += watch.lap();
  cells.clear();
  for (const Level& level : fine) marcher.march(level, cells, threads);
  if (cells.triangles.empty())
    throw Error(
        Error::Kind::unsupported,
        "Nothing is left of the hull on cells of {:g} m: it is smaller, or a camera does not "
        "see it (unseen=keep of hullbuild).",
        recipe.cell);
  take();
  statistics.seconds_surface = watch.lap();
}

HullRefiner::HullRefiner() : state_(std::make_unique<State>()) {}
HullRefiner::~HullRefiner() = default;

const RefineStatistics& HullRefiner::statistics() const {
  return state_->statistics;
}

const Hull& HullRefiner::refine(const Hull& hull, std::span<const CameraContours> views,
                                double metres_per_unit, const RefineSettings& settings,
                                std::span<const ViewPixels> pictures) {
  State& s = *state_;
  check_input(views, metres_per_unit, settings, pictures);
  s.statistics = {};
  if (settings.reuse && !settings.photo && s.unchanged(hull, views, metres_per_unit, settings)) {
    s.statistics.reused = true;
    return s.surface;
  }
  s.valid = false;
  if (settings.quality == RefineQuality::off || hull.empty()) {
    s.surface = hull;
  } else {
    s.recipe = recipe_of(settings);
    s.threads = settings.threads;
    s.frame = frame_of(hull, metres_per_unit / s.recipe.cell);
    s.refine(hull, views, settings.photo ? pictures : std::span<const ViewPixels>());
  }
  s.remember(hull, views, metres_per_unit, settings);
  return s.surface;
}

}  // namespace polyhull
