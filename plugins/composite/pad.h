// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The mesh pads of composite: one subject each.
#pragma once

#include <gst/base/gstaggregator.h>

#include <memory>

#include "plugins/common/live/live_pad.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/composite/properties.h"

namespace polyhull::element {

/// What a pad knows; belongs to the element's streaming thread except where said.
struct MeshPadState {
  PlacementSettings placement;  ///< properties, under the pad's object lock

  std::unique_ptr<MeshBuffer> mesh;  ///< the one shown; null: none yet
  std::uint64_t content = 0;         ///< its number, never used twice
  std::int64_t time = no_time;       ///< its running time
  std::int64_t end = no_time;        ///< up to when nothing newer is to be expected
};

struct PolyhullMeshPad {
  PolyhullLivePad parent;
  MeshPadState* state;
};

struct PolyhullMeshPadClass {
  PolyhullLivePadClass parent_class;
};

GType mesh_pad_type();

bool is_mesh_pad(gpointer pad);

inline MeshPadState& mesh_state_of(gpointer pad) {
  return *static_cast<PolyhullMeshPad*>(pad)->state;
}

}  // namespace polyhull::element
