// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/video/video.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/error.h"
#include "common/guard.h"
#include "composite_element.h"

namespace polyhull::element {
namespace {

using SegmentTime = guint64 (*)(const GstSegment*, GstFormat, guint64);

/// `time` of the pad's segment as `convert` counts it; none where there is no time.
GstClockTime time_of(GstAggregatorPad* pad, GstClockTime time, SegmentTime convert) {
  GST_OBJECT_LOCK(pad);
  const GstClockTime converted =
      GST_CLOCK_TIME_IS_VALID(time) && pad->segment.format == GST_FORMAT_TIME
          ? convert(&pad->segment, GST_FORMAT_TIME, time)
          : GST_CLOCK_TIME_NONE;
  GST_OBJECT_UNLOCK(pad);
  return converted;
}

GstClockTime running_time(GstAggregatorPad* pad, GstClockTime time) {
  return time_of(pad, time, gst_segment_to_running_time);
}

/// What a GstController counts in: a seek does not set it back, as it does running time.
GstClockTime stream_time(GstAggregatorPad* pad, GstClockTime time) {
  return time_of(pad, time, gst_segment_to_stream_time);
}

bool is_gap(GstBuffer* buffer) {
  return GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_GAP) && gst_buffer_get_size(buffer) == 0;
}

/// Running time at which the frame ends; none where the frame has no time.
GstClockTime end_of_frame(const CompositePrivate& priv, GstAggregatorPad* pad, GstBuffer* frame) {
  GstClockTime duration = GST_BUFFER_DURATION(frame);
  const int rate = GST_VIDEO_INFO_FPS_N(&priv.background_info);
  if (!GST_CLOCK_TIME_IS_VALID(duration) && rate > 0) {
    duration =
        gst_util_uint64_scale_int(GST_SECOND, GST_VIDEO_INFO_FPS_D(&priv.background_info), rate);
  }
  const GstClockTime begin = running_time(pad, GST_BUFFER_PTS(frame));
  if (!GST_CLOCK_TIME_IS_VALID(begin)) return GST_CLOCK_TIME_NONE;
  // A frame without length lasts an instant.
  return begin + (GST_CLOCK_TIME_IS_VALID(duration) ? std::max<GstClockTime>(duration, 1) : 1);
}

void show(PolyhullComposite* self, GstAggregatorPad* pad, GstBuffer* buffer, GstClockTime time) {
  CompositePrivate& priv = *self->priv;
  MeshPadState& state = mesh_state_of(pad);
  try {
    state.mesh = std::make_unique<MeshBuffer>(buffer);
    state.content = priv.next_content++;
    state.time = time;
    priv.statistics.count("meshes");
  } catch (const Error& error) {
    priv.statistics.warn(
        GST_ELEMENT_CAST(self), "meshes-unusable",
        std::string("A buffer on ") + GST_OBJECT_NAME(pad) + " was dropped: " + error.what());
  }
}

/// Takes from the pad what belongs to a frame that ends at \p end: the last mesh that begins
/// before. False: more may come that belongs to it.
bool catch_up(PolyhullComposite* self, GstAggregatorPad* pad, GstClockTime end) {
  if (mesh_state_of(pad).flushed.exchange(false)) mesh_state_of(pad).mesh.reset();
  for (;;) {
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(pad);
    if (!buffer) return gst_aggregator_pad_is_eos(pad);
    const GstClockTime time = running_time(pad, GST_BUFFER_PTS(buffer));
    const bool later = GST_CLOCK_TIME_IS_VALID(time) && GST_CLOCK_TIME_IS_VALID(end) && time >= end;
    if (!later) {
      gst_aggregator_pad_drop_buffer(pad);
      if (!is_gap(buffer)) show(self, pad, buffer, time);
    }
    gst_buffer_unref(buffer);
    if (later) return true;
    // Without times, one mesh goes with one frame.
    if (!GST_CLOCK_TIME_IS_VALID(time) || !GST_CLOCK_TIME_IS_VALID(end)) return true;
  }
}

bool has_ended(GstAggregatorPad* pad) {
  return !pad || gst_aggregator_pad_is_eos(pad);
}

/// The meshes that are shown with a frame that ends at \p end.
std::vector<GstAggregatorPad*> shown(const CompositePads& pads, GstClockTime end,
                                     std::uint64_t max_age) {
  std::vector<GstAggregatorPad*> out;
  for (GstAggregatorPad* pad : pads.meshes) {
    const MeshPadState& state = mesh_state_of(pad);
    if (!state.mesh || state.mesh->mesh().hull.empty()) continue;
    const bool aged = GST_CLOCK_TIME_IS_VALID(state.time) && GST_CLOCK_TIME_IS_VALID(end) &&
                      end > state.time && end - state.time > max_age;
    if (!aged) out.push_back(pad);
  }
  return out;
}

GstBuffer* acquire(GstAggregator* aggregator, const GstVideoInfo& info) {
  GstBufferPool* pool = gst_aggregator_get_buffer_pool(aggregator);
  GstBuffer* buffer = nullptr;
  if (pool) {
    if (!gst_buffer_pool_is_active(pool)) gst_buffer_pool_set_active(pool, TRUE);
    if (gst_buffer_pool_acquire_buffer(pool, &buffer, nullptr) != GST_FLOW_OK) buffer = nullptr;
    gst_object_unref(pool);
  } else {
    buffer = gst_buffer_new_allocate(nullptr, info.size, nullptr);
  }
  return buffer;
}

/// The composite of \p frame, whose reference it takes; null: the pool is flushing.
GstBuffer* compose(PolyhullComposite* self, GstBuffer* frame,
                   const std::vector<GstAggregatorPad*>& meshes) {
  CompositePrivate& priv = *self->priv;
  struct Unref {
    GstBuffer* buffer;
    ~Unref() { gst_clear_buffer(&buffer); }
  } held{frame};
  const bool same_memory = priv.background_on_gpu == priv.output_on_gpu;
  priv.composer.prepare(snapshot(self, priv.settings), priv.background_info, meshes);
  if (meshes.empty()) priv.statistics.count("no-mesh");
  if (priv.composer.untouched() && same_memory) {
    priv.statistics.count("passed-through");
    return std::exchange(held.buffer, nullptr);
  }
  const FrameBuffers buffers{frame, &priv.background_info, priv.background_on_gpu,
                             priv.output_on_gpu};
  GstBuffer* output = nullptr;
  if (same_memory && !priv.output_on_gpu && gst_buffer_is_writable(frame) &&
      gst_buffer_is_all_memory_writable(frame)) {
    output = frame;  // its untouched part need not even be copied
  } else {
    output = acquire(GST_AGGREGATOR(self), priv.output_info);
    if (!output) return nullptr;
    gst_buffer_copy_into(
        output, frame,
        static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0, -1);
  }
  try {
    priv.composer.draw(buffers, output);
  } catch (...) {
    if (output != frame) gst_buffer_unref(output);
    throw;
  }
  if (output == frame) held.buffer = nullptr;
  return output;
}

void follow_segment(PolyhullComposite* self, GstAggregatorPad* background) {
  if (!self->priv->new_segment.exchange(false)) return;
  GST_OBJECT_LOCK(background);
  const GstSegment segment = background->segment;
  GST_OBJECT_UNLOCK(background);
  if (segment.format == GST_FORMAT_TIME)
    gst_aggregator_update_segment(GST_AGGREGATOR(self), &segment);
}

}  // namespace

CompositePads::CompositePads(gpointer element) {
  GST_OBJECT_LOCK(element);
  for (GList* l = GST_ELEMENT_CAST(element)->sinkpads; l != nullptr; l = l->next) {
    auto* pad = GST_AGGREGATOR_PAD(gst_object_ref(l->data));
    if (is_mesh_pad(pad)) {
      meshes.push_back(pad);
    } else {
      background = pad;
    }
  }
  GST_OBJECT_UNLOCK(element);
}

CompositePads::~CompositePads() {
  for (GstAggregatorPad* pad : meshes) gst_object_unref(pad);
  if (background) gst_object_unref(background);
}

void check_background(const CompositePads& pads) {
  if (pads.background) return;
  throw Error(Error::Kind::bad_input,
              "composite has no background. Link a video source, such as scenesrc, to its pad "
              "background.");
}

GstFlowReturn composite_aggregate(GstAggregator* aggregator, gboolean timeout) {
  PolyhullComposite* self = self_of(aggregator);
  CompositePrivate& priv = *self->priv;
  const auto step = [&]() -> GstFlowReturn {
    const CompositePads pads(self);
    check_background(pads);
    GstBuffer* frame = gst_aggregator_pad_peek_buffer(pads.background);
    if (!frame) return has_ended(pads.background) ? GST_FLOW_EOS : GST_AGGREGATOR_FLOW_NEED_DATA;
    const GstClockTime end = end_of_frame(priv, pads.background, frame);
    bool complete = true;
    for (GstAggregatorPad* pad : pads.meshes) complete = catch_up(self, pad, end) && complete;
    if (!complete && !timeout) {
      gst_buffer_unref(frame);
      return GST_AGGREGATOR_FLOW_NEED_DATA;
    }
    gst_buffer_unref(frame);
    frame = gst_aggregator_pad_pop_buffer(pads.background);
    if (!frame) return GST_AGGREGATOR_FLOW_NEED_DATA;  // flushed meanwhile
    if (is_gap(frame)) {
      gst_buffer_unref(frame);
      return GST_FLOW_OK;
    }
    const GstClockTime now = stream_time(pads.background, GST_BUFFER_PTS(frame));
    if (GST_CLOCK_TIME_IS_VALID(now)) {
      gst_object_sync_values(GST_OBJECT(self), now);
      for (GstAggregatorPad* pad : pads.meshes) gst_object_sync_values(GST_OBJECT(pad), now);
    }
    const auto start = std::chrono::steady_clock::now();
    const CompositeSettings settings = snapshot(self, priv.settings);
    GstBuffer* out = compose(self, frame, shown(pads, end, settings.max_mesh_age));
    if (!out) return GST_FLOW_FLUSHING;
    priv.statistics.count("frames");
    priv.statistics.set("frame-ms", std::chrono::duration<double, std::milli>(
                                        std::chrono::steady_clock::now() - start)
                                        .count());
    follow_segment(self, pads.background);
    return gst_aggregator_finish_buffer(aggregator, out);
  };
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR, step);
}

/// A frame is due when the background's is. While none waits there is no deadline: with that of the
/// last frame the base class would ask again and again without a pause.
GstClockTime composite_next_time(GstAggregator* aggregator) {
  const CompositePads pads(aggregator);
  if (has_ended(pads.background)) return gst_aggregator_simple_get_next_time(aggregator);
  GstBuffer* frame = gst_aggregator_pad_peek_buffer(pads.background);
  if (!frame) return GST_CLOCK_TIME_NONE;
  const GstClockTime begin = running_time(pads.background, GST_BUFFER_PTS(frame));
  gst_buffer_unref(frame);
  return GST_CLOCK_TIME_IS_VALID(begin) ? begin : gst_aggregator_simple_get_next_time(aggregator);
}

GstFlowReturn composite_flush(GstAggregator* aggregator) {
  private_of(aggregator).new_segment = true;
  return GST_FLOW_OK;
}

gboolean composite_start(GstAggregator* aggregator) {
  CompositePrivate& priv = private_of(aggregator);
  priv.statistics.reset();
  priv.new_segment = true;
  priv.announced = false;
  priv.forget_formats();
  return TRUE;
}

gboolean composite_stop(GstAggregator* aggregator) {
  CompositePrivate& priv = private_of(aggregator);
  for (GstAggregatorPad* pad : CompositePads(aggregator).meshes) {
    mesh_state_of(pad).mesh.reset();
    mesh_state_of(pad).time = GST_CLOCK_TIME_NONE;
  }
  return guarded(GST_ELEMENT_CAST(aggregator), gboolean{FALSE}, [&]() -> gboolean {
    priv.gl.release();
    priv.composer.reset();
    return TRUE;
  });
}

}  // namespace polyhull::element
