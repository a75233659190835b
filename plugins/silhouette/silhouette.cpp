// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// silhouette: chromamatte, gaussblur and contourfind in one pass over the frame, without writing a
/// keyed picture in between. It has the properties of the three; the three called `method` are
/// key-method, blur-method and contour-method here. With the same settings its views are the same
/// bytes as those of the three elements one after the other.
///
/// gst-launch-1.0 videotestsrc num-buffers=60 pattern=ball background-color=0xff10c030 !
///     video/x-raw,format=NV12 ! silhouette camera=cam0 key=green sigma=2 tolerance=1 ! fakesink
#include "plugins/silhouette/silhouette.h"

#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include <span>
#include <utility>

#include "plugins/common/guard.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/silhouette/blur_properties.h"
#include "plugins/common/silhouette/contour_properties.h"
#include "plugins/common/silhouette/key_configuration.h"
#include "plugins/common/silhouette/key_properties.h"
#include "plugins/common/silhouette/tolerance_control.h"
#include "plugins/common/silhouette/view_element.h"
#include "plugins/common/silhouette/view_writer.h"
#include "plugins/common/statistics.h"
#include "plugins/common/transform.h"
#include "silhouette/silhouette.h"

GST_DEBUG_CATEGORY_STATIC(silhouette_debug);
#define GST_CAT_DEFAULT silhouette_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

/// The pixels of the view before, which a frame that changed nothing sends again.
struct Sent {
  GstMemory* pixels = nullptr;
  Rectangle roi;

  ~Sent() { forget(); }
  void forget() {
    if (pixels != nullptr) gst_memory_unref(pixels);
    pixels = nullptr;
  }
  void keep(GstMemory* memory, const Rectangle& region) {
    forget();
    pixels = gst_memory_ref(memory);
    roi = region;
  }
};

struct Private {
  KeyValues key;  // these three: under the object lock
  BlurSettings blur;
  ContourValues contour;

  Statistics statistics{"silhouette-stats"};
  ToleranceControl control;
  PaceFilter pace;
  GstVideoInfo info;  // the rest belongs to the streaming thread
  FrameView layout;
  KeyConfiguration configuration;
  SilhouetteSettings settings;
  bool configured = false;
  Silhouetter silhouetter;
  int learning = 0;
  std::uint64_t reused = 0;
  ViewWriter writer;
  View view;  // that of the last frame; its memory is used again
  Sent sent;
};

struct PolyhullSilhouette {
  GstBaseTransform parent;
  Private* priv;
};

struct PolyhullSilhouetteClass {
  GstBaseTransformClass parent_class;
};

GType polyhull_silhouette_get_type();
G_DEFINE_TYPE(PolyhullSilhouette, polyhull_silhouette, GST_TYPE_BASE_TRANSFORM)

PolyhullSilhouette* self_of(gpointer object) {
  return static_cast<PolyhullSilhouette*>(object);
}

std::span<const Property<KeyValues>> key_table() {
  static const auto table = renamed(key_properties(), "method", "key-method");
  return table;
}
std::span<const Property<BlurSettings>> blur_table() {
  static const auto table = renamed(blur_properties(), "method", "blur-method");
  return table;
}
std::span<const Property<ContourValues>> contour_table() {
  static const auto table = renamed(contour_properties(), "method", "contour-method");
  return table;
}

enum { first_key = 1 };
guint first_blur, first_contour, stats_id;

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Private& p = *self_of(object)->priv;
  if (set_property(object, key_table(), first_key, p.key, id, value)) return;
  if (set_property(object, blur_table(), first_blur, p.blur, id, value)) return;
  if (set_property(object, contour_table(), first_contour, p.contour, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& p = *self_of(object)->priv;
  if (id == stats_id) {
    g_value_take_boxed(value, p.statistics.structure());
    return;
  }
  if (get_property(object, key_table(), first_key, p.key, id, value)) return;
  if (get_property(object, blur_table(), first_blur, p.blur, id, value)) return;
  if (get_property(object, contour_table(), first_contour, p.contour, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

gboolean set_caps(GstBaseTransform* base, GstCaps* in, GstCaps*) {
  Private& priv = *self_of(base)->priv;
  return guarded(GST_ELEMENT_CAST(base), FALSE, [&]() -> gboolean {
    if (!gst_video_info_from_caps(&priv.info, in)) return FALSE;
    priv.layout = frame_template(priv.info);
    priv.control.set_stream_rate(GST_VIDEO_INFO_FPS_N(&priv.info),
                                 GST_VIDEO_INFO_FPS_D(&priv.info));
    priv.sent.forget();
    return TRUE;
  });
}

gboolean propose_allocation(GstBaseTransform* base, GstQuery* decide, GstQuery* query) {
  gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  return GST_BASE_TRANSFORM_CLASS(polyhull_silhouette_parent_class)
      ->propose_allocation(base, decide, query);
}

/// Takes over what has changed since the last frame; returns whether anything did.
bool configure(PolyhullSilhouette* self, const ContourValues& contour, double tolerance) {
  Private& priv = *self->priv;
  const KeyValues key = snapshot(self, priv.key);
  const std::string camera = contour.camera.empty() ? GST_OBJECT_NAME(self) : contour.camera;
  bool changed = false;

  SilhouetteSettings wanted = priv.settings;
  wanted.blur = snapshot(self, priv.blur);
  wanted.method = contour.method;
  wanted.correct_curvature = contour.correct_curvature;
  wanted.approximate = contour.approximation(tolerance);
  wanted.reuse = contour.reuse;
  if (!priv.configured || wanted != priv.settings) {
    if (priv.configured) priv.silhouetter.set(wanted);
    priv.settings = wanted;
    changed = true;
  }
  priv.configuration.apply(GST_ELEMENT_CAST(self), priv.statistics, key, camera, priv.layout.width,
                           priv.layout.height, [&](const KeySettings& settings) {
                             wanted.key = settings;
                             priv.silhouetter.set(wanted);
                             priv.settings = wanted;
                             priv.configured = true;
                             changed = true;
                           });
  if (priv.configuration.due_for_sampling(key.resample)) {
    priv.silhouetter.keyer().recalibrate();
    changed = true;
  }
  if (key.learn_plate != priv.learning) {
    priv.learning = key.learn_plate;
    if (priv.learning > 0) priv.silhouetter.keyer().learn_plate(priv.learning);
    changed = true;
  }
  return changed;
}

GstBuffer* make_view(PolyhullSilhouette* self, const GstVideoFrame& video) {
  Private& priv = *self->priv;
  const ContourValues values = snapshot(self, priv.contour);
  const double tolerance = tolerance_of(values, priv.control);
  const bool changed = configure(self, values, tolerance);
  const FrameView frame = frame_view(priv.layout, video);
  View& view = priv.view;
  begin_view(GST_BASE_TRANSFORM_CAST(self), values, video, view);
  view.contours = priv.silhouetter.process(frame);
  view.roi = bounding_rectangle(view.contours, view.width, view.height);
  const SilhouetteStats& stats = priv.silhouetter.stats();
  const bool reused = stats.reused != priv.reused;
  priv.reused = stats.reused;
  report_contours(priv.statistics, stats.last, reused, tolerance);
  report_calibration(std::as_const(priv.silhouetter).keyer().calibration(), GST_ELEMENT_CAST(self),
                     priv.statistics);
  if (view.roi.empty()) {
    priv.sent.forget();
    return priv.writer.write(view, nullptr, video.buffer);
  }

  view.format = PixelFormat::rgba;
  view.stride = view.roi.width * 4;
  const std::size_t size = static_cast<std::size_t>(view.stride) * view.roi.height;
  if (reused && !changed && priv.sent.pixels != nullptr && priv.sent.roi == view.roi) {
    const ReadableMemory pixels(priv.sent.pixels);
    view.pixels = pixels.bytes();
    return priv.writer.write(view, priv.sent.pixels, video.buffer);
  }
  WritableMemory pixels(priv.writer.allocate(size));
  priv.silhouetter.write_rgba(frame, view.roi, pixels.data(), view.stride);
  view.pixels = pixels.bytes();
  priv.sent.keep(pixels.memory(), view.roi);
  return priv.writer.write(view, pixels.memory(), video.buffer);
}

GstFlowReturn prepare_output_buffer(GstBaseTransform* base, GstBuffer* input, GstBuffer** output) {
  PolyhullSilhouette* self = self_of(base);
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const MappedFrame frame(self->priv->info, input);
    *output = make_view(self, frame.frame());
    return GST_FLOW_OK;
  });
}

/// The view is made where its size is known, in prepare_output_buffer().
GstFlowReturn transform(GstBaseTransform*, GstBuffer*, GstBuffer*) {
  return GST_FLOW_OK;
}

GstFlowReturn submit_input_buffer(GstBaseTransform* base, gboolean discontinuous,
                                  GstBuffer* input) {
  Private& priv = *self_of(base)->priv;
  return submit_wanted(base, priv.pace, priv.statistics,
                       GST_BASE_TRANSFORM_CLASS(polyhull_silhouette_parent_class), discontinuous,
                       input);
}

gboolean src_event(GstBaseTransform* base, GstEvent* event) {
  Private& priv = *self_of(base)->priv;
  priv.pace.hear(event);
  if (GST_EVENT_TYPE(event) == GST_EVENT_QOS) {
    const ContourValues values = snapshot(base, priv.contour);
    if (values.adaptive) priv.control.observe(event, values.target_rate);
  }
  return GST_BASE_TRANSFORM_CLASS(polyhull_silhouette_parent_class)->src_event(base, event);
}

gboolean start(GstBaseTransform* base) {
  Private& priv = *self_of(base)->priv;
  priv.silhouetter = Silhouetter();
  priv.configuration = KeyConfiguration();
  priv.configured = false;
  priv.learning = 0;
  priv.reused = 0;
  priv.control.reset();
  priv.pace.reset();
  priv.statistics.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  Private& priv = *self_of(base)->priv;
  priv.sent.forget();
  priv.silhouetter = Silhouetter();
  return TRUE;
}

void polyhull_silhouette_init(PolyhullSilhouette* self) {
  self->priv = new Private;
  gst_video_info_init(&self->priv->info);
  declare_contour_statistics(self->priv->statistics);
  declare_key_statistics(self->priv->statistics);
  self->priv->statistics.declare({"frames-unwanted"});
}

void finalize(GObject* object) {
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_silhouette_parent_class)->finalize(object);
}

void polyhull_silhouette_class_init(PolyhullSilhouetteClass* klass) {
  GST_DEBUG_CATEGORY_INIT(silhouette_debug, "silhouette", 0, "silhouettes in one pass");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  first_blur = install_properties(object_class, key_table(), first_key);
  first_contour = install_properties(object_class, blur_table(), first_blur);
  stats_id = install_properties(object_class, contour_table(), first_contour);
  g_object_class_install_property(
      object_class, stats_id,
      statistics_property("Counters since the element started, and figures of the last frame: all "
                          "that the stats of chromamatte and contourfind hold."));

  auto* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(
      element_class, "Silhouette", "Filter/Analyzer/Video",
      "Keys, blurs and traces a subject in one pass: video in, views with contours out",
      "polyhull");
  add_template(klass, "sink", GST_PAD_SINK, GST_VIDEO_CAPS_MAKE(POLYHULL_KEYABLE_FORMATS));
  add_template(klass, "src", GST_PAD_SRC, view_caps);

  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->transform_caps = view_transform_caps;
  base_class->set_caps = set_caps;
  base_class->propose_allocation = propose_allocation;
  base_class->prepare_output_buffer = prepare_output_buffer;
  base_class->transform = transform;
  base_class->before_transform = sync_controlled_properties;
  base_class->src_event = src_event;
  base_class->submit_input_buffer = submit_input_buffer;
  base_class->start = start;
  base_class->stop = stop;
  base_class->passthrough_on_same_caps = FALSE;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(silhouette, "silhouette", GST_RANK_NONE, polyhull_silhouette_get_type())
