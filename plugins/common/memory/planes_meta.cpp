// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/planes_meta.h"

#include <new>
#include <utility>

namespace polyhull::element {
namespace {

using Planes = std::shared_ptr<const ScenePlanes>;

struct PlanesMeta {
  GstMeta meta;
  Planes planes;
};

GType api_type() {
  static const GType type = [] {
    static const gchar* tags[] = {nullptr};
    return gst_meta_api_type_register("PolyhullPlanesMetaAPI", tags);
  }();
  return type;
}

gboolean initialise(GstMeta* meta, gpointer, GstBuffer*) {
  new (&reinterpret_cast<PlanesMeta*>(meta)->planes) Planes;
  return TRUE;
}

void free_planes(GstMeta* meta, GstBuffer*) {
  reinterpret_cast<PlanesMeta*>(meta)->planes.~Planes();
}

gboolean transform(GstBuffer* target, GstMeta* meta, GstBuffer*, GQuark type, gpointer) {
  if (!GST_META_TRANSFORM_IS_COPY(type)) return FALSE;
  set_planes(target, reinterpret_cast<PlanesMeta*>(meta)->planes);
  return TRUE;
}

const GstMetaInfo* meta_info() {
  static const GstMetaInfo* const info = gst_meta_register(
      api_type(), "PolyhullPlanesMeta", sizeof(PlanesMeta), initialise, free_planes, transform);
  return info;
}

}  // namespace

void set_planes(GstBuffer* buffer, Planes planes) {
  GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  if (meta == nullptr && planes == nullptr) return;
  if (meta == nullptr) meta = gst_buffer_add_meta(buffer, meta_info(), nullptr);
  reinterpret_cast<PlanesMeta*>(meta)->planes = std::move(planes);
}

Planes attached_planes(GstBuffer* buffer) {
  const GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  return meta != nullptr ? reinterpret_cast<const PlanesMeta*>(meta)->planes : nullptr;
}

}  // namespace polyhull::element
