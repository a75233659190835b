// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The mesh pads of composite: one subject each.
#pragma once

#include <gst/base/gstaggregator.h>

#include <memory>

#include "imagehull/image_subject.h"
#include "plugins/common/live/live_pad.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/composite/properties.h"

namespace polyhull::element {

/// What a pad knows; belongs to the element's streaming thread except where said.
struct MeshPadState {
  static constexpr char type_name[] = "PolyhullMeshPad";
  static GType base_type() { return type_of<LivePadState>(); }
  static void class_init(gpointer klass) {
    add_properties<MeshPadState>(klass, placement_properties(), &MeshPadState::placement);
  }
  explicit MeshPadState(gpointer) {}

  PlacementSettings placement;  ///< properties, under the pad's object lock

  std::unique_ptr<MeshBuffer> mesh;  ///< the one shown; null: none yet
  std::uint64_t content = 0;         ///< its number, never used twice
  /// What subject=image-based draws of it; null: not asked for yet, or refused.
  std::shared_ptr<const ImageSubject> image;
  std::uint64_t image_content = 0;  ///< the number of the mesh that it was last asked for of
  std::int64_t time = no_time;      ///< its running time
  std::int64_t begin = no_time;     ///< of what came last, a mesh or a gap
  std::int64_t end = no_time;       ///< up to when nothing newer is to be expected

  void forget() {
    image.reset();
    image_content = 0;
    mesh.reset();
    time = begin = end = no_time;
  }
};

inline bool is_mesh_pad(gpointer pad) {
  return G_TYPE_CHECK_INSTANCE_TYPE(pad, type_of<MeshPadState>());
}

}  // namespace polyhull::element
