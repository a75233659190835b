// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/pad.h"

#include "plugins/hullbuild/entry.h"

namespace polyhull::element {
namespace {

constexpr Property<HullPadSettings> properties[] = {
    property<&HullPadSettings::camera>("camera",
                                       "Name of the camera in the rig file whose views come in "
                                       "here. Unset, the name that the views carry counts.")};

}  // namespace

HullPadState::HullPadState(gpointer pad) {
  state_of<LivePadState>(pad).entry = place_view;
}

void HullPadState::class_init(gpointer klass) {
  add_properties<HullPadState>(klass, properties, &HullPadState::settings);
}

void HullPadState::forget_front() {
  view.reset();
  gst_clear_buffer(&parsed.buffer);
}

void HullPadState::reset() {
  forget_front();
  held.reset();
  held_time = no_time;
  last_trigger = no_trigger;
  last_time = no_time;
  missed_since = no_time;
  brought.clear();
  brought_at = no_time;
  delivered = ended = false;
  late = duplicate = early = unusable = given_up = jumps = 0;
  holes_filled = pieces_dropped = 0;
}

std::string camera_property(GstAggregatorPad* pad) {
  return snapshot(pad, state_of<HullPadState>(pad).settings).camera;
}

}  // namespace polyhull::element
