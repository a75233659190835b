// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the files of rigtestsrc share.
#pragma once

#include <gst/base/gstpushsrc.h>
#include <gst/video/video.h>

#include <cstdint>
#include <memory>

#include "files/numbered_name.h"
#include "plugins/common/live/frame_source.h"
#include "plugins/rigtestsrc/draw.h"
#include "plugins/rigtestsrc/settings.h"

namespace polyhull::element {

/// What lives from open() to close().
struct RigTestStream {
  RigTestDrawing drawing;
  RigOutput output = RigOutput::picture;  // of the properties when the stream began
  std::shared_ptr<const Subject> subject;
  Rig rig;
  std::unique_ptr<NumberedName> mesh_name;
  std::uint64_t camera_seed = 0;  // tells this camera's jitter from the others'
};

struct RigTestSrc : FrameSource {
  static constexpr char type_name[] = "PolyhullRigTestSrc";
  static constexpr char refusal[] = "A rig's camera cannot deliver";
  static GType base_type() { return GST_TYPE_PUSH_SRC; }
  static void class_init(gpointer klass);

  explicit RigTestSrc(gpointer object);
  void property_set(gpointer object, std::string_view name);
  void open(GstElement* element);
  void close(GstElement* element);

  RigTestSettings settings;  // under the object lock
  Statistics statistics{"rigtestsrc-stats"};
  RigTestStream stream;  // the streaming thread's; PAUSED is entered and left without one
};

/// The virtual methods of GstBaseSrc that negotiate.
GstCaps* rig_test_get_caps(GstBaseSrc* source, GstCaps* filter);
GstCaps* rig_test_fixate(GstBaseSrc* source, GstCaps* caps);
gboolean rig_test_negotiate(GstBaseSrc* source);
gboolean rig_test_decide_allocation(GstBaseSrc* source, GstQuery* query);

}  // namespace polyhull::element
