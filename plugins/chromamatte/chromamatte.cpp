// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// chromamatte: keys a filmed subject out of a coloured screen (or out of an empty room that it has
/// been shown). It takes the formats cameras and decoders deliver, without a conversion in front,
/// and writes RGBA with the matte in alpha: 255 subject, 0 background, and in between the fraction
/// of the pixel that the subject covers.
#include <gst/video/gstvideofilter.h>
#include <gst/video/video.h>

#include <algorithm>
#include <array>
#include <string>

#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/memory/recycling_allocator.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/silhouette/key_properties.h"
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
      "camera",
      "Name of the camera in the rig file whose bounds limit the matte. Empty takes the name of "
      "this element. Used only where rig is set.")};
  return table;
}

struct ChromaMatte {
  static constexpr char type_name[] = "PolyhullChromaMatte";
  static GType base_type() { return GST_TYPE_VIDEO_FILTER; }
  static void class_init(gpointer klass);

  explicit ChromaMatte(gpointer object) {
    declare_key_statistics(statistics);
    statistics.declare({"frames-unwanted", "colours-unconverted"});
    // Frames are left out for all cameras alike, by the pace; not by each for itself.
    gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(object), FALSE);
  }

  KeyValues key;  // these three: under the object lock
  KeyViewValues view;
  CameraValues camera;

  Statistics statistics{"chromamatte-stats"};
  PaceFilter pace;
  FrameView layout;  // the rest belongs to the streaming thread
  KeyConfiguration configuration;
  Keyer keyer;
  PlanePool<Matte> mattes;
};

GstCaps* transform_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                        GstCaps* filter) {
  GstPad* other = direction == GST_PAD_SINK ? GST_BASE_TRANSFORM_SRC_PAD(base)
                                            : GST_BASE_TRANSFORM_SINK_PAD(base);
  g_autoptr(GstCaps) allowed = gst_pad_get_pad_template_caps(other);
  // Size, rate and shape stay; format and colour are each side's own, as is whether it is a mosaic.
  g_autoptr(GstCaps) free = gst_caps_new_empty();
  for (guint i = 0; i < gst_caps_get_size(caps); ++i)
    for (const char* name : {"video/x-raw", "video/x-bayer"}) {
      GstStructure* structure = gst_structure_copy(gst_caps_get_structure(caps, i));
      gst_structure_set_name(structure, name);
      gst_structure_remove_fields(structure, "format", "colorimetry", "chroma-site", nullptr);
      const GstCapsFeatures* features = gst_caps_get_features(caps, i);
      gst_caps_append_structure_full(free, structure,
                                     features ? gst_caps_features_copy(features) : nullptr);
    }
  return filtered(gst_caps_intersect_full(free, allowed, GST_CAPS_INTERSECT_FIRST), filter);
}

/// RGBA has no matrix; luma and chroma have become full range, and transfer and primaries remain
/// those of the camera.
GstCaps* fixate_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                     GstCaps* other) {
  GstVideoInfo info;
  if (direction == GST_PAD_SINK && video_info_of(caps, &info)) {
    GstVideoColorimetry colour = GST_VIDEO_INFO_COLORIMETRY(&info);
    colour.matrix = GST_VIDEO_COLOR_MATRIX_RGB;
    if (GST_VIDEO_INFO_IS_YUV(&info)) colour.range = GST_VIDEO_COLOR_RANGE_0_255;
    g_autofree gchar* text = gst_video_colorimetry_to_string(&colour);
    if (text != nullptr) {
      g_autoptr(GstCaps) coloured = gst_caps_copy(other);
      gst_caps_set_simple(coloured, "colorimetry", G_TYPE_STRING, text, nullptr);
      g_autoptr(GstCaps) both = gst_caps_intersect(other, coloured);
      if (!gst_caps_is_empty(both)) gst_caps_replace(&other, both);
    }
  }
  return GST_BASE_TRANSFORM_CLASS(parent_class<ChromaMatte>())
      ->fixate_caps(base, direction, caps, other);
}

/// In the place of the base class's, which knows no mosaics.
gboolean set_caps(GstBaseTransform* base, GstCaps* in, GstCaps* out) {
  GstVideoFilter* filter = GST_VIDEO_FILTER_CAST(base);
  filter->negotiated = FALSE;
  if (!video_info_of(in, &filter->in_info) || !gst_video_info_from_caps(&filter->out_info, out))
    return FALSE;
  filter->negotiated = guarded(GST_ELEMENT_CAST(base), FALSE, [&]() -> gboolean {
    ChromaMatte& self = state_of<ChromaMatte>(base);
    self.layout = frame_template(in, filter->in_info);
    warn_of_wide_colours(GST_ELEMENT_CAST(base), self.statistics, filter->in_info);
    GST_DEBUG_OBJECT(base, "%" GST_PTR_FORMAT " becomes %" GST_PTR_FORMAT, printed(in),
                     printed(out));
    return TRUE;
  });
  return filter->negotiated;
}

/// Frames from memory that notes whether somebody writes to it
/// (plugins/common/memory/matte_meta.h), unless the elements behind want them in memory of their
/// own.
gboolean decide_allocation(GstBaseTransform* base, GstQuery* query) {
  g_autoptr(GstAllocator) wanted = nullptr;
  GstAllocationParams params;
  gst_allocation_params_init(&params);
  const bool any = gst_query_get_n_allocation_params(query) > 0;
  if (any) gst_query_parse_nth_allocation_param(query, 0, &wanted, &params);
  GST_DEBUG_OBJECT(base, "frames are allocated by %s",
                   wanted != nullptr    ? GST_OBJECT_NAME(wanted)
                   : params.align >= 64 ? "the base class, as their alignment is asked for"
                                        : "this element, which notes who writes to them");
  if (wanted == nullptr && params.align < 64) {
    g_autoptr(GstAllocator) allocator = make_recycling_allocator();
    if (any)
      gst_query_set_nth_allocation_param(query, 0, allocator, &params);
    else
      gst_query_add_allocation_param(query, allocator, &params);
  }
  return GST_BASE_TRANSFORM_CLASS(parent_class<ChromaMatte>())->decide_allocation(base, query);
}

/// The base class knows no size of a mosaic's frames: their source makes the memory.
gboolean propose_allocation(GstBaseTransform* base, GstQuery* decide, GstQuery* query) {
  GstCaps* caps = nullptr;
  gst_query_parse_allocation(query, &caps, nullptr);
  if (caps == nullptr || is_mosaic(caps)) return TRUE;
  return GST_BASE_TRANSFORM_CLASS(parent_class<ChromaMatte>())
      ->propose_allocation(base, decide, query);
}

gboolean start(GstBaseTransform* base) {
  ChromaMatte& self = state_of<ChromaMatte>(base);
  self.keyer = Keyer();
  self.configuration = KeyConfiguration();
  self.pace.reset();
  self.statistics.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  state_of<ChromaMatte>(base).mattes.clear();
  return TRUE;
}

/// Takes over what has changed since the last frame.
void configure(GstElement* element) {
  ChromaMatte& self = state_of<ChromaMatte>(element);
  const KeyValues values = snapshot(element, self.key);
  std::string camera = snapshot(element, self.camera).camera;
  if (camera.empty()) camera = GST_OBJECT_NAME(element);
  configure_key(self.configuration, element, self.statistics, values, camera, self.layout.width,
                self.layout.height, [&](const KeySettings& settings) { self.keyer.set(settings); });
  self.configuration.sample_and_learn(values, [&]() -> Keyer& { return self.keyer; });
}

void key_frame(ChromaMatte& self, const FrameView& frame, KeyView view, Matte& matte,
               std::uint8_t* pixels, std::ptrdiff_t stride) {
  if (self.keyer.needs_plane() || view == KeyView::split) {
    self.keyer.key(frame, matte);
    self.keyer.write_rgba(frame, matte, {0, 0, frame.width, frame.height}, view, pixels, stride);
    return;
  }
  self.keyer.prepare(frame);
  matte.resize(frame.width, frame.height);
  int keyed = 0;
  for (int top = 0; top < frame.height; top += band) {
    const int bottom = std::min(top + band, frame.height);
    for (; keyed < std::min(bottom + self.keyer.rows_below(), frame.height); ++keyed)
      self.keyer.key_row(frame, keyed, matte.row(keyed), matte.state_row(keyed));
    self.keyer.write_rgba(frame, matte, {0, top, frame.width, bottom - top}, view,
                          pixels + stride * top, stride);
  }
}

GstFlowReturn transform(GstBaseTransform* base, GstBuffer* in, GstBuffer* out) {
  GstElement* element = GST_ELEMENT_CAST(base);
  ChromaMatte& self = state_of<ChromaMatte>(base);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    configure(element);
    const KeyView view = snapshot(base, self.view).view;
    const MappedFrame from(GST_VIDEO_FILTER_CAST(base)->in_info, in);
    const FrameView frame = frame_view(self.layout, from.frame());
    const std::shared_ptr<Matte> matte = self.mattes.take();
    {
      MappedFrame to(GST_VIDEO_FILTER_CAST(base)->out_info, out, GST_MAP_WRITE);
      key_frame(self, frame, view, *matte, to.data(), to.stride());
    }
    if (view == KeyView::composite)
      set_matte(out, {matte, nullptr, 0.0});
    else
      report_score(score_of(*matte, self.keyer.active()), self.statistics);
    report_calibration(self.keyer.calibration(), element, self.statistics);
    self.statistics.count("frames");
    GST_LOG_OBJECT(base, "%s, %s: %" GST_PTR_FORMAT,
                   self.keyer.needs_plane() ? "keyed as a whole" : "keyed row by row",
                   view == KeyView::composite ? "matte attached" : "another view", printed(out));
    return GST_FLOW_OK;
  });
}

void ChromaMatte::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(chromamatte_debug, "chromamatte", 0, "keying");
  add_properties<ChromaMatte>(klass, key_properties(), &ChromaMatte::key);
  add_properties<ChromaMatte>(klass, key_view_properties(), &ChromaMatte::view);
  add_properties<ChromaMatte>(klass, camera_properties(), &ChromaMatte::camera);
  add_statistics<ChromaMatte>(
      klass,
      "Counters since the element started: frames keyed, frames-unwanted (left out in a live "
      "stream because what follows cannot keep up), colours-unconverted (videos of high dynamic "
      "range or of BT.2020's primaries), warnings, frames keyed without the screen or the clean "
      "plate that the method needs, the colours found for screen and foreground (as 0xRRGGBB) with "
      "their key signal in levels, how many frames the clean plate is still learned from, and, of "
      "frames that were shown by another view than composite, how clear their matte is: score, of "
      "100, and what is doubtful of the subject and of the screen, in percent of the picture.");
  set_metadata(klass, "Chroma matte", "Filter/Effect/Video",
               "Keys a subject out of a coloured screen or a known room; writes RGBA with the "
               "matte in alpha");
  add_template(klass, "sink", GST_PAD_SINK, POLYHULL_KEYABLE_CAPS);
  add_template(klass, "src", GST_PAD_SRC, GST_VIDEO_CAPS_MAKE("RGBA"));

  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->transform_caps = transform_caps;
  base_class->fixate_caps = fixate_caps;
  base_class->set_caps = set_caps;
  base_class->propose_allocation = propose_allocation;
  base_class->decide_allocation = decide_allocation;
  base_class->start = start;
  base_class->stop = stop;
  base_class->transform = transform;
  base_class->before_transform = sync_controlled_properties;
  base_class->submit_input_buffer = submit_input_buffer<ChromaMatte>;
  base_class->src_event = src_event<ChromaMatte>;
  base_class->passthrough_on_same_caps = FALSE;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(chromamatte, "chromamatte", GST_RANK_NONE, type_of<ChromaMatte>())
