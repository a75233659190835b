// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/pad.h"

namespace polyhull::element {
namespace {

enum { property_camera = 1 };

G_DEFINE_TYPE(PolyhullHullPad, polyhull_hull_pad, live_pad_type())

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  if (id != property_camera) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
    return;
  }
  const gchar* text = g_value_get_string(value);
  GST_OBJECT_LOCK(object);
  state_of(object).camera = text != nullptr ? text : "";
  GST_OBJECT_UNLOCK(object);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  if (id != property_camera) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
    return;
  }
  const std::string camera = camera_property(GST_AGGREGATOR_PAD(object));
  g_value_set_string(value, camera.empty() ? nullptr : camera.c_str());
}

void polyhull_hull_pad_init(PolyhullHullPad* self) {
  self->state = new HullPadState;
}

void finalize(GObject* object) {
  HullPadState* state = &state_of(object);
  state->reset();
  delete state;
  G_OBJECT_CLASS(polyhull_hull_pad_parent_class)->finalize(object);
}

void polyhull_hull_pad_class_init(PolyhullHullPadClass* klass) {
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  g_object_class_install_property(
      object_class, property_camera,
      g_param_spec_string(
          "camera", "Camera",
          "Name of the camera in the rig file whose views come in here. Unset, the name that the "
          "views carry counts.",
          nullptr,
          static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS |
                                   GST_PARAM_MUTABLE_PLAYING)));
}

}  // namespace

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
  delivered = ended = false;
  late = 0;
}

GType hull_pad_type() {
  return polyhull_hull_pad_get_type();
}

std::string camera_property(GstAggregatorPad* pad) {
  GST_OBJECT_LOCK(pad);
  std::string camera = state_of(pad).camera;
  GST_OBJECT_UNLOCK(pad);
  return camera;
}

}  // namespace polyhull::element
