// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/refine.h"

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "refine/field/cell_surface.h"
#include "refine/field/fine_field.h"
#include "refine/field/flow.h"
#include "refine/field/frame.h"
#include "refine/field/plate.h"
#include "refine/field/thin_parts.h"
#include "refine/input.h"
#include "refine/merge/merged_cells.h"
#include "refine/photo/photo.h"
#include "refine/pieces/components.h"
#include "refine/pieces/handles.h"
#include "refine/recipe.h"
#include "rig/undistort.h"

namespace polyhull {
namespace {

using namespace refine;

/// Cells around a part's box: for the plate's band and the blurs.
constexpr int margin = 4, coarse_margin = 3;
/// What is thinner than twice this has no node of the fine grid for certain.
constexpr float thinnest = 0.45f;
/// Rims that had this much before the last fit have not lost their contact.
constexpr float doubtful = -0.05f;
/// Handles that are less deep, and that no silhouette needs, are cut.
constexpr float thin_handle = 0.05f;
/// Tunnels that nowhere are farther from their walls, and that no silhouette shows, are filled.
constexpr float narrow_tunnel = 0.5f;
/// By how much outlines may contradict each other: cells, which is what the surface rounds, and
/// pixels, which is what mattes and calibrations are wrong by.
constexpr float unsure_cells = 0.5f, unsure_pixels = 4.0f;
/// A loose piece has to cover what is so far inwards of the outline that needs it, pixels.
constexpr float covering_pixels = 1.0f;
/// A hole that goes no farther beyond its outline is none for certain, pixels.
constexpr float hole_pixels = 2.0f;
/// How often the pictures are asked.
constexpr int photo_rounds = 3;

/// Of the middle of the frame, in a view's picture.
float pixels_of_a_cell(const ContactView& view) {
  return view.focal / std::max(view.project(Vec3f(0.0f)).z, 1.0f);
}

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
  std::vector<std::uint32_t> labels;  ///< of cut_thin_handles()
  CellMarcher marcher;
  CellMerger merger;
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
  void draw_fine_map(std::size_t k);
  void set_up_levels(const std::vector<Box>& boxes);
  void flow(std::vector<Level>& levels, int count, float sigma, float rim_step);
  void plate(std::vector<Level>& levels, int count, const PlateSettings& settings, float rim_step);
  void start_middle();
  void fit();
  void carve(std::span<const CameraContours> views, std::span<const ViewPixels> pictures);
  void keep_thin();
  void tidy();
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

/// Distances in each picture, as fine as the cell is there; all but the maps of outlines.
void HullRefiner::State::set_up_views(const Hull& hull, const std::vector<Box>& boxes,
                                      std::span<const CameraContours> views) {
  Vec3f low(1e30f), high(-1e30f);  // of all that is looked at
  for (const Box& box : boxes) {
    low = glm::min(low, box.low - (margin + 9.0f));  // whole vectors of nodes
    high = glm::max(high, box.high + (margin + 9.0f));
  }
  outlines.resize(views.size());
  distance.views.resize(views.size());
  mappers.resize(std::max(mappers.size(), views.size()));
  const Box bounds = bounds_of(hull, frame);
  distance.low = bounds.low;
  distance.high = bounds.high;
  parallel_each(views.size(), 1, threads, [&](std::size_t k) {
    outlines[k] = undistort_rings(*views[k].camera, *views[k].rings).rings;
    ContactView placed = view_in(frame, *views[k].camera);
    placed.coarse = std::move(distance.views[k].coarse);
    placed.fine = std::move(distance.views[k].fine);
    distance.views[k] = std::move(placed);
  });
  parallel_each(views.size(), 1, threads, [&](std::size_t k) {
    ContactView& view = distance.views[k];
    const float pixels = std::max(pixels_of_a_cell(view), 0.5f);
    view.beyond = -3.6f * pixels;
    view.within = view.box_of(low, high);
    mappers[k].draw(
        view.coarse, outlines[k],
        {.texel = std::max(pixels, 1.0f), .reach = 2, .margin = 3.6f * pixels, .everywhere = true},
        view.within);
  });
}

void HullRefiner::State::draw_fine_map(std::size_t k) {
  ContactView& view = distance.views[k];
  const float pixels = std::max(pixels_of_a_cell(view), 0.5f);
  mappers[k].draw(view.fine, outlines[k],
                  {.texel = std::max(0.25f * pixels, 0.5f), .reach = 4, .margin = 1.5f * pixels},
                  view.within);
}

void HullRefiner::State::set_up_levels(const std::vector<Box>& boxes) {
  middle.resize(boxes.size());
  coarse.resize(boxes.size());
  fine.resize(boxes.size());
  std::vector<float> mixed;
  for (std::size_t p = 0; p < boxes.size(); ++p) {
    Level& level = middle[p];
    level.grid = grid_over(boxes[p].low, boxes[p].high, 1.0f, margin);
    distance.fill(level.grid, least_hull, level.hull, level.rows, threads);
    Level& half = coarse[p];
    half.grid = grid_over(boxes[p].low, boxes[p].high, 2.0f, coarse_margin);
    half.hull.resize(half.grid.size());
    half.rows.assign(half.hull.size() / half.grid.row(), {0, half.grid.nx});
    for (int z = 0; z < half.grid.nz; ++z)
      for (int y = 0; y < half.grid.ny; ++y)
        sample_row(level.grid, level.hull.data(), half.grid, y, z, {0, half.grid.nx}, mixed,
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

void HullRefiner::State::plate(std::vector<Level>& levels, int count, const PlateSettings& settings,
                               float rim_step) {
  for (int i = 0; i < count; ++i) {
    find_rims(rays, levels, rim_step, i == 0 ? RimSearch::everywhere : RimSearch::near,
              settings.stride, threads);
    for (std::size_t p = 0; p < levels.size(); ++p)
      solver.solve(levels[p], rays, static_cast<std::uint32_t>(p), settings, threads);
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
              std::fill_n(values, grid.nx, outside);
              each_stretch(level, row / grid.row(), least_hull, [&](Extent nodes) {
                sample_row(coarse[p].grid, coarse[p].values.data(), grid, y, z, nodes, mixed,
                           values);
                for (int x = nodes.begin; x < nodes.end; ++x)
                  values[x] = hull[x] <= least_hull ? outside : std::max(outside, values[x]);
              });
            }
        });
  }
}

void HullRefiner::State::fit() {
  for (std::size_t p = 0; p < middle.size(); ++p) make_fine(middle[p], distance, fine[p], threads);
  find_rims(rays, middle, recipe.last_step, RimSearch::everywhere, 1, threads);
  for (const RimFit& fit : recipe.fits) {
    find_rims(rays, fine, 0.15f, RimSearch::near, fit.stride, threads);
    for (std::size_t p = 0; p < fine.size(); ++p) {
      fit_to_rims(fine[p], rays, static_cast<std::uint32_t>(p), fit, fit_memory, threads);
      if (&fit == recipe.fits.data()) cut_at_hull(fine[p], threads);  // later fits keep to it
    }
  }
}

void HullRefiner::State::keep_thin() {
  find_rims(rays, fine, 0.15f, RimSearch::near, 1, threads, doubtful);
  statistics.thin_rays =
      static_cast<std::uint32_t>(keep_thin_parts(fine, rays, distance, thinnest, threads));
}

/// Takes away what contradictions make of the surface where fins of the hull stand off the body.
void HullRefiner::State::tidy() {
  float pixels = 0.0f, most_pixels = 2.0f;  // of a cell: the mean, and in the nearest view
  for (const ContactView& view : distance.views) {
    pixels += pixels_of_a_cell(view) / static_cast<float>(distance.views.size());
    most_pixels = std::max(most_pixels, pixels_of_a_cell(view));
  }
  pixels = std::max(pixels, 2.0f);
  const float unsure = unsure_cells + unsure_pixels / pixels;
  std::vector<LevelRuns> runs;
  for (const Level& level : fine) runs.push_back(find_runs(level, 0.0f));
  for (std::size_t p = 0; p < fine.size(); ++p) {
    if (runs[p].handles <= 0) continue;
    const auto needed = [&](const Vec3f& node) {
      return is_needed(node, fine, runs, rays, unsure);
    };
    if (fill_narrow_tunnels(fine[p], narrow_tunnel, hole_pixels / most_pixels, labels) > 0)
      runs[p] = find_runs(fine[p], 0.0f);
    if (runs[p].handles > 0 && cut_thin_handles(fine[p], runs[p], thin_handle, needed, labels) > 0)
      runs[p] = find_runs(fine[p], 0.0f);
  }
  statistics.pieces_dropped = static_cast<std::uint32_t>(drop_unneeded_components(
      fine, std::move(runs), rays, unsure, covering_pixels / pixels, threads));
}

/// Each round sees further into hollows.
void HullRefiner::State::carve(std::span<const CameraContours> views,
                               std::span<const ViewPixels> pictures) {
  ContactRays held = rays;
  find_rims(held, fine, 0.15f, RimSearch::near, 1, threads);
  std::vector<Vec3f> rims;
  for (const ContactRay& ray : held.rays)
    if (ray.value >= doubtful) rims.push_back(ray.rim());
  carver.set_up(views, pictures, distance.views, threads);
  bool carved = false;
  for (int round = 0; round < photo_rounds; ++round)
    for (std::size_t p = 0; p < fine.size(); ++p) {
      cells.clear();
      marcher.march(fine[p], cells, threads);
      carved |= carver.carve(fine[p], cells, rims, {}, threads);
    }
  if (carved) find_rims(rays, fine, 0.15f, RimSearch::near, 1, threads);
}

void HullRefiner::State::take() {
  surface.origin = frame.origin;
  surface.vertices.resize(cells.points.size());
  surface.normals.resize(cells.points.size());
  const double unit = 1.0 / frame.cells;
  parallel_each(cells.points.size(), 4096, threads, [&](std::size_t i) {
    surface.vertices[i] = Vec3f(frame.turned_back(Vec3(cells.points[i])) * unit);
    surface.normals[i] = Vec3f(frame.turned_back(Vec3(cells.normals[i])));
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
    const float pixels = pixels_of_a_cell(distance.views[k]);
    outline_views.push_back(
        outline_in(frame, *views[k].camera, outlines[k], std::max(0.5f * pixels, 1.0f)));
  }
  trace_rays(outline_views, middle, threads, rays);
  statistics.rays = static_cast<std::uint32_t>(rays.rays.size());
  statistics.seconds_rays = watch.lap();
  // The coarse grid is too small for two threads: others draw the outlines' maps meanwhile.
  const auto on_coarse = [&] {
    flow(coarse, recipe.flows, 2.0f, recipe.flow_step);
    statistics.seconds_flow = watch.lap();
    plate(coarse, recipe.coarse_plates, recipe.coarse, 1.0f);
    statistics.seconds_plate = watch.lap();
  };
  parallel_each(1 + views.size(), 1, threads, [&](std::size_t i) {
    if (i == 0)
      on_coarse();
    else
      draw_fine_map(i - 1);
  });
  statistics.seconds_distances += watch.lap();
  start_middle();
  plate(middle, recipe.plates, recipe.middle, 0.5f);
  for (int i = 0; i < recipe.pulls; ++i) {
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
  tidy();
  statistics.seconds_fine += watch.lap();
  cells.clear();
  for (std::size_t p = 0; p < fine.size(); ++p)
    merger.march(fine[p], rays, static_cast<std::uint32_t>(p), recipe.flatness, cells, threads);
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
