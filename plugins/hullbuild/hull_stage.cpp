// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/hull_stage.h"

#include <algorithm>
#include <chrono>

#include "base/error.h"
#include "base/thread_pool.h"
#include "hull/weld.h"
#include "silhouette/contour/trace.h"

namespace polyhull::element {
namespace {

class Stopwatch {
 public:
  double milliseconds() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> passed = now - last_;
    last_ = now;
    return passed.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

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

HullStage::HullStage(Statistics& statistics)
    : statistics_(statistics), builder_(std::make_unique<HullBuilder>()) {
  statistics_.declare({"sets", "cameras", "faces", "vertices", "triangles", "contour-vertices",
                       "predicates", "exact-predicates", "hulls-reused", "empty-meshes",
                       "lone-silhouettes", "full-silhouettes"});
  for (const char* figure : {"undistort-ms", "prepare-ms", "scene-ms", "faces-ms", "assemble-ms",
                             "triangulate-ms", "pack-ms"})
    statistics_.set(figure, 0.0);
}

void HullStage::set_rig(Rig rig) {
  rig_ = std::move(rig);
  reset();
}

void HullStage::reset() {
  contours_.clear();
  builder_ = std::make_unique<HullBuilder>();
  mesh_ = Mesh();
  hull_is_builders_ = false;
}

void HullStage::check(const std::string& where, const std::string& name, int width,
                      int height) const {
  const Camera* camera = rig_.find(name);
  if (camera == nullptr)
    throw Error(Error::Kind::bad_input, where + " brings views of camera \"" + name +
                                            "\", which the rig does not have; its "
                                            "cameras are " +
                                            names_of(rig_) +
                                            ". Set the pad's property camera to one of them");
  if (camera->width != width || camera->height != height)
    throw Error(Error::Kind::bad_input,
                where + ": camera \"" + name + "\" delivers pictures of " + std::to_string(width) +
                    "x" + std::to_string(height) + ", but the rig was calibrated at " +
                    std::to_string(camera->width) + "x" + std::to_string(camera->height) +
                    ". Set the camera to that size or calibrate it again");
}

const UndistortedRings& HullStage::undistorted(const Camera& camera, const Rings& real) {
  Contours& known = contours_[camera.name];
  if (!known.known || known.real != real) {
    known.real = real;
    known.ideal = undistort_rings(camera, real);
    known.known = true;
  }
  return known.ideal;
}

void HullStage::build_hull(GstElement* element, const HullParameters& parameters) {
  Stopwatch watch;
  std::vector<const UndistortedRings*> contours;
  std::vector<Silhouette> silhouettes;
  std::vector<const std::string*> with_foreground;
  for (const MeshView& view : mesh_.views) {
    contours.push_back(&undistorted(view.calibration, view.view.contours));
    silhouettes.push_back({&view.calibration, &contours.back()->rings});
    if (!view.view.contours.empty()) with_foreground.push_back(&view.view.camera);
    if (fills_frame(view.view))
      statistics_.warn(element, "full-silhouettes",
                       "All that camera \"" + view.view.camera +
                           "\" sees is foreground: its silhouette is the whole frame and says "
                           "nothing about the subject. Check its keying, and that it does not "
                           "stand inside the subject.");
  }
  statistics_.set("undistort-ms", watch.milliseconds());
  statistics_.set_count("cameras", with_foreground.size());
  if (with_foreground.size() < 2) {
    mesh_.hull = Hull();
    hull_is_builders_ = false;
    report_hull({});
    if (with_foreground.size() == 1)
      statistics_.warn(
          element, "lone-silhouettes",
          "Only camera \"" + *with_foreground.front() +
              "\" sees a foreground. A hull needs two; an empty mesh goes on. Check the "
              "keying of the other cameras.");
    return;
  }
  HullOptions options;
  if (parameters.use_bounds) options.bounds = rig_.bounds;
  options.unseen = parameters.unseen;
  options.max_deviation = parameters.max_deviation;
  options.threads = parameters.threads > 0 ? parameters.threads : pool_threads();
  const Hull& hull = builder_->build(silhouettes, options);
  if (!builder_->statistics().reused || !hull_is_builders_ || welded_ != parameters.weld_distance) {
    hull_is_builders_ = false;  // until all of the following is done
    mesh_.hull = hull;
    for (HullFace& face : mesh_.hull.faces)
      if (face.view >= 0) face.edge = contours[face.view]->source[face.edge];
    weld_vertices(mesh_.hull, parameters.weld_distance);
    welded_ = parameters.weld_distance;
    hull_is_builders_ = true;
  }
  report_hull(builder_->statistics());
}

void HullStage::report_hull(const HullStatistics& figures) {
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

bool HullStage::all_see_foreground() const {
  return mesh_.views.size() >= 2 &&
         std::none_of(mesh_.views.begin(), mesh_.views.end(),
                      [](const MeshView& view) { return view.view.contours.empty(); });
}

void HullStage::report() {
  statistics_.count("sets");
  statistics_.count("empty-meshes", mesh_.hull.empty());
  statistics_.set_count("faces", mesh_.hull.faces.size());
  statistics_.set_count("vertices", mesh_.hull.vertices.size());
  statistics_.set_count("triangles", mesh_.hull.triangles.size() / 3);
}

GstBuffer* HullStage::build(GstElement* element, std::vector<SetView> views,
                            const HullParameters& parameters, std::uint64_t trigger) {
  // The rig's order, so that the order of pads and arrival changes nothing.
  const auto place = [&](const SetView& view) {
    return rig_.find(view.camera) - rig_.cameras.data();
  };
  std::sort(views.begin(), views.end(),
            [&](const SetView& a, const SetView& b) { return place(a) < place(b); });
  mesh_.trigger = trigger;
  mesh_.up = rig_.up;
  mesh_.metres_per_unit = rig_.metres_per_unit();
  std::vector<PixelSource> pixels;
  mesh_.views.clear();
  mesh_.capture_time = no_time;
  for (const SetView& entry : views) {
    MeshView& view = mesh_.views.emplace_back();
    view.calibration = *rig_.find(entry.camera);
    view.view = entry.view->view();
    view.view.camera = entry.camera;
    pixels.push_back(entry.view->pixels());
    const std::int64_t time = view.view.capture_time;
    if (time != no_time && (mesh_.capture_time == no_time || time < mesh_.capture_time))
      mesh_.capture_time = time;
  }
  build_hull(element, parameters);
  Stopwatch watch;
  GstBuffer* buffer = make_mesh_buffer(mesh_, pixels);
  statistics_.set("pack-ms", watch.milliseconds());
  report();
  return buffer;
}

}  // namespace polyhull::element
