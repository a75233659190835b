// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/matte_meta.h"

#include <gst/video/video.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "plugins/common/memory/recycling_allocator.h"

namespace polyhull::element {
namespace {

struct MatteMeta {
  GstMeta meta;
  MatteContent content;  // in the meta's own memory: one allocation less per frame
};

GType api_type() {
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

gboolean initialise(GstMeta* meta, gpointer, GstBuffer*) {
  new (&reinterpret_cast<MatteMeta*>(meta)->content) MatteContent;
  return TRUE;
}

void free_content(GstMeta* meta, GstBuffer*) {
  reinterpret_cast<MatteMeta*>(meta)->content.~MatteContent();
}

const GstMetaInfo* meta_info();

gboolean transform(GstBuffer* target, GstMeta* meta, GstBuffer*, GQuark type, gpointer data) {
  if (!GST_META_TRANSFORM_IS_COPY(type)) return FALSE;
  const auto* copy = static_cast<GstMetaTransformCopy*>(data);
  if (copy->region) return FALSE;
  // With the stamp of the memory it was made for: only a buffer of that memory has it.
  const MatteContent& content = reinterpret_cast<MatteMeta*>(meta)->content;
  set_matte(target, content);
  reinterpret_cast<MatteMeta*>(gst_buffer_get_meta(target, api_type()))->content.stamp =
      content.stamp;
  return TRUE;
}

const GstMetaInfo* meta_info() {
  static const GstMetaInfo* const info = gst_meta_register(
      api_type(), "PolyhullMatteMeta", sizeof(MatteMeta), initialise, free_content, transform);
  return info;
}

bool is_uniform(const std::uint8_t* alpha, int step, int count, std::uint8_t value) {
  unsigned different = 0;
  for (int i = 0; i < count; ++i) different |= value ^ alpha[i * step];
  return different == 0;
}

bool block_matches(const std::uint8_t* values, const std::uint8_t* alpha, int step, int count) {
  unsigned different = 0;
  for (int i = 0; i < count; ++i) different |= values[i] ^ alpha[i * step];
  return different == 0;
}

bool block_matches(const std::int16_t* values, const std::uint8_t* alpha, int step, int count) {
  std::uint8_t rounded[matte_block];
  store_field_row(values, count, 0, rounded, 1);
  return block_matches(rounded, alpha, step, count);
}

template <class Plane>
bool plane_matches(const Plane& plane, const std::uint8_t* first, std::ptrdiff_t stride, int step) {
  const int blocks = blocks_across(plane.width);
  for (int y = 0; y < plane.height; ++y) {
    const auto* values = plane.row(y);
    const BlockState* states = plane.state_row(y);
    const std::uint8_t* alpha = first + stride * y;
    for (int block = 0; block < blocks; ++block) {
      const int x = block * matte_block;
      const int count = std::min(matte_block, plane.width - x);
      const std::uint8_t* at = alpha + static_cast<std::ptrdiff_t>(x) * step;
      const bool same = states[block] == block_mixed
                            ? block_matches(values + x, at, step, count)
                            : is_uniform(at, step, count, states[block] == block_full ? 255 : 0);
      if (!same) return false;
    }
  }
  return true;
}

template <class Plane>
bool same_plane(const Plane& a, const Plane& b) {
  if (&a == &b) return true;
  if (a.width != b.width || a.height != b.height) return false;
  const int blocks = blocks_across(a.width);
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.state_row(y), b.state_row(y), blocks) != 0) return false;
    for (int block = 0; block < blocks; ++block) {
      if (a.state_row(y)[block] != block_mixed) continue;
      const int x = block * matte_block;
      const int count = std::min(matte_block, a.width - x);
      if (std::memcmp(a.row(y) + x, b.row(y) + x, count * sizeof(*a.row(y))) != 0) return false;
    }
  }
  return true;
}

}  // namespace

bool is_alpha_of(const MatteContent& content, const std::uint8_t* first, std::ptrdiff_t stride,
                 int step) {
  return content.matte != nullptr ? plane_matches(*content.matte, first, stride, step)
                                  : plane_matches(*content.field, first, stride, step);
}

bool same_content(const MatteContent& a, const MatteContent& b) {
  if (a.sigma != b.sigma) return false;
  if (a.matte != nullptr && b.matte != nullptr) return same_plane(*a.matte, *b.matte);
  if (a.field != nullptr && b.field != nullptr) return same_plane(*a.field, *b.field);
  return false;
}

void set_matte(GstBuffer* buffer, MatteContent content) {
  GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  if (meta == nullptr) meta = gst_buffer_add_meta(buffer, meta_info(), nullptr);
  content.stamp = write_stamp(buffer);
  reinterpret_cast<MatteMeta*>(meta)->content = std::move(content);
}

bool is_unwritten(GstBuffer* buffer) {
  const GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  if (meta == nullptr) return false;
  const std::uint64_t stamp = reinterpret_cast<const MatteMeta*>(meta)->content.stamp;
  return stamp != 0 && stamp == write_stamp(buffer);
}

const MatteContent* get_matte(GstBuffer* buffer, int width, int height) {
  GstMeta* meta = gst_buffer_get_meta(buffer, api_type());
  if (meta == nullptr) return nullptr;
  const MatteContent* content = &reinterpret_cast<MatteMeta*>(meta)->content;
  const auto fits = [&](const auto& plane) {
    return plane != nullptr && plane->width == width && plane->height == height;
  };
  return fits(content->matte) || fits(content->field) ? content : nullptr;
}

}  // namespace polyhull::element
