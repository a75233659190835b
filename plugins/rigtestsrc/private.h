// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the files of rigtestsrc share.
#pragma once

#include <gst/base/gstpushsrc.h>
#include <gst/video/video.h>

#include <cstdint>
#include <memory>

#include "plugins/common/live/frame_clock.h"
#include "plugins/common/statistics.h"
#include "plugins/rigtestsrc/draw.h"
#include "plugins/common/numbered_name.h"
#include "plugins/rigtestsrc/settings.h"

namespace polyhull::element {

/// What lives from start() to stop().
struct RigTestStream {
  RigTestDrawing drawing;
  RigOutput output = RigOutput::picture;  // of the properties when the stream began
  std::shared_ptr<const Subject> subject;
  Rig rig;
  std::unique_ptr<NumberedName> mesh_name;
  std::uint64_t camera_seed = 0;  // tells this camera's jitter from the others'
  GstVideoInfo info;              // under the object lock
};

struct RigTestState {
  explicit RigTestState(GstBaseSrc* source) : clock(source) {}
  RigTestSettings settings;  // under the object lock
  Statistics statistics{"rigtestsrc-stats"};
  FrameClock clock;
  RigTestStream stream;  // the streaming thread's; PAUSED is entered and left without one
};

}  // namespace polyhull::element

struct PolyhullRigTestSrc {
  GstPushSrc parent;
  polyhull::element::RigTestState* state;
};
struct PolyhullRigTestSrcClass {
  GstPushSrcClass parent_class;
};

#define RIG_TEST_SRC(object) (reinterpret_cast<PolyhullRigTestSrc*>(object))

namespace polyhull::element {

/// The virtual methods of GstBaseSrc that negotiate. \p parent is the class whose methods these
/// go on to.
GstCaps* rig_test_get_caps(GstBaseSrc* source, GstCaps* filter);
GstCaps* rig_test_fixate(GstBaseSrc* source, GstCaps* caps, GstBaseSrcClass* parent);
gboolean rig_test_set_caps(GstBaseSrc* source, GstCaps* caps);
gboolean rig_test_negotiate(GstBaseSrc* source, GstBaseSrcClass* parent);
gboolean rig_test_decide_allocation(GstBaseSrc* source, GstQuery* query, GstBaseSrcClass* parent);

}  // namespace polyhull::element
