// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullrefine: puts the smooth surface that touches every silhouette in the place of a visual hull.
#include <gst/base/gstbasetransform.h>

#include <memory>

#include "base/thread_pool.h"
#include "plugins/common/memory/mesh_transform.h"
#include "refine/refine.h"

GST_DEBUG_CATEGORY_STATIC(hullrefine_debug);
#define GST_CAT_DEFAULT hullrefine_debug

namespace polyhull::element {

template <>
GType enum_type<RefineQuality>() {
  return register_enum<RefineQuality>(
      "PolyhullRefineQuality", {{RefineQuality::off, "The hull as it is", "off"},
                                {RefineQuality::fast, "A cell of 24 mm and fewer steps", "fast"},
                                {RefineQuality::good, "A cell of 24 mm", "good"},
                                {RefineQuality::fine, "A cell of 16 mm", "fine"}});
}

}  // namespace polyhull::element

namespace {

using namespace polyhull;
using namespace polyhull::element;

const Property<RefineSettings> table[] = {
    property<&RefineSettings::quality>(
        "quality", "How much work the surface is worth. off: the hull passes as it is."),
    property<&RefineSettings::cell>(
        "cell",
        "Metres between the nodes of the grid that the surface is found on (0 to 1): the smallest "
        "triangles are half as large, and what is thinner than a quarter of it may break up. 0: by "
        "the quality.",
        0, 1),
    property<&RefineSettings::photo>(
        "photo",
        "Whether to carve hollows that no silhouette shows, where the cameras' colours contradict "
        "the surface: for 12 cameras and more, and for stills, since it takes a second and more. "
        "Needs every view's pixels."),
    property<&RefineSettings::threads>("threads",
                                       "How many threads of the pool that all elements share may "
                                       "work (1 to 256); 0 means all of them.",
                                       0, 256),
};
constexpr std::span<const Property<RefineSettings>> properties(table);

struct HullRefine {
  static constexpr char type_name[] = "PolyhullHullRefine";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit HullRefine(gpointer object) {
    statistics.declare(
        {"meshes", "surfaces-reused", "meshes-uncarved", "meshes-unrefined", "meshes-unusable"});
    set_up_mesh_transform(object);
  }

  RefineSettings settings;  // under the object lock
  Statistics statistics{"hullrefine-stats"};
  std::unique_ptr<HullRefiner> refiner;  // of the streaming thread
};

void report(HullRefine& self, const RefineStatistics& done) {
  self.statistics.count("meshes");
  if (done.reused) self.statistics.count("surfaces-reused");
  self.statistics.set_count("parts", done.parts);
  self.statistics.set_count("rays", done.rays);
  self.statistics.set_count("thin-rays", done.thin_rays);
  self.statistics.set_count("pieces-dropped", done.pieces_dropped);
  self.statistics.set_count("nodes", done.nodes);
  self.statistics.set("distances-ms", 1e3 * done.seconds_distances);
  self.statistics.set("rays-ms", 1e3 * done.seconds_rays);
  self.statistics.set("flow-ms", 1e3 * done.seconds_flow);
  self.statistics.set("plate-ms", 1e3 * done.seconds_plate);
  self.statistics.set("fine-ms", 1e3 * done.seconds_fine);
  self.statistics.set("photo-ms", 1e3 * done.seconds_photo);
  self.statistics.set("surface-ms", 1e3 * done.seconds_surface);
}

/// The pixels of all views of \p mesh; none, and a warning, where a view has none.
std::vector<ViewPixels> pixels_of(HullRefine& self, GstElement* element, const Mesh& mesh) {
  std::vector<ViewPixels> pixels;
  for (const MeshView& view : mesh.views) {
    if (view.view.format == PixelFormat::none || view.view.roi.empty()) {
      self.statistics.warn(
          element, "meshes-uncarved",
          fmt::format("A surface was not carved by colours: camera {} sends no pixels.",
                      view.view.camera));
      return {};
    }
    pixels.push_back({view.view.pixels.data(), view.view.stride,
                      view.view.format == PixelFormat::rgba ? 4 : 1, view.view.roi});
  }
  return pixels;
}

/// Whether \p mesh has become another.
bool refine_mesh(GstBaseTransform* transform, Mesh& mesh) {
  HullRefine& self = state_of<HullRefine>(transform);
  RefineSettings settings = snapshot(transform, self.settings);
  if (settings.quality == RefineQuality::off || mesh.hull.empty() || mesh.views.empty()) {
    GST_DEBUG_OBJECT(transform, "nothing to refine: %s",
                     settings.quality == RefineQuality::off ? "quality=off" : "the hull is empty");
    return false;
  }
  std::vector<CameraContours> views;
  for (const MeshView& view : mesh.views) views.push_back({&view.calibration, &view.view.contours});
  std::vector<ViewPixels> pixels;
  if (settings.photo) pixels = pixels_of(self, GST_ELEMENT_CAST(transform), mesh);
  settings.photo = !pixels.empty();
  const LoopWatch loops;
  try {
    mesh.hull = self.refiner->refine(mesh.hull, views, mesh.metres_per_unit, settings, pixels);
  } catch (const std::exception& error) {
    self.statistics.warn(GST_ELEMENT_CAST(transform), "meshes-unrefined",
                         fmt::format("A hull passed as it was: {}", error.what()));
    return false;
  }
  if (self.refiner->statistics().reused)
    GST_DEBUG_OBJECT(transform, "nothing has changed: the surface before is used again");
  mesh.texturing.reset();  // it was the hull's
  self.statistics.set("threads-used", loops.threads());
  report(self, self.refiner->statistics());
  return true;
}

void HullRefine::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(hullrefine_debug, "hullrefine", 0, "refines visual hulls");
  add_properties<HullRefine>(klass, properties, &HullRefine::settings);
  add_statistics<HullRefine>(
      klass,
      "Counters since the start: meshes, surfaces-reused (nothing had changed), meshes-uncarved "
      "(photo=true, but a view had no pixels), meshes-unrefined (hulls that passed as they were, "
      "with a warning), meshes-unusable; and of the last mesh parts (of the hull, with a grid "
      "each), rays (that touch the body), thin-rays (where the hull is too thin for the grid and "
      "was kept), pieces-dropped (loose ones that no silhouette needs), nodes (of the grids), the "
      "milliseconds for distances, rays, flow, plate, the fine grid, colours and the surface, and "
      "threads-used (how many threads took part in its parallel loops, on average).");
  set_metadata(klass, "Visual hull refinement", "Filter/Video",
               "Finds the smooth surface inside a visual hull that touches every silhouette");
  install_mesh_transform<HullRefine, &HullRefine::refiner, refine_mesh>(klass);
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(hullrefine, "hullrefine", GST_RANK_NONE, type_of<HullRefine>())
