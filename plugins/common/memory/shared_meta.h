// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A shared object that travels with a buffer as a GstMeta, and is copied with it.
#pragma once

#include <gst/gst.h>

#include <memory>
#include <new>
#include <utility>

namespace polyhull::element {

/// \p Traits has `Value` and `api_name`, `meta_name`: the names that GStreamer registers.
template <typename Traits>
class SharedMeta {
 public:
  using Shared = std::shared_ptr<const typename Traits::Value>;

  /// Attaches \p value in the place of an earlier one; nothing is attached where both are null.
  static void set(GstBuffer* buffer, Shared value) {
    GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
    if (meta == nullptr && value == nullptr) return;
    if (meta == nullptr) meta = gst_buffer_add_meta(buffer, meta_info(), nullptr);
    reinterpret_cast<Attached*>(meta)->value = std::move(value);
  }

  /// What is attached, or null.
  static Shared get(GstBuffer* buffer) {
    const GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
    return meta != nullptr ? reinterpret_cast<const Attached*>(meta)->value : nullptr;
  }

 private:
  struct Attached {
    GstMeta meta;
    Shared value;
  };

  static GType api_type() {
    static const GType type = [] {
      static const gchar* tags[] = {nullptr};
      return gst_meta_api_type_register(Traits::api_name, tags);
    }();
    return type;
  }

  static gboolean initialise(GstMeta* meta, gpointer, GstBuffer*) {
    new (&reinterpret_cast<Attached*>(meta)->value) Shared;
    return TRUE;
  }

  static void free(GstMeta* meta, GstBuffer*) {
    reinterpret_cast<Attached*>(meta)->value.~Shared();
  }

  static gboolean transform(GstBuffer* target, GstMeta* meta, GstBuffer*, GQuark type, gpointer) {
    if (!GST_META_TRANSFORM_IS_COPY(type)) return FALSE;
    set(target, reinterpret_cast<Attached*>(meta)->value);
    return TRUE;
  }

  static const GstMetaInfo* meta_info() {
    static const GstMetaInfo* const info = gst_meta_register(
        api_type(), Traits::meta_name, sizeof(Attached), initialise, free, transform);
    return info;
  }
};

}  // namespace polyhull::element
