// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/depth_meta.h"

#include <new>
#include <utility>

namespace polyhull::element {
namespace {

using Depth = std::shared_ptr<const DepthPicture>;

struct DepthMeta {
  GstMeta meta;
  Depth depth;
};

GType api_type() {
  static const GType type = [] {
    static const gchar* tags[] = {nullptr};
    return gst_meta_api_type_register("PolyhullDepthMetaAPI", tags);
  }();
  return type;
}

gboolean initialise(GstMeta* meta, gpointer, GstBuffer*) {
  new (&reinterpret_cast<DepthMeta*>(meta)->depth) Depth;
  return TRUE;
}

void free_depth(GstMeta* meta, GstBuffer*) {
  reinterpret_cast<DepthMeta*>(meta)->depth.~Depth();
}

gboolean transform(GstBuffer* target, GstMeta* meta, GstBuffer*, GQuark type, gpointer) {
  if (!GST_META_TRANSFORM_IS_COPY(type)) return FALSE;
  set_depth(target, reinterpret_cast<DepthMeta*>(meta)->depth);
  return TRUE;
}

const GstMetaInfo* meta_info() {
  static const GstMetaInfo* const info = gst_meta_register(
      api_type(), "PolyhullDepthMeta", sizeof(DepthMeta), initialise, free_depth, transform);
  return info;
}

}  // namespace

void set_depth(GstBuffer* buffer, Depth depth) {
  // Who shares the buffer reads its metas.
  if (!gst_buffer_is_writable(buffer)) return;
  GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  if (meta == nullptr && depth == nullptr) return;
  if (meta == nullptr) meta = gst_buffer_add_meta(buffer, meta_info(), nullptr);
  if (meta == nullptr) return;
  reinterpret_cast<DepthMeta*>(meta)->depth = std::move(depth);
}

Depth attached_depth(GstBuffer* buffer) {
  const GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  return meta != nullptr ? reinterpret_cast<const DepthMeta*>(meta)->depth : nullptr;
}

}  // namespace polyhull::element
