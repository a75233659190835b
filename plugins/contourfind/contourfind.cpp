// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// contourfind: turns a keyed frame (RGBA with the matte in alpha, or GRAY8) into a view: the
/// silhouette's contours with sub-pixel precision as polygons with few vertices, and only those
/// pixels of the frame that the silhouette covers. A frame without foreground becomes an empty
/// view.
///
/// Properties that matter: `camera`, the name in the rig file; `tolerance` in pixels, which trades
/// vertices (and the time of the hull) for error; `adaptive`, which sets it by the time there is.
///
/// gst-launch-1.0 videotestsrc num-buffers=60 pattern=ball background-color=0xff10c030 !
///     chromamatte key=green ! gaussblur sigma=2 ! contourfind camera=cam0 tolerance=1 ! fakesink
#include "plugins/contourfind/contourfind.h"

#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include <cstring>

#include "plugins/common/guard.h"
#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/silhouette/contour_properties.h"
#include "plugins/common/silhouette/contour_stage.h"
#include "plugins/common/silhouette/tolerance_control.h"
#include "plugins/common/silhouette/view_element.h"
#include "plugins/common/silhouette/view_writer.h"
#include "plugins/common/statistics.h"
#include "plugins/common/transform.h"
#include "silhouette/silhouette.h"

GST_DEBUG_CATEGORY_STATIC(contourfind_debug);
#define GST_CAT_DEFAULT contourfind_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Private {
  ContourValues values;  // under the object lock

  Statistics statistics{"contourfind-stats"};
  ToleranceControl control;
  GstVideoInfo info;  // the rest belongs to the streaming thread
  ContourStage stage;
  PlanePool<Matte> mattes;
  ViewWriter writer;
  View view;  // that of the last frame; its memory is used again
};

struct PolyhullContourFind {
  GstBaseTransform parent;
  Private* priv;
};

struct PolyhullContourFindClass {
  GstBaseTransformClass parent_class;
};

enum { first_contour = 1 };
guint stats_id;

GType polyhull_contour_find_get_type();
G_DEFINE_TYPE(PolyhullContourFind, polyhull_contour_find, GST_TYPE_BASE_TRANSFORM)

PolyhullContourFind* self_of(gpointer object) {
  return static_cast<PolyhullContourFind*>(object);
}

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (set_property(object, contour_properties(), first_contour, priv.values, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (id == stats_id) {
    g_value_take_boxed(value, priv.statistics.structure());
    return;
  }
  if (get_property(object, contour_properties(), first_contour, priv.values, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

gboolean set_caps(GstBaseTransform* base, GstCaps* in, GstCaps*) {
  Private& priv = *self_of(base)->priv;
  if (!gst_video_info_from_caps(&priv.info, in)) return FALSE;
  priv.control.set_stream_rate(GST_VIDEO_INFO_FPS_N(&priv.info), GST_VIDEO_INFO_FPS_D(&priv.info));
  priv.stage.reset();
  return TRUE;
}

gboolean propose_allocation(GstBaseTransform* base, GstQuery* decide, GstQuery* query) {
  gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  return GST_BASE_TRANSFORM_CLASS(polyhull_contour_find_parent_class)
      ->propose_allocation(base, decide, query);
}

MatteContent content_of(Private& priv, const GstVideoFrame& frame) {
  const int width = GST_VIDEO_FRAME_WIDTH(&frame);
  const int height = GST_VIDEO_FRAME_HEIGHT(&frame);
  const bool rgba = GST_VIDEO_FRAME_FORMAT(&frame) == GST_VIDEO_FORMAT_RGBA;
  const int step = rgba ? 4 : 1;
  const auto* first =
      static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) + (rgba ? 3 : 0);
  const std::ptrdiff_t stride = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0);
  const MatteContent* attached = get_matte(frame.buffer, width, height);
  if (attached != nullptr &&
      (is_unwritten(frame.buffer) || is_alpha_of(*attached, first, stride, step)))
    return *attached;
  auto matte = priv.mattes.take();
  load_matte(first, stride, step, width, height, *matte);
  return {matte, nullptr, 0.0};
}

GstBuffer* make_view(PolyhullContourFind* self, const GstVideoFrame& frame) {
  Private& priv = *self->priv;
  const ContourValues values = snapshot(self, priv.values);
  const double tolerance = tolerance_of(values, priv.control);
  View& view = priv.view;
  begin_view(GST_BASE_TRANSFORM_CAST(self), values, frame, view);
  view.contours = priv.stage.find(content_of(priv, frame), values, tolerance);
  view.roi = bounding_rectangle(view.contours, view.width, view.height);
  report_contours(priv.statistics, priv.stage.counts(), priv.stage.reused(), tolerance);
  if (view.roi.empty()) return priv.writer.write(view, nullptr, frame.buffer);

  const int pixel = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 0);
  view.format = pixel == 4 ? PixelFormat::rgba : PixelFormat::grey;
  view.stride = view.roi.width * pixel;
  const std::size_t stride = view.stride;
  WritableMemory pixels(priv.writer.allocate(stride * view.roi.height));
  const auto* source = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
                       static_cast<std::ptrdiff_t>(pixel) * view.roi.x;
  const std::ptrdiff_t source_stride = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0);
  for (int y = 0; y < view.roi.height; ++y) {
    std::memcpy(pixels.data() + stride * y, source + source_stride * (view.roi.y + y), stride);
  }
  view.pixels = pixels.bytes();
  return priv.writer.write(view, pixels.memory(), frame.buffer);
}

GstFlowReturn prepare_output_buffer(GstBaseTransform* base, GstBuffer* input, GstBuffer** output) {
  PolyhullContourFind* self = self_of(base);
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

gboolean src_event(GstBaseTransform* base, GstEvent* event) {
  Private& priv = *self_of(base)->priv;
  if (GST_EVENT_TYPE(event) == GST_EVENT_QOS) {
    const ContourValues values = snapshot(base, priv.values);
    if (values.adaptive) priv.control.observe(event, values.target_rate);
  }
  return GST_BASE_TRANSFORM_CLASS(polyhull_contour_find_parent_class)->src_event(base, event);
}

gboolean start(GstBaseTransform* base) {
  Private& priv = *self_of(base)->priv;
  priv.statistics.reset();
  priv.control.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  Private& priv = *self_of(base)->priv;
  priv.stage.reset();
  priv.mattes.clear();
  return TRUE;
}

void polyhull_contour_find_init(PolyhullContourFind* self) {
  self->priv = new Private;
  gst_video_info_init(&self->priv->info);
  declare_contour_statistics(self->priv->statistics);
}

void finalize(GObject* object) {
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_contour_find_parent_class)->finalize(object);
}

void polyhull_contour_find_class_init(PolyhullContourFindClass* klass) {
  GST_DEBUG_CATEGORY_INIT(contourfind_debug, "contourfind", 0, "contours of mattes");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  stats_id = install_properties(object_class, contour_properties(), first_contour);
  g_object_class_install_property(object_class, stats_id,
                                  statistics_property(contour_statistics_blurb));

  auto* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(
      element_class, "Contour finder", "Filter/Analyzer/Video",
      "Turns keyed frames into views: the silhouette's contours and the pixels it covers",
      "polyhull");
  add_template(klass, "sink", GST_PAD_SINK, GST_VIDEO_CAPS_MAKE("{ RGBA, GRAY8 }"));
  add_template(klass, "src", GST_PAD_SRC, view_caps);

  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->transform_caps = view_transform_caps;
  base_class->set_caps = set_caps;
  base_class->propose_allocation = propose_allocation;
  base_class->prepare_output_buffer = prepare_output_buffer;
  base_class->transform = transform;
  base_class->before_transform = sync_controlled_properties;
  base_class->src_event = src_event;
  base_class->start = start;
  base_class->stop = stop;
  base_class->passthrough_on_same_caps = FALSE;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(contourfind, "contourfind", GST_RANK_NONE,
                            polyhull_contour_find_get_type())
