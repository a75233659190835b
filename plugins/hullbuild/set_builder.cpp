// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/set_builder.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "hull/measure.h"
#include "silhouette/contour/trace.h"

namespace polyhull::element {
namespace {

/// Whether all but half a per cent of the frame is foreground (a blur may round the corners).
bool fills_frame(const View& view) {
  double area = 0.0;
  for (std::size_t i = 0; i < view.contours.size(); ++i) area += ring_area(view.contours.ring(i));
  return area > 0.995 * view.width * view.height;
}

std::string names_of(const Rig& rig) {
  std::string names;
  for (const Camera& camera : rig.cameras) names += (names.empty() ? "" : ", ") + camera.name;
  return names;
}

}  // namespace

SetBuilder::SetBuilder(Statistics& statistics)
    : statistics_(statistics), stage_(std::make_unique<HullStage>()) {
  statistics_.declare({"sets", "cameras", "faces", "vertices", "triangles", "contour-vertices",
                       "predicates", "exact-predicates", "hulls-reused", "empty-meshes",
                       "lone-silhouettes", "full-silhouettes", "holes-filled", "pieces-dropped"});
  for (const char* figure : {"undistort-ms", "repair-ms", "check-ms", "prepare-ms", "scene-ms",
                             "faces-ms", "assemble-ms", "triangulate-ms", "pack-ms", "threads-used",
                             "coarser-px", "subject-height-mm"})
    statistics_.set(figure, 0.0);
}

void SetBuilder::set_rig(Rig rig, bool built_in) {
  rig_ = std::move(rig);
  built_in_ = built_in;
  reset();
}

void SetBuilder::reset() {
  round_ = 0;
  cameras_.clear();
  stage_ = std::make_unique<HullStage>();
}

void SetBuilder::check(const std::string& where, const std::string& name, int width,
                       int height) const {
  const Camera* camera = rig_.find(name);
  const std::string rig =
      built_in_ ? "the built-in rig, which is used as long as no rig is set," : "the rig";
  if (camera == nullptr)
    throw Error(Error::Kind::bad_input,
                "{} brings views of camera '{}', which {} does not have; its cameras are {}. {}",
                where, name, rig, names_of(rig_),
                built_in_ ? "Set rig to the file of your cameras."
                          : "Set the pad's property camera to one of them.");
  if (camera->width != width || camera->height != height)
    throw Error(Error::Kind::bad_input,
                "{}: camera '{}' delivers pictures of {}x{}, but {} was calibrated at {}x{}. {}",
                where, name, width, height, rig, camera->width, camera->height,
                built_in_ ? "Set rig to the file of your cameras."
                          : "Set the camera to that size or calibrate it again.");
}

void SetBuilder::build_hull(GstElement* element, Mesh& mesh, const HullSettings& settings) {
  std::vector<CameraContours> contours;
  std::vector<const std::string*> with_foreground;
  for (const MeshView& view : mesh.views) {
    contours.push_back({&view.calibration, &view.view.contours});
    if (!view.view.contours.empty()) with_foreground.push_back(&view.view.camera);
    if (fills_frame(view.view))
      statistics_.warn(element, "full-silhouettes",
                       fmt::format("All that camera '{}' sees is foreground: its silhouette is "
                                   "the whole frame and says nothing about the subject. Check its "
                                   "keying, and that it does not stand inside the subject.",
                                   view.view.camera));
  }
  if (settings.surface == HullSurface::none) {
    repairs_.clear();
    doubts_.reset();
    return;
  }
  HullOptions& options = options_ = {};
  if (settings.use_bounds) options.bounds = rig_.bounds;
  options.unseen = settings.unseen;
  options.max_deviation = settings.max_deviation;
  options.threads = settings.threads > 0 ? static_cast<int>(settings.threads) : pool_threads();
  const LoopWatch loops;
  mesh.hull = stage_->build(contours, options, settings.weld_distance, settings.repair);
  take_repairs(mesh);
  take_doubts(mesh, settings);
  statistics_.set("threads-used", loops.threads());
  if (with_foreground.size() == 1)
    statistics_.warn(element, "lone-silhouettes",
                     fmt::format("Only camera '{}' sees a foreground. A hull needs two; an empty "
                                 "mesh goes on. Check the keying of the other cameras.",
                                 *with_foreground.front()));
  const HullStatistics& figures = stage_->statistics();
  statistics_.set("undistort-ms", 1e3 * stage_->seconds_undistort());
  statistics_.set("repair-ms", 1e3 * stage_->seconds_repair());
  statistics_.set_count("cameras", with_foreground.size());
  statistics_.set_count("contour-vertices", figures.contour_vertices);
  statistics_.count("predicates", figures.predicates);
  statistics_.count("exact-predicates", figures.exact_predicates);
  statistics_.count("hulls-reused", figures.reused);
  statistics_.set("prepare-ms", 1e3 * figures.seconds_prepare);
  statistics_.set("scene-ms", 1e3 * figures.seconds_scene);
  statistics_.set("faces-ms", 1e3 * figures.seconds_faces);
  statistics_.set("assemble-ms", 1e3 * figures.seconds_assemble);
  statistics_.set("triangulate-ms", 1e3 * figures.seconds_triangulate);
}

/// The faces' edges are those of the mended contours, so the mesh carries these.
void SetBuilder::take_repairs(Mesh& mesh) {
  repairs_.clear();
  for (std::size_t i = 0; i < mesh.views.size(); ++i) {
    const ViewRepair& repair = stage_->repair(i);
    if (repair.leave_out.empty()) continue;
    mesh.views[i].view.contours = stage_->contours(i);
    repairs_.push_back({mesh.views[i].view.camera, repair.holes, repair.pieces});
    statistics_.count("holes-filled", repair.holes);
    statistics_.count("pieces-dropped", repair.pieces);
  }
}

/// A few points of each outline and a few pairs of cameras, others in each set, so that a second's
/// sets have many.
void SetBuilder::take_doubts(const Mesh& mesh, const HullSettings& settings) {
  constexpr std::size_t points = 40, pairs = 64;
  const std::size_t views = mesh.views.size();
  doubts_.reset();
  tangencies_.clear();
  if (stage_->statistics().reused) return;
  doubts_.emplace();
  // Where hardly a camera sees anything the outlines are of noise, or of who is about to enter.
  const auto empty = std::count_if(mesh.views.begin(), mesh.views.end(),
                                   [](const MeshView& view) { return view.view.contours.empty(); });
  if (!settings.check_cameras || views < 3 || empty > 1) return;
  const Stopwatch watch;
  const auto each = static_cast<int>(std::max<std::size_t>(3, points / views));
  doubts_ = stage_->doubts(settings.unseen, each, round_);
  tangencies_ = stage_->tangencies(pairs, round_++);
  statistics_.set("check-ms", watch.milliseconds());
}

void SetBuilder::report(const Mesh& mesh, bool has_surface) {
  statistics_.count("sets");
  statistics_.count("empty-meshes", has_surface && mesh.hull.empty());
  statistics_.set_count("faces", mesh.hull.faces.size());
  statistics_.set_count("vertices", mesh.hull.vertices.size());
  statistics_.set_count("triangles", mesh.hull.triangles.size() / 3);
  is_empty_ = mesh.hull.empty();
  std::vector<Vec3> centres;
  for (const MeshView& view : mesh.views) centres.push_back(view.calibration.centre());
  size_ =
      subject_size(mesh.hull, centres, mesh.up, mesh.metres_per_unit, options_.bounds.has_value());
  if (size_.known) statistics_.set("subject-height-mm", 1e3 * size_.height);
  all_see_foreground_ =
      has_surface && mesh.views.size() >= 2 &&
      std::none_of(mesh.views.begin(), mesh.views.end(),
                   [](const MeshView& view) { return view.view.contours.empty(); });
}

std::optional<Bounds> SetBuilder::elsewhere() const {
  if (!options_.bounds || !is_empty_) return std::nullopt;
  HullOptions options = options_;
  options.bounds.reset();
  options.unseen = Unseen::carve;  // what keep needs is the bounds
  try {
    const Hull hull = stage_->rebuilt(options);
    if (hull.empty()) return std::nullopt;
    Bounds place{Vec3(hull.vertices[0]), Vec3(hull.vertices[0])};
    for (const Vec3f& vertex : hull.vertices) {
      place.min = glm::min(place.min, Vec3(vertex));
      place.max = glm::max(place.max, Vec3(vertex));
    }
    return Bounds{place.min + hull.origin, place.max + hull.origin};
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<double> SetBuilder::growth(const std::vector<std::string>& left) const {
  std::vector<std::size_t> lost;
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (std::find(left.begin(), left.end(), cameras_[i]) == left.end()) lost.push_back(i);
  if (cameras_.empty() || (is_empty_ && !lost.empty())) return std::nullopt;
  if (lost.empty()) return 1.0;
  if (lost.size() + 2 > cameras_.size()) return std::numeric_limits<double>::infinity();
  try {
    return enclosed_volume(stage_->rebuilt(options_, lost)) /
           enclosed_volume(stage_->rebuilt(options_));
  } catch (const Error&) {
    return std::numeric_limits<double>::infinity();
  }
}

GstBuffer* SetBuilder::build(GstElement* element, std::vector<SetView> views,
                             const HullSettings& settings, std::uint64_t trigger, double coarser,
                             float opacity) {
  // The rig's order, so that the order of pads and arrival changes nothing.
  const auto place = [&](const SetView& view) {
    return rig_.find(view.camera) - rig_.cameras.data();
  };
  std::sort(views.begin(), views.end(),
            [&](const SetView& a, const SetView& b) { return place(a) < place(b); });
  Mesh mesh;
  mesh.trigger = trigger;
  mesh.up = rig_.up;
  mesh.metres_per_unit = rig_.metres_per_unit();
  mesh.opacity = opacity;
  cameras_.clear();
  std::vector<PixelSource> pixels;
  for (const SetView& entry : views) {
    MeshView& view = mesh.views.emplace_back();
    view.calibration = *rig_.find(entry.camera);
    view.view = entry.view->view();
    view.view.camera = entry.camera;
    cameras_.push_back(entry.camera);
    pixels.push_back(entry.view->pixels());
    const std::int64_t time = view.view.capture_time;
    if (time != no_time && (mesh.capture_time == no_time || time < mesh.capture_time))
      mesh.capture_time = time;
  }
  coarsener_.coarsen(mesh, coarser);
  statistics_.set("coarser-px", coarser);
  build_hull(element, mesh, settings);
  report(mesh, settings.surface != HullSurface::none);
  Stopwatch watch;
  GstBuffer* buffer = make_mesh_buffer(std::move(mesh), pixels);
  statistics_.set("pack-ms", watch.milliseconds());
  return buffer;
}

}  // namespace polyhull::element
