// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/element.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

namespace polyhull::element {
namespace {

// What tells an element which thing it is or works on, not how: one preset suits all cameras of a
// stage, whose masks and polygons lie elsewhere in each picture, and a file or device of this machine
// is not there on the next. (GStreamer 1.22 would bring polygons back with a backslash before each
// comma, too.)
constexpr std::array<std::string_view, 16> bound{
    "name",       "parent",         "camera",        "device",          "location",
    "rig",        "record",         "scene",         "clean-plate",     "inside-mask",
    "key-frames", "inside-polygon", "mesh-location", "outside-polygon", "outside-mask",
    "scene-file"};
bool left_out(GObjectClass* klass, const char* name) {
  GParamSpec* spec = g_object_class_find_property(klass, name);
  return (spec != nullptr && (spec->flags & G_PARAM_DEPRECATED) != 0) ||
         std::ranges::find(bound, std::string_view(name)) != bound.end();
}

gchar** (*all_names)(GstPreset*) = nullptr;  // GStreamer's own

gchar** preset_names(GstPreset* preset) {
  gchar** names = all_names(preset);
  if (names == nullptr) return nullptr;
  gchar** kept = names;
  for (gchar** name = names; *name != nullptr; ++name) {
    if (!left_out(G_OBJECT_GET_CLASS(preset), *name))
      *kept++ = *name;
    else
      g_free(*name);
  }
  *kept = nullptr;
  return names;
}

void preset_init(gpointer interface, gpointer) {
  auto* preset = static_cast<GstPresetInterface*>(interface);
  if (preset->get_property_names == preset_names) return;
  all_names = preset->get_property_names;
  preset->get_property_names = preset_names;
}

}  // namespace

void detail::add_presets(GType type) {
  if (!g_type_is_a(type, GST_TYPE_ELEMENT)) return;
  const GInterfaceInfo info{preset_init, nullptr, nullptr};
  g_type_add_interface_static(type, GST_TYPE_PRESET, &info);
}

GType detail::register_type(const char* name, GType base, GClassInitFunc class_init,
                            GInstanceInitFunc instance_init, gint* offset) {
  GTypeQuery parent;
  g_type_query(base, &parent);
  const GType type =
      g_type_register_static_simple(base, g_intern_static_string(name), parent.class_size,
                                    class_init, parent.instance_size, instance_init, GTypeFlags{});
  *offset = g_type_add_instance_private(type, sizeof(gpointer));
  return type;
}

void detail::warn_not_of_form(gpointer object, const char* name, const char* form, double minimum,
                              double maximum) {
  // A pad's warning is its element's; a pad that has none yet has nobody to tell.
  g_autoptr(GstObject) element = GST_IS_PAD(object) ? gst_object_get_parent(GST_OBJECT(object))
                                                    : GST_OBJECT(gst_object_ref(object));
  if (element == nullptr) return;
  const std::string text = fmt::format(
      "The property \"{0}\" was set to something that is not {1}; it keeps its value. Set it to "
      "{1}{2}.",
      name, form,
      minimum < maximum ? fmt::format(" from {:g} to {:g}", minimum, maximum) : std::string());
  GST_ELEMENT_WARNING(element, LIBRARY, SETTINGS, ("%s", text.c_str()), (nullptr));
  // Command lines set properties before there is a pipeline.
  g_autoptr(GstBus) bus =
      GST_IS_ELEMENT(element) ? gst_element_get_bus(GST_ELEMENT(element)) : nullptr;
  if (!bus) g_warning("%s: %s", GST_OBJECT_NAME(element), text.c_str());
}

void set_metadata(gpointer klass, const char* long_name, const char* classification,
                  const char* description) {
  gst_element_class_set_static_metadata(GST_ELEMENT_CLASS(klass), long_name, classification,
                                        description, "polyhull");
}

void add_template(gpointer klass, const char* name, GstPadDirection direction, const char* caps,
                  GType pad_type, GstPadPresence presence) {
  g_autoptr(GstCaps) parsed = gst_caps_from_string(caps);
  GstPadTemplate* made =
      pad_type == G_TYPE_NONE
          ? gst_pad_template_new(name, direction, presence, parsed)
          : gst_pad_template_new_with_gtype(name, direction, presence, parsed, pad_type);
  gst_element_class_add_pad_template(GST_ELEMENT_CLASS(klass), made);
}

GstCaps* filtered(GstCaps* caps, GstCaps* filter) {
  g_autoptr(GstCaps) held = caps;
  return filter == nullptr ? g_steal_pointer(&held)
                           : gst_caps_intersect_full(filter, held, GST_CAPS_INTERSECT_FIRST);
}

}  // namespace polyhull::element
