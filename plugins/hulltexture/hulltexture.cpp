// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hulltexture: finds which cameras colour which part of a hull, and how much. It adds the
/// visibility of every triangle in every view, a weight for every vertex and view, and for every
/// view a small map of what it sees, with which composite colours each fragment. The pictures
/// themselves pass through uncopied.
#include <gst/base/gstbasetransform.h>

#include <memory>

#include "base/thread_pool.h"
#include "mesh/texture_mesh.h"
#include "plugins/common/memory/mesh_transform.h"

GST_DEBUG_CATEGORY_STATIC(hulltexture_debug);
#define GST_CAT_DEFAULT hulltexture_debug

namespace polyhull::element {

template <>
GType enum_type<TextureMethod>() {
  return register_enum<TextureMethod>(
      "PolyhullTextureMethod",
      {{TextureMethod::direct, "The one best camera of each triangle", "direct"},
       {TextureMethod::blend, "The best cameras, weighted point by point", "blend"}});
}

template <>
GType enum_type<TextureMetric>() {
  return register_enum<TextureMetric>(
      "PolyhullTextureMetric",
      {{TextureMetric::camera_normal,
        "By the angle between the surface's normal and the direction to the camera",
        "camera-normal"},
       {TextureMetric::viewing_angle,
        "By the angle between the directions to the camera and to the viewport", "viewing-angle"},
       {TextureMetric::lumigraph,
        "By that angle, more steeply, and by how finely the camera sees the surface",
        "lumigraph"}});
}

template <>
GType enum_type<TextureFill>() {
  return register_enum<TextureFill>(
      "PolyhullTextureFill",
      {{TextureFill::grey, "The colour of untextured", "grey"},
       {TextureFill::nearest, "The nearest colour that is seen, over the surface", "nearest"},
       {TextureFill::inpaint, "What is seen around, continued smoothly over the surface",
        "inpaint"}});
}

template <>
GType enum_type<Switch>() {
  return register_enum<Switch>("PolyhullSwitch",
                               {{Switch::off, "Off", "off"}, {Switch::on, "On", "on"}});
}

template <>
GType enum_type<TextureAlign>() {
  return register_enum<TextureAlign>(
      "PolyhullTextureAlign",
      {{TextureAlign::off, "Pictures stay as they are", "off"},
       {TextureAlign::flow, "Moved by what each shows of its neighbours' pictures", "flow"}});
}

}  // namespace polyhull::element

namespace {

using namespace polyhull;
using namespace polyhull::element;

using S = TextureSettings;

const Property<S> table[] = {
    property<&S::method>("method", "How the cameras' pictures are put together."),
    property<&S::metric>("metric", "By what a blend prefers one camera to another."),
    property<&S::cameras>(
        "cameras", "How many cameras are blended at each point (1 to 64): the best ones.", 1, 64),
    property<&S::occlusion>("occlusion",
                            "Whether a camera colours only what it sees. Without, a camera also "
                            "colours what lies hidden behind something else; faster."),
    shown_property<&S::untextured>("untextured",
                                   "The colour of what no camera sees with fill=grey, as "
                                   "big-endian ARGB (0 to 0xffffffff; alpha is not used).",
                                   0, 4294967295.0),
    property<&S::fill>("fill", "What colours the surface where no camera sees it."),
    shown_property<&S::balance>("balance",
                                "Whether the cameras' gains are found by which their colours agree "
                                "where several see the same place."),
    property<&S::balance_time>("balance-time",
                               "Over how many seconds gains follow the cameras (0 to 3600); 0 "
                               "finds them anew in every mesh.",
                               0, 3600),
    property<&S::fade_width>("fade-width",
                             "Over how many pixels of a camera its share rises from none at the "
                             "rim of what it sees to all (0 to 200).",
                             0, 200),
    property<&S::map_size>("map-size",
                           "Texels of the longer side of the map of what a camera sees (16 to "
                           "2048): more draw the rims of what hides finer, and cost time.",
                           16, 2048),
    property<&S::threads>("threads",
                          "How many threads of the pool that all elements share may work (1 to "
                          "256); 0 means all of them.",
                          0, 256),
    property<&S::align>("align",
                        "Whether the cameras' pictures are moved onto each other where they "
                        "disagree. Acts on a blend with occlusion."),
    shown_property<&S::memory>(
        "memory",
        "Whether what no camera sees takes the colours that were seen there earlier, carried along "
        "by the surface's motion. Not with fill=grey."),
    property<&S::memory_time>("memory-time",
                              "After how many seconds unseen a remembered colour counts half (0 to "
                              "86400); 0 remembers nothing.",
                              0, 86400),
};
constexpr std::span<const Property<S>> properties(table);

struct HullTexture {
  static constexpr char type_name[] = "PolyhullHullTexture";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit HullTexture(gpointer object) {
    statistics.declare({"meshes", "texturings-reused", "pieces", "pieces-sampled",
                        "meshes-unusable", "flows", "pairs", "pairs-reused"});
    set_up_mesh_transform(object);
  }

  TextureSettings settings;  // under the object lock
  Statistics statistics{"hulltexture-stats"};
  std::unique_ptr<MeshTexturer> texturer;  // of the streaming thread
};

void report(HullTexture& self, const TextureStatistics& times) {
  self.statistics.count("meshes");
  if (times.reused) self.statistics.count("texturings-reused");
  self.statistics.count("pieces", times.pieces);
  self.statistics.count("pieces-sampled", times.sampled);
  self.statistics.set("visibility-ms", 1e3 * times.seconds_visibility);
  self.statistics.set("weights-ms", 1e3 * times.seconds_weights);
}

void report(HullTexture& self, const MemoryStatistics& memory) {
  self.statistics.set_count("memory-points", memory.points);
  self.statistics.set_count("memory-vertices", memory.vertices);
  self.statistics.set("memory-trust", memory.trust);
  self.statistics.set("memory-error", memory.error);
  self.statistics.set("memory-error-without", memory.error_without);
}

bool texture_mesh(GstBaseTransform* transform, Mesh& mesh) {
  HullTexture& self = state_of<HullTexture>(transform);
  const TextureSettings settings = snapshot(transform, self.settings);
  const LoopWatch loops;
  self.texturer->texture(mesh, settings);
  self.statistics.set("threads-used", loops.threads());
  report(self, self.texturer->statistics());
  if (self.texturer->statistics().reused)
    GST_DEBUG_OBJECT(transform, "the hull has not changed: its visibility is used again");
  self.statistics.set("balance-ms", 1e3 * self.texturer->seconds_balance());
  self.statistics.set("fill-ms", 1e3 * self.texturer->seconds_fill());
  const AlignStatistics& align = self.texturer->align_statistics();
  self.statistics.count("flows", align.flows);
  self.statistics.count("pairs", align.pairs);
  self.statistics.count("pairs-reused", align.pairs_reused);
  self.statistics.set("align-ms", 1e3 * self.texturer->seconds_align());
  report(self, self.texturer->memory_statistics());
  self.statistics.set("memory-ms", 1e3 * self.texturer->seconds_memory());
  return true;
}

/// What was learned of the cameras and the subject ends with a flush.
gboolean handle_event(GstBaseTransform* base, GstEvent* event) {
  HullTexture& self = state_of<HullTexture>(base);
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP && self.texturer) self.texturer->forget();
  return GST_BASE_TRANSFORM_CLASS(parent_class<HullTexture>())->sink_event(base, event);
}

void HullTexture::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(hulltexture_debug, "hulltexture", 0, "textures visual hulls");
  add_properties<HullTexture>(klass, properties, &HullTexture::settings);
  add_statistics<HullTexture>(
      klass,
      "Counters since the start: meshes, texturings-reused (the hull had not changed), pieces (of "
      "triangles that face a camera, summed over the cameras), pieces-sampled (those that the edge "
      "of something before them may cross), meshes-unusable, and with align=flow pairs (of cameras "
      "whose pictures were compared), pairs-reused (those of which nothing had changed) and flows "
      "(those that disagree); and of the last mesh the milliseconds for visibility with the maps, "
      "for weights, for the balance, for the fill, for align=flow and for the memory, with "
      "memory=on memory-points (that are remembered), memory-vertices (whose fill is remembered by "
      "half or more), memory-trust (0 to 1, as memory-error and memory-error-without tell: how far "
      "off remembered colours and the fill were of what was seen again, root mean squares in codes "
      "of 0 to 255), and threads-used (how many threads took part in its parallel loops, on "
      "average).");
  set_metadata(klass, "Visual hull texturing", "Filter/Video",
               "Finds which cameras colour which part of a visual hull, with occlusion");
  install_mesh_transform<HullTexture, &HullTexture::texturer, texture_mesh>(klass);
  GST_BASE_TRANSFORM_CLASS(klass)->sink_event = handle_event;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(hulltexture, "hulltexture", GST_RANK_NONE, type_of<HullTexture>())
