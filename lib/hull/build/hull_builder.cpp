// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/build/hull_builder.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "hull/cones/cone_cache.h"
#include "hull/faces/clipping_problem.h"
#include "hull/faces/face_clipper.h"
#include "hull/surface/assemble.h"
#include "hull/surface/simplify.h"
#include "hull/surface/triangulate.h"

namespace polyhull {
namespace {

using hull::Cone;
using hull::ConeCamera;
using hull::FaceClipper;
using hull::FaceLoops;
using hull::Lattice;
using hull::ViewCopy;

/// Faces handled as one piece of work.
constexpr std::size_t faces_per_block = 32;
/// Without bounds the hull is limited to a box this many times as large as the rig.
constexpr double working_box = 1024.0;

}  // namespace

struct HullBuilder::State {
  Hull hull;
  HullStatistics statistics;
  std::vector<ViewCopy> last_views;
  HullOptions last_options;
  bool valid = false;

  std::vector<ConeCamera> cameras;
  hull::ConeCache cones;
  std::vector<const Cone*> used;
  hull::ClippingProblem problem;
  std::vector<FaceLoops> blocks;
  hull::Assembler assembler;
  std::mutex mutex;  // protects the two lists of idle workers
  std::vector<std::unique_ptr<FaceClipper>> clippers;
  std::vector<std::unique_ptr<hull::Triangulator>> triangulators;
  std::vector<std::vector<std::uint32_t>> triangle_blocks;
  hull::Simplifier simplifier;
  std::vector<Vec3> face_normals;  // out of the solid

  bool unchanged(std::span<const Silhouette> views, const HullOptions& options) const;
  void remember(std::span<const Silhouette> views, const HullOptions& options);
  void build(std::span<const Silhouette> views, const HullOptions& options);
  Lattice choose_lattice(const HullOptions& options, std::array<double, 6>& box) const;
  void clip_faces(int threads);
  void triangulate(int threads);
  bool any_broken() const;

  template <class T>
  std::unique_ptr<T> take(std::vector<std::unique_ptr<T>>& idle) {
    std::lock_guard lock(mutex);
    if (idle.empty()) return std::make_unique<T>();
    std::unique_ptr<T> worker = std::move(idle.back());
    idle.pop_back();
    return worker;
  }
  template <class T>
  void give(std::vector<std::unique_ptr<T>>& idle, std::unique_ptr<T> worker) {
    std::lock_guard lock(mutex);
    idle.push_back(std::move(worker));
  }
};

bool HullBuilder::State::unchanged(std::span<const Silhouette> views,
                                   const HullOptions& options) const {
  if (!valid || options != last_options || views.size() != last_views.size()) return false;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (!last_views[i].same(views[i])) return false;
  return true;
}

void HullBuilder::State::remember(std::span<const Silhouette> views, const HullOptions& options) {
  last_views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) last_views[i].copy(views[i]);
  last_options = options;
  valid = true;
}

Lattice HullBuilder::State::choose_lattice(const HullOptions& options,
                                           std::array<double, 6>& box) const {
  Vec3 low(1e300), high(-1e300);
  for (const ConeCamera& c : cameras)
    low = glm::min(low, c.centre), high = glm::max(high, c.centre);
  Lattice lattice;
  lattice.origin = 0.5 * low + 0.5 * high;
  double reach = 0.0;
  for (const ConeCamera& c : cameras)
    reach = std::max(reach, glm::length(c.centre - lattice.origin));
  Vec3 box_low(0.0), box_high(0.0);
  if (options.bounds) {
    box_low = options.bounds->min - lattice.origin, box_high = options.bounds->max - lattice.origin;
    const double size = glm::length(options.bounds->max - options.bounds->min);
    const double limit = 1048576.0 * std::max(reach, std::min(size, 1e12));
    box_low = glm::clamp(box_low, Vec3(-limit), Vec3(limit));
    box_high = glm::clamp(box_high, Vec3(-limit), Vec3(limit));
    for (int k = 0; k < 3; ++k)
      reach = std::max({reach, std::abs(box_low[k]), std::abs(box_high[k])});
  } else {
    if (!(reach > 0)) reach = 1.0;
    box_low = Vec3(-working_box * reach), box_high = Vec3(working_box * reach);
    reach *= working_box;
  }
  if (!(reach > 1e-290)) reach = 1.0;
  if (!(reach < 1e35))
    throw Error(
        Error::Kind::bad_input,
        "The cameras' centres or the bounds are more than 1e35 units apart, beyond what the "
        "hull's coordinates can hold: expected a calibration in metres or a similar unit.");
  lattice.scale = std::ldexp(1.0, 42 - std::ilogb(reach));
  for (int k = 0; k < 3; ++k) {
    box[2 * k] = std::nearbyint(box_low[k] * lattice.scale);
    box[2 * k + 1] = std::nearbyint(box_high[k] * lattice.scale);
  }
  return lattice;
}

void HullBuilder::State::clip_faces(int threads) {
  const std::size_t faces = problem.face_count();
  const std::size_t count = (faces + faces_per_block - 1) / faces_per_block;
  blocks.resize(count);
  parallel_for(count, 1, threads, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<FaceClipper> clipper = take(clippers);
    clipper->begin(problem);
    for (std::size_t b = begin; b < end; ++b) {
      blocks[b].clear();
      const std::size_t last = std::min(faces, (b + 1) * faces_per_block);
      clipper->clip(static_cast<std::uint32_t>(b * faces_per_block),
                    static_cast<std::uint32_t>(last), blocks[b]);
    }
    give(clippers, std::move(clipper));
  });
  for (const FaceLoops& block : blocks) {
    statistics.predicates += block.predicates;
    statistics.exact_predicates += block.exact;
    statistics.inconsistencies += block.broken;
  }
}

void HullBuilder::State::triangulate(int threads) {
  const std::size_t faces = hull.faces.size();
  const std::size_t count = (faces + faces_per_block - 1) / faces_per_block;
  triangle_blocks.resize(count);
  parallel_for(count, 4, threads, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<hull::Triangulator> worker = take(triangulators);
    for (std::size_t b = begin; b < end; ++b) {
      auto& triangles = triangle_blocks[b];
      triangles.clear();
      const std::size_t last = std::min(faces, (b + 1) * faces_per_block);
      for (std::size_t f = b * faces_per_block; f < last; ++f) {
        const std::uint32_t loop_begin = f == 0 ? 0 : hull.face_loop_ends[f - 1];
        const std::uint32_t loop_end = hull.face_loop_ends[f];
        const std::uint32_t first = loop_begin == 0 ? 0 : hull.loop_ends[loop_begin - 1];
        const std::uint32_t last_corner = hull.loop_ends[loop_end - 1];
        const std::span<const std::uint32_t> loops(hull.loop_vertices.data() + first,
                                                   last_corner - first);
        const std::span<const std::uint32_t> ends(hull.loop_ends.data() + loop_begin,
                                                  loop_end - loop_begin);
        const std::size_t before = triangles.size();
        hull.faces[f].first_triangle = static_cast<std::uint32_t>(before / 3);
        worker->triangulate(hull.vertices, assembler.keys(), loops, ends, first, face_normals[f],
                            triangles);
        hull.faces[f].triangle_count = static_cast<std::uint32_t>((triangles.size() - before) / 3);
      }
    }
    give(triangulators, std::move(worker));
  });
  for (std::size_t b = 0; b < count; ++b) {
    const std::uint32_t base = static_cast<std::uint32_t>(hull.triangles.size() / 3);
    const std::size_t last = std::min(faces, (b + 1) * faces_per_block);
    for (std::size_t f = b * faces_per_block; f < last; ++f) hull.faces[f].first_triangle += base;
    hull.triangles.insert(hull.triangles.end(), triangle_blocks[b].begin(),
                          triangle_blocks[b].end());
  }
}

/// Whether rounding to float has flattened or flipped a triangle.
bool HullBuilder::State::any_broken() const {
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    const std::uint32_t* t = hull.triangles.data() + 3 * hull.faces[f].first_triangle;
    for (std::uint32_t k = 0; k < hull.faces[f].triangle_count; ++k, t += 3)
      if (hull::Simplifier::broken(hull.vertices[t[0]], hull.vertices[t[1]], hull.vertices[t[2]],
                                   face_normals[f]))
        return true;
  }
  return false;
}

void HullBuilder::State::build(std::span<const Silhouette> views, const HullOptions& options) {
  Stopwatch watch;
  statistics = {};
  hull.vertices.clear(), hull.triangles.clear(), hull.faces.clear();
  hull.loop_vertices.clear(), hull.loop_ends.clear(), hull.face_loop_ends.clear();
  hull.origin = Vec3(0.0);
  cameras.clear();
  for (std::size_t i = 0; i < views.size(); ++i) {
    cameras.push_back(hull::read_camera(*views[i].camera, i));
    statistics.contour_vertices += static_cast<std::uint32_t>(views[i].rings->points.size());
    statistics.cameras += !views[i].rings->points.empty();
  }
  if (options.unseen == Unseen::keep && !options.bounds)
    throw Error(Error::Kind::bad_input,
                "Space that cameras do not see is to be kept (unseen = keep), but the hull has no "
                "bounds: give the rig 'bounds' or carve.");
  if (!(options.max_deviation >= 0.0) || !std::isfinite(options.max_deviation))
    throw Error(Error::Kind::bad_input,
                "The hull's largest deviation is {:g}; give a number of world units, 0 or more.",
                options.max_deviation);
  if (options.bounds)
    for (int k = 0; k < 3; ++k) {
      if (!std::isfinite(options.bounds->min[k]) || !std::isfinite(options.bounds->max[k]))
        throw Error(Error::Kind::bad_input,
                    "The hull's bounds in {} are {:g} and {:g}, which is not finite; give min and "
                    "max in world units.",
                    "xyz"[k], options.bounds->min[k], options.bounds->max[k]);
      if (options.bounds->min[k] > options.bounds->max[k])
        throw Error(
            Error::Kind::bad_input,
            "The hull's bounds are turned inside out in {}: min is {:g}, max {:g}; give min "
            "below max.",
            "xyz"[k], options.bounds->min[k], options.bounds->max[k]);
      if (options.bounds->min[k] == options.bounds->max[k]) return;
    }
  if (views.empty()) return;
  if (options.unseen == Unseen::carve && statistics.cameras < views.size()) return;
  std::array<double, 6> box;
  const Lattice lattice = choose_lattice(options, box);
  cones.prepare(views, cameras, lattice, options.unseen, std::max(1, options.threads), used);
  statistics.seconds_prepare = watch.lap();
  if (options.unseen == Unseen::keep)
    std::erase_if(used, [](const Cone* cone) { return cone->size() == 0; });
  for (const Cone* cone : used)
    if (cone->size() == 0) return;
  if (!problem.set_up(used, box)) return;
  statistics.seconds_scene = watch.lap();
  const int threads = std::max(1, options.threads);
  clip_faces(threads);
  statistics.seconds_faces = watch.lap();
  assembler.assemble(problem, lattice, blocks, hull, face_normals);
  statistics.seconds_assemble = watch.lap();
  triangulate(threads);
  if (options.max_deviation > 0 || any_broken())
    simplifier.simplify(hull, face_normals, options.max_deviation);
  statistics.seconds_triangulate = watch.lap();
}

HullBuilder::HullBuilder() : state_(std::make_unique<State>()) {}
HullBuilder::~HullBuilder() = default;
HullBuilder::HullBuilder(HullBuilder&&) noexcept = default;
HullBuilder& HullBuilder::operator=(HullBuilder&&) noexcept = default;

const HullStatistics& HullBuilder::statistics() const {
  return state_->statistics;
}

const Hull& HullBuilder::build(std::span<const Silhouette> silhouettes,
                               const HullOptions& options) {
  State& s = *state_;
  if (!options.reuse) s.cones.clear();
  if (options.reuse && s.unchanged(silhouettes, options)) {
    // Nothing was decided and no time was spent.
    s.statistics = {.cameras = s.statistics.cameras,
                    .contour_vertices = s.statistics.contour_vertices,
                    .reused = true};
    return s.hull;
  }
  s.valid = false;
  s.build(silhouettes, options);
  s.remember(silhouettes, options);
  return s.hull;
}

}  // namespace polyhull
