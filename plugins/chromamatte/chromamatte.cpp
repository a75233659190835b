// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// chromamatte: keys a filmed subject out of a coloured screen (or out of an empty room that it has
/// been shown). It takes the formats cameras and decoders deliver, without a conversion in front,
/// and writes RGBA with the matte in alpha: 255 subject, 0 background, and in between the fraction
/// of the pixel that the subject covers.
///
/// Properties that matter: `key` and `method` say what the background is like; `roi-*` limit where
/// the subject can be; `view=status` shows an operator what the key does.
///
/// gst-launch-1.0 videotestsrc num-buffers=60 pattern=ball background-color=0xff10c030 !
///     video/x-raw,format=NV12 ! chromamatte key=green ! fakesink
#include "plugins/chromamatte/chromamatte.h"

#include <gst/video/gstvideofilter.h>
#include <gst/video/video.h>

#include <algorithm>
#include <array>
#include <string>

#include "plugins/common/guard.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/memory/recycling_allocator.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/silhouette/key_configuration.h"
#include "plugins/common/silhouette/key_properties.h"
#include "plugins/common/statistics.h"
#include "plugins/common/transform.h"

GST_DEBUG_CATEGORY_STATIC(chromamatte_debug);
#define GST_CAT_DEFAULT chromamatte_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

// Rows keyed before their pixels are written: they are then still in the second-level cache.
constexpr int band = 16;

struct CameraValues {
  std::string camera;
};

std::span<const Property<CameraValues>> camera_properties() {
  static constexpr std::array table{property<&CameraValues::camera>(
      "camera", "Camera",
      "Name of the camera in the rig file whose bounds limit the matte. Empty takes the name of "
      "this element. Used only where rig is set.")};
  return table;
}

struct Private {
  KeyValues key;  // these three: under the object lock
  KeyViewValues view;
  CameraValues camera;

  Statistics statistics{"chromamatte-stats"};
  PaceFilter pace;
  FrameView layout;  // the rest belongs to the streaming thread
  KeyConfiguration configuration;
  Keyer keyer;
  int learning = 0;
  PlanePool<Matte> mattes;
};

struct PolyhullChromaMatte {
  GstVideoFilter parent;
  Private* priv;
};

struct PolyhullChromaMatteClass {
  GstVideoFilterClass parent_class;
};

enum { first_key = 1 };
guint first_view, first_camera, stats_id;

GType polyhull_chroma_matte_get_type();
G_DEFINE_TYPE(PolyhullChromaMatte, polyhull_chroma_matte, GST_TYPE_VIDEO_FILTER)

PolyhullChromaMatte* self_of(gpointer object) {
  return static_cast<PolyhullChromaMatte*>(object);
}

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (set_property(object, key_properties(), first_key, priv.key, id, value)) return;
  if (set_property(object, key_view_properties(), first_view, priv.view, id, value)) return;
  if (set_property(object, camera_properties(), first_camera, priv.camera, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (id == stats_id) {
    g_value_take_boxed(value, priv.statistics.structure());
    return;
  }
  if (get_property(object, key_properties(), first_key, priv.key, id, value)) return;
  if (get_property(object, key_view_properties(), first_view, priv.view, id, value)) return;
  if (get_property(object, camera_properties(), first_camera, priv.camera, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

GstCaps* transform_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                        GstCaps* filter) {
  GstPad* other = direction == GST_PAD_SINK ? GST_BASE_TRANSFORM_SRC_PAD(base)
                                            : GST_BASE_TRANSFORM_SINK_PAD(base);
  GstCaps* allowed = gst_pad_get_pad_template_caps(other);
  // Size, rate and shape stay; format and colour are each side's own.
  GstCaps* free = gst_caps_copy(caps);
  for (guint i = 0; i < gst_caps_get_size(free); ++i) {
    gst_structure_remove_fields(gst_caps_get_structure(free, i), "format", "colorimetry",
                                "chroma-site", nullptr);
  }
  GstCaps* result = gst_caps_intersect_full(free, allowed, GST_CAPS_INTERSECT_FIRST);
  gst_caps_unref(free);
  gst_caps_unref(allowed);
  if (filter != nullptr) {
    GstCaps* filtered = gst_caps_intersect_full(filter, result, GST_CAPS_INTERSECT_FIRST);
    gst_caps_unref(result);
    result = filtered;
  }
  return result;
}

/// RGBA has no matrix; luma and chroma have become full range, and transfer and primaries remain
/// those of the camera.
GstCaps* fixate_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                     GstCaps* other) {
  GstVideoInfo info;
  if (direction == GST_PAD_SINK && gst_video_info_from_caps(&info, caps)) {
    GstVideoColorimetry colour = GST_VIDEO_INFO_COLORIMETRY(&info);
    colour.matrix = GST_VIDEO_COLOR_MATRIX_RGB;
    if (GST_VIDEO_INFO_IS_YUV(&info)) colour.range = GST_VIDEO_COLOR_RANGE_0_255;
    gchar* text = gst_video_colorimetry_to_string(&colour);
    if (text != nullptr) {
      GstCaps* coloured = gst_caps_copy(other);
      gst_caps_set_simple(coloured, "colorimetry", G_TYPE_STRING, text, nullptr);
      GstCaps* both = gst_caps_intersect(other, coloured);
      gst_caps_unref(coloured);
      g_free(text);
      if (gst_caps_is_empty(both)) {
        gst_caps_unref(both);
      } else {
        gst_caps_unref(other);
        other = both;
      }
    }
  }
  return GST_BASE_TRANSFORM_CLASS(polyhull_chroma_matte_parent_class)
      ->fixate_caps(base, direction, caps, other);
}

gboolean set_info(GstVideoFilter* filter, GstCaps*, GstVideoInfo* in, GstCaps*, GstVideoInfo*) {
  Private& priv = *self_of(filter)->priv;
  return guarded(GST_ELEMENT_CAST(filter), FALSE, [&]() -> gboolean {
    priv.layout = frame_template(*in);
    return TRUE;
  });
}

/// Frames from memory that notes who writes to it (see common/matte_meta.h), unless the elements
/// behind want them in memory of their own.
gboolean decide_allocation(GstBaseTransform* base, GstQuery* query) {
  GstAllocator* wanted = nullptr;
  GstAllocationParams params;
  gst_allocation_params_init(&params);
  const bool any = gst_query_get_n_allocation_params(query) > 0;
  if (any) gst_query_parse_nth_allocation_param(query, 0, &wanted, &params);
  if (wanted != nullptr) {
    gst_object_unref(wanted);
  } else if (params.align < 64) {
    GstAllocator* allocator = make_recycling_allocator();
    if (any)
      gst_query_set_nth_allocation_param(query, 0, allocator, &params);
    else
      gst_query_add_allocation_param(query, allocator, &params);
    gst_object_unref(allocator);
  }
  return GST_BASE_TRANSFORM_CLASS(polyhull_chroma_matte_parent_class)
      ->decide_allocation(base, query);
}

gboolean start(GstBaseTransform* base) {
  Private& priv = *self_of(base)->priv;
  priv.keyer = Keyer();
  priv.configuration = KeyConfiguration();
  priv.learning = 0;
  priv.pace.reset();
  priv.statistics.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  self_of(base)->priv->mattes.clear();
  return TRUE;
}

/// Takes over what has changed since the last frame.
void configure(PolyhullChromaMatte* self) {
  Private& priv = *self->priv;
  const KeyValues values = snapshot(self, priv.key);
  std::string camera = snapshot(self, priv.camera).camera;
  if (camera.empty()) camera = GST_OBJECT_NAME(self);
  priv.configuration.apply(GST_ELEMENT_CAST(self), priv.statistics, values, camera,
                           priv.layout.width, priv.layout.height,
                           [&](const KeySettings& settings) { priv.keyer.set(settings); });
  if (priv.configuration.due_for_sampling(values.resample)) priv.keyer.recalibrate();
  if (values.learn_plate != priv.learning) {
    priv.learning = values.learn_plate;
    if (priv.learning > 0) priv.keyer.learn_plate(priv.learning);
  }
}

void key_frame(Private& priv, const FrameView& frame, KeyView view, Matte& matte,
               std::uint8_t* pixels, std::ptrdiff_t stride) {
  if (priv.keyer.needs_plane()) {
    priv.keyer.key(frame, matte);
    priv.keyer.write_rgba(frame, matte, {0, 0, frame.width, frame.height}, view, pixels, stride);
    return;
  }
  priv.keyer.prepare(frame);
  matte.resize(frame.width, frame.height);
  for (int top = 0; top < frame.height; top += band) {
    const int bottom = std::min(top + band, frame.height);
    for (int y = top; y < bottom; ++y) {
      priv.keyer.key_row(frame, y, matte.row(y), matte.state_row(y));
    }
    priv.keyer.write_rgba(frame, matte, {0, top, frame.width, bottom - top}, view,
                          pixels + stride * top, stride);
  }
}

GstFlowReturn transform_frame(GstVideoFilter* filter, GstVideoFrame* in, GstVideoFrame* out) {
  PolyhullChromaMatte* self = self_of(filter);
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    configure(self);
    const KeyView view = snapshot(self, priv.view).view;
    const FrameView frame = frame_view(priv.layout, *in);
    const std::shared_ptr<Matte> matte = priv.mattes.take();
    key_frame(priv, frame, view, *matte,
              static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(out, 0)),
              GST_VIDEO_FRAME_PLANE_STRIDE(out, 0));
    if (view == KeyView::composite) set_matte(out->buffer, {matte, nullptr, 0.0});
    report_calibration(priv.keyer.calibration(), GST_ELEMENT_CAST(self), priv.statistics);
    priv.statistics.count("frames");
    return GST_FLOW_OK;
  });
}

GstFlowReturn submit_input_buffer(GstBaseTransform* base, gboolean discontinuous,
                                  GstBuffer* input) {
  Private& priv = *self_of(base)->priv;
  return submit_wanted(base, priv.pace, priv.statistics,
                       GST_BASE_TRANSFORM_CLASS(polyhull_chroma_matte_parent_class), discontinuous,
                       input);
}

gboolean src_event(GstBaseTransform* base, GstEvent* event) {
  self_of(base)->priv->pace.hear(event);
  return GST_BASE_TRANSFORM_CLASS(polyhull_chroma_matte_parent_class)->src_event(base, event);
}

void polyhull_chroma_matte_init(PolyhullChromaMatte* self) {
  self->priv = new Private;
  declare_key_statistics(self->priv->statistics);
  self->priv->statistics.declare({"frames-unwanted"});
  // Frames are left out for all cameras alike, by the pace; not by each for itself.
  gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(self), FALSE);
}

void finalize(GObject* object) {
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_chroma_matte_parent_class)->finalize(object);
}

void polyhull_chroma_matte_class_init(PolyhullChromaMatteClass* klass) {
  GST_DEBUG_CATEGORY_INIT(chromamatte_debug, "chromamatte", 0, "keying");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  guint next = install_properties(object_class, key_properties(), first_key);
  first_view = next;
  next = install_properties(object_class, key_view_properties(), next);
  first_camera = next;
  next = install_properties(object_class, camera_properties(), next);
  stats_id = next;
  g_object_class_install_property(
      object_class, stats_id,
      statistics_property(
          "Counters since the element started: frames keyed, frames-unwanted (left out in a live "
          "stream because what follows cannot keep up), warnings, frames keyed without the "
          "screen or the clean plate that the method needs, the colours found for screen "
          "and foreground (as 0xRRGGBB) with their key signal in levels, and how many frames the "
          "clean plate is still learned from."));

  auto* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(element_class, "Chroma matte", "Filter/Effect/Video",
                                        "Keys a subject out of a coloured screen or a known room; "
                                        "writes RGBA with the matte in alpha",
                                        "polyhull");
  add_template(klass, "sink", GST_PAD_SINK, GST_VIDEO_CAPS_MAKE(POLYHULL_KEYABLE_FORMATS));
  add_template(klass, "src", GST_PAD_SRC, GST_VIDEO_CAPS_MAKE("RGBA"));

  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->transform_caps = transform_caps;
  base_class->fixate_caps = fixate_caps;
  base_class->decide_allocation = decide_allocation;
  base_class->start = start;
  base_class->stop = stop;
  base_class->before_transform = sync_controlled_properties;
  base_class->submit_input_buffer = submit_input_buffer;
  base_class->src_event = src_event;
  base_class->passthrough_on_same_caps = FALSE;
  auto* filter_class = GST_VIDEO_FILTER_CLASS(klass);
  filter_class->set_info = set_info;
  filter_class->transform_frame = transform_frame;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(chromamatte, "chromamatte", GST_RANK_NONE,
                            polyhull_chroma_matte_get_type())
