// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/matte_meta.h"

#include <new>
#include <utility>

#include "plugins/common/memory/recycling_allocator.h"

namespace polyhull::element {
namespace {

struct MatteMeta {
  GstMeta meta;
  MatteContent content;  // in the meta's own memory: one allocation less per frame
  std::uint64_t stamp;   // write_stamp() of the buffer when it was attached
};

GType matte_api_type() {
  static const GType type = [] {
    static const gchar* tags[] = {GST_META_TAG_VIDEO_STR,
                                  GST_META_TAG_VIDEO_SIZE_STR,
                                  GST_META_TAG_VIDEO_ORIENTATION_STR,
                                  GST_META_TAG_VIDEO_COLORSPACE_STR,
                                  GST_META_TAG_MEMORY_STR,
                                  nullptr};
    return gst_meta_api_type_register("PolyhullMatteMetaAPI", tags);
  }();
  return type;
}

gboolean initialise_matte(GstMeta* meta, gpointer, GstBuffer*) {
  new (&reinterpret_cast<MatteMeta*>(meta)->content) MatteContent;
  return TRUE;
}

void free_matte(GstMeta* meta, GstBuffer*) {
  reinterpret_cast<MatteMeta*>(meta)->content.~MatteContent();
}

gboolean transform_matte(GstBuffer* target, GstMeta* meta, GstBuffer*, GQuark type, gpointer data) {
  if (!GST_META_TRANSFORM_IS_COPY(type)) return FALSE;
  const auto* copy = static_cast<GstMetaTransformCopy*>(data);
  if (copy->region) return FALSE;
  // With the stamp of the memory it was made for: only a buffer of that memory has it.
  const auto* matte = reinterpret_cast<MatteMeta*>(meta);
  set_matte(target, matte->content);
  reinterpret_cast<MatteMeta*>(gst_buffer_get_meta(target, matte_api_type()))->stamp = matte->stamp;
  return TRUE;
}

const GstMetaInfo* matte_meta_info() {
  static const GstMetaInfo* const info =
      gst_meta_register(matte_api_type(), "PolyhullMatteMeta", sizeof(MatteMeta), initialise_matte,
                        free_matte, transform_matte);
  return info;
}

}  // namespace

void set_matte(GstBuffer* buffer, MatteContent content) {
  GstMeta* meta = gst_buffer_get_meta(buffer, matte_api_type());
  if (meta == nullptr) meta = gst_buffer_add_meta(buffer, matte_meta_info(), nullptr);
  reinterpret_cast<MatteMeta*>(meta)->content = std::move(content);
  reinterpret_cast<MatteMeta*>(meta)->stamp = write_stamp(buffer);
}

bool is_unwritten(GstBuffer* buffer) {
  const GstMeta* meta = gst_buffer_get_meta(buffer, matte_api_type());
  if (meta == nullptr) return false;
  const std::uint64_t stamp = reinterpret_cast<const MatteMeta*>(meta)->stamp;
  return stamp != 0 && stamp == write_stamp(buffer);
}

AlphaView alpha_of(const GstVideoFrame& frame) {
  const bool rgba = GST_VIDEO_FRAME_FORMAT(&frame) == GST_VIDEO_FORMAT_RGBA;
  return {static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) + (rgba ? 3 : 0),
          GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0), rgba ? 4 : 1, GST_VIDEO_FRAME_WIDTH(&frame),
          GST_VIDEO_FRAME_HEIGHT(&frame)};
}

std::shared_ptr<const Matte> read_matte(const AlphaView& alpha, PlanePool<Matte>& pool) {
  const std::shared_ptr<Matte> matte = pool.take();
  load_matte(alpha.first, alpha.stride, alpha.step, alpha.width, alpha.height, *matte);
  return matte;
}

const MatteContent* attached_matte(GstBuffer* buffer, const AlphaView& alpha, bool unwritten) {
  GstMeta* meta = gst_buffer_get_meta(buffer, matte_api_type());
  if (meta == nullptr) return nullptr;
  const MatteContent& content = reinterpret_cast<MatteMeta*>(meta)->content;
  const auto fits = [&](const auto& plane) {
    return plane != nullptr && plane->width == alpha.width && plane->height == alpha.height;
  };
  if (!fits(content.matte) && !fits(content.field)) return nullptr;
  return unwritten || is_alpha_of(content, alpha.first, alpha.stride, alpha.step) ? &content
                                                                                  : nullptr;
}

}  // namespace polyhull::element
