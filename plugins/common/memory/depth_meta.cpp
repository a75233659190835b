// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/depth_meta.h"

#include <utility>

#include "plugins/common/memory/shared_meta.h"

namespace polyhull::element {
namespace {

struct DepthTraits {
  using Value = DepthPicture;
  static constexpr char api_name[] = "PolyhullDepthMetaAPI";
  static constexpr char meta_name[] = "PolyhullDepthMeta";
};
using DepthMeta = SharedMeta<DepthTraits>;

}  // namespace

void set_depth(GstBuffer* buffer, std::shared_ptr<const DepthPicture> depth) {
  // Who shares the buffer reads its metas.
  if (gst_buffer_is_writable(buffer)) DepthMeta::set(buffer, std::move(depth));
}

std::shared_ptr<const DepthPicture> attached_depth(GstBuffer* buffer) {
  return DepthMeta::get(buffer);
}

}  // namespace polyhull::element
