// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/pad.h"

namespace polyhull::element {
namespace {

enum { first_placement = 1 };

G_DEFINE_TYPE(PolyhullMeshPad, polyhull_mesh_pad, live_pad_type())

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  if (!set_property(object, placement_properties(), first_placement,
                    mesh_state_of(object).placement, id, value))
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  if (!get_property(object, placement_properties(), first_placement,
                    mesh_state_of(object).placement, id, value))
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void polyhull_mesh_pad_init(PolyhullMeshPad* self) {
  self->state = new MeshPadState;
}

void finalize(GObject* object) {
  delete &mesh_state_of(object);
  G_OBJECT_CLASS(polyhull_mesh_pad_parent_class)->finalize(object);
}

void polyhull_mesh_pad_class_init(PolyhullMeshPadClass* klass) {
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  install_properties(object_class, placement_properties(), first_placement);
}

}  // namespace

GType mesh_pad_type() {
  return polyhull_mesh_pad_get_type();
}

bool is_mesh_pad(gpointer pad) {
  return G_TYPE_CHECK_INSTANCE_TYPE(pad, mesh_pad_type());
}

}  // namespace polyhull::element
