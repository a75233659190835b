// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// gaussblur: blurs the matte of a frame (the alpha of RGBA, or GRAY8 as it is) with a Gaussian and
/// leaves the colours alone. It takes the noise out of a keyed matte before contours are traced. It
/// works in place, and only where the matte is neither plainly foreground nor plainly background.
///
/// Properties that matter: `sigma` in pixels, and `threshold`, which makes the matte binary again.
/// With sigma=0 and threshold=0 buffers pass through untouched.
///
/// gst-launch-1.0 videotestsrc num-buffers=60 pattern=ball background-color=0xff10c030 !
///     chromamatte key=green ! gaussblur sigma=2 ! fakesink
#include "plugins/gaussblur/gaussblur.h"

#include <gst/video/gstvideofilter.h>
#include <gst/video/video.h>

#include "plugins/common/guard.h"
#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/silhouette/blur_properties.h"
#include "plugins/common/statistics.h"
#include "plugins/common/transform.h"
#include "silhouette/blur/blur.h"
#include "silhouette/pixels/matte.h"

GST_DEBUG_CATEGORY_STATIC(gaussblur_debug);
#define GST_CAT_DEFAULT gaussblur_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Private {
  BlurSettings values;  // under the object lock

  Statistics statistics{"gaussblur-stats"};
  Blur blur;               // the rest belongs to the streaming thread
  bool unwritten = false;  // the frame has its matte as it was attached
  Matte read;
  PlanePool<Field> fields;
};

struct PolyhullGaussBlur {
  GstVideoFilter parent;
  Private* priv;
};

struct PolyhullGaussBlurClass {
  GstVideoFilterClass parent_class;
};

enum { first_blur = 1 };
guint stats_id;

GType polyhull_gauss_blur_get_type();
G_DEFINE_TYPE(PolyhullGaussBlur, polyhull_gauss_blur, GST_TYPE_VIDEO_FILTER)

PolyhullGaussBlur* self_of(gpointer object) {
  return static_cast<PolyhullGaussBlur*>(object);
}

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  if (set_property(object, blur_properties(), first_blur, self_of(object)->priv->values, id, value))
    return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (id == stats_id) {
    g_value_take_boxed(value, priv.statistics.structure());
    return;
  }
  if (get_property(object, blur_properties(), first_blur, priv.values, id, value)) return;
  G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

/// Writes what the blur changed: blocks that were and stay uniform are not touched.
void write_back(const Field& field, const Matte& before, int threshold, std::uint8_t* first,
                std::ptrdiff_t stride, int step) {
  const int blocks = blocks_across(field.width);
  for (int y = 0; y < field.height; ++y) {
    const BlockState* now = field.state_row(y);
    const BlockState* then = before.state_row(y);
    int block = 0;
    while (block < blocks) {
      if (now[block] == then[block] && now[block] != block_mixed) {
        ++block;
        continue;
      }
      const int begin = block;
      while (block < blocks && !(now[block] == then[block] && now[block] != block_mixed)) ++block;
      const int from = begin * matte_block;
      const int to = std::min(block * matte_block, field.width);
      store_field_row(field.row(y) + from, to - from, threshold, first + stride * y + from * step,
                      step);
    }
  }
}

void blur_frame(Private& priv, const BlurSettings& values, GstVideoFrame* frame) {
  const int width = GST_VIDEO_FRAME_WIDTH(frame);
  const int height = GST_VIDEO_FRAME_HEIGHT(frame);
  const bool rgba = GST_VIDEO_FRAME_FORMAT(frame) == GST_VIDEO_FORMAT_RGBA;
  const int step = rgba ? 4 : 1;
  auto* first = static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(frame, 0)) + (rgba ? 3 : 0);
  const std::ptrdiff_t stride = GST_VIDEO_FRAME_PLANE_STRIDE(frame, 0);

  priv.blur.set(values);
  const MatteContent* content = get_matte(frame->buffer, width, height);
  std::shared_ptr<const Matte> attached;
  if (content != nullptr && content->matte != nullptr &&
      (priv.unwritten || is_alpha_of(*content, first, stride, step))) {
    attached = content->matte;
  } else {
    load_matte(first, stride, step, width, height, priv.read);
  }
  const Matte& matte = attached != nullptr ? *attached : priv.read;
  const std::shared_ptr<Field> field = priv.fields.take();
  priv.blur.apply(matte, *field);
  write_back(*field, matte, values.threshold, first, stride, step);
  // A thresholded matte has no shift left that its sigma would tell of.
  set_matte(frame->buffer, {nullptr, field, values.threshold > 0 ? 0.0 : values.sigma});
}

GstFlowReturn transform_frame_ip(GstVideoFilter* filter, GstVideoFrame* frame) {
  PolyhullGaussBlur* self = self_of(filter);
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    blur_frame(priv, snapshot(self, priv.values), frame);
    priv.statistics.count("frames");
    return GST_FLOW_OK;
  });
}

void before_transform(GstBaseTransform* base, GstBuffer* buffer) {
  PolyhullGaussBlur* self = self_of(base);
  sync_controlled_properties(base, buffer);
  // Before the base class maps the frame for writing.
  self->priv->unwritten = is_unwritten(buffer);
  const BlurSettings values = snapshot(self, self->priv->values);
  const bool idle = values.sigma == 0.0 && values.threshold == 0;
  gst_base_transform_set_passthrough(base, idle);
  if (idle) self->priv->statistics.count("passed-through");
}

gboolean start(GstBaseTransform* base) {
  self_of(base)->priv->statistics.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  Private& priv = *self_of(base)->priv;
  priv.fields.clear();
  return TRUE;
}

void polyhull_gauss_blur_init(PolyhullGaussBlur* self) {
  self->priv = new Private;
  self->priv->statistics.declare({"frames", "passed-through"});
  // A frame left out here would be missing from its set.
  gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(self), FALSE);
}

void finalize(GObject* object) {
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_gauss_blur_parent_class)->finalize(object);
}

void polyhull_gauss_blur_class_init(PolyhullGaussBlurClass* klass) {
  GST_DEBUG_CATEGORY_INIT(gaussblur_debug, "gaussblur", 0, "blur of mattes");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  stats_id = install_properties(object_class, blur_properties(), first_blur);
  g_object_class_install_property(
      object_class, stats_id,
      statistics_property("Counters since the element started: frames blurred, and frames passed "
                          "through untouched because sigma and threshold are 0."));

  auto* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(
      element_class, "Gaussian blur of mattes", "Filter/Effect/Video",
      "Blurs the alpha of RGBA frames, or GRAY8 frames, and leaves the colours alone", "polyhull");
  add_template(element_class, "sink", GST_PAD_SINK, GST_VIDEO_CAPS_MAKE("{ RGBA, GRAY8 }"));
  add_template(element_class, "src", GST_PAD_SRC, GST_VIDEO_CAPS_MAKE("{ RGBA, GRAY8 }"));

  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->before_transform = before_transform;
  base_class->start = start;
  base_class->stop = stop;
  base_class->transform_ip_on_passthrough = FALSE;
  GST_VIDEO_FILTER_CLASS(klass)->transform_frame_ip = transform_frame_ip;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(gaussblur, "gaussblur", GST_RANK_NONE, polyhull_gauss_blur_get_type())
