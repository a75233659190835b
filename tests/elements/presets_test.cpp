// SPDX-License-Identifier: LGPL-2.1-or-later
// GstPreset on every element: what was set, saved and changed is as it was after loading; an
// element's name, camera, device, files and places in the camera's picture are its own.
#include <glib/gstdio.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "element_test.h"
#include "support/folder.h"

namespace {

// GLib looks once; so before main().
const polyhull::test::Folder folder;
const bool is_used = g_setenv("XDG_DATA_HOME", folder.path.c_str(), TRUE) != FALSE;

const std::set<std::string> own{"name",           "parent",          "camera",      "device",
                                "location",       "mesh-location",   "record",      "rig",
                                "scene",          "clean-plate",     "inside-mask", "outside-mask",
                                "inside-polygon", "outside-polygon", "scene-file",  "key-frames"};

std::vector<std::string> element_names() {
  std::vector<std::string> names;
  GList* features = gst_registry_get_feature_list_by_plugin(gst_registry_get(), "polyhull");
  for (GList* item = features; item; item = item->next)
    if (GST_IS_ELEMENT_FACTORY(item->data)) names.emplace_back(GST_OBJECT_NAME(item->data));
  gst_plugin_feature_list_free(features);
  return names;
}

// Names of what a preset keeps.
std::set<std::string> preset_properties(GstElement* element) {
  g_auto(GStrv) names = gst_preset_get_property_names(GST_PRESET(element));
  std::set<std::string> result;
  for (gchar** name = names; name && *name; ++name) result.insert(*name);
  return result;
}

std::map<std::string, std::string> values_of(GstElement* element) {
  std::map<std::string, std::string> values;
  for (const std::string& name : preset_properties(element)) {
    GParamSpec* spec = g_object_class_find_property(G_OBJECT_GET_CLASS(element), name.c_str());
    g_auto(GValue) value = G_VALUE_INIT;
    g_value_init(&value, spec->value_type);
    g_object_get_property(G_OBJECT(element), name.c_str(), &value);
    g_autofree gchar* text = gst_value_serialize(&value);
    values[name] = text ? text : "";
  }
  return values;
}

double inside(double standard, double minimum, double maximum) {
  return standard + 0.3 < maximum   ? standard + 0.3
         : standard - 0.3 > minimum ? standard - 0.3
                                    : minimum;
}

// Another value than the default, which the element may round or refuse.
void change(GstElement* element, GParamSpec* spec) {
  g_auto(GValue) value = G_VALUE_INIT;
  g_value_init(&value, spec->value_type);
  g_param_value_set_default(spec, &value);
  if (G_IS_PARAM_SPEC_BOOLEAN(spec)) g_value_set_boolean(&value, !g_value_get_boolean(&value));
  if (G_IS_PARAM_SPEC_INT(spec)) {
    const auto* range = G_PARAM_SPEC_INT(spec);
    g_value_set_int(
        &value, range->default_value < range->maximum ? range->default_value + 1 : range->minimum);
  }
  if (G_IS_PARAM_SPEC_UINT(spec)) {
    const auto* range = G_PARAM_SPEC_UINT(spec);
    g_value_set_uint(
        &value, range->default_value < range->maximum ? range->default_value + 1 : range->minimum);
  }
  if (G_IS_PARAM_SPEC_UINT64(spec)) {
    const auto* range = G_PARAM_SPEC_UINT64(spec);
    g_value_set_uint64(
        &value, range->default_value < range->maximum ? range->default_value + 1 : range->minimum);
  }
  if (G_IS_PARAM_SPEC_DOUBLE(spec)) {
    const auto* range = G_PARAM_SPEC_DOUBLE(spec);
    g_value_set_double(&value, inside(range->default_value, range->minimum, range->maximum));
  }
  if (G_IS_PARAM_SPEC_ENUM(spec)) {
    const auto* choice = G_PARAM_SPEC_ENUM(spec);
    for (guint i = 0; i < choice->enum_class->n_values; ++i)
      if (choice->enum_class->values[i].value != choice->default_value)
        g_value_set_enum(&value, choice->enum_class->values[i].value);
  }
  if (spec->value_type == GST_TYPE_FRACTION) gst_value_set_fraction(&value, 30000, 1001);
  g_object_set_property(G_OBJECT(element), spec->name, &value);
}

void reset(GstElement* element, GParamSpec* spec) {
  g_auto(GValue) value = G_VALUE_INIT;
  g_value_init(&value, spec->value_type);
  g_param_value_set_default(spec, &value);
  g_object_set_property(G_OBJECT(element), spec->name, &value);
}

GParamSpec* spec_of(GstElement* element, const std::string& name) {
  return g_object_class_find_property(G_OBJECT_GET_CLASS(element), name.c_str());
}

}  // namespace

ELEMENT_TEST(test_saved_changed_loaded) {
  const std::vector<std::string> names = element_names();
  fail_unless(names.size() >= 12, "only %zu elements", names.size());
  for (const std::string& name : names) {
    GstElement* element = gst_element_factory_make(name.c_str(), nullptr);
    fail_unless(GST_IS_PRESET(element), "%s has no presets", name.c_str());
    const auto standard = values_of(element);
    if (standard.empty()) {  // all that it has is its own: there is nothing to save
      gst_object_unref(element);
      continue;
    }
    for (const auto& [property, value] : standard) change(element, spec_of(element, property));
    const auto changed = values_of(element);
    std::size_t different = 0;
    for (const auto& [property, value] : changed) different += value != standard.at(property);
    fail_unless(2 * different >= changed.size(), "%s: %zu of %zu changed", name.c_str(), different,
                changed.size());
    fail_unless(gst_preset_save_preset(GST_PRESET(element), "stage 1: warm"), "%s", name.c_str());
    for (const auto& [property, value] : standard) reset(element, spec_of(element, property));
    fail_unless(gst_preset_load_preset(GST_PRESET(element), "stage 1: warm"), "%s", name.c_str());
    GstElement* other = gst_element_factory_make(name.c_str(), "another");
    fail_unless(gst_preset_load_preset(GST_PRESET(other), "stage 1: warm"), "%s", name.c_str());
    for (const auto& [property, value] : changed) {
      for (GstElement* loaded : {element, other}) {
        const std::string found = values_of(loaded).at(property);
        fail_unless(found == value, "%s.%s is %s instead of %s", name.c_str(), property.c_str(),
                    found.c_str(), value.c_str());
      }
    }
    fail_unless_equals_string(GST_OBJECT_NAME(other), "another");
    gst_object_unref(element);
    gst_object_unref(other);
  }
}

// Every property that can be set is in a preset but for those that bind an element to its place.
ELEMENT_TEST(test_what_a_preset_holds) {
  for (const std::string& name : element_names()) {
    GstElement* element = gst_element_factory_make(name.c_str(), nullptr);
    const std::set<std::string> kept = preset_properties(element);
    guint count = 0;
    g_autofree GParamSpec** specs =
        g_object_class_list_properties(G_OBJECT_GET_CLASS(element), &count);
    for (guint i = 0; i < count; ++i) {
      const bool settable = (specs[i]->flags & G_PARAM_READWRITE) == G_PARAM_READWRITE &&
                            !(specs[i]->flags & (G_PARAM_CONSTRUCT_ONLY | G_PARAM_DEPRECATED));
      fail_unless(kept.contains(specs[i]->name) == (settable && !own.contains(specs[i]->name)),
                  "%s.%s", name.c_str(), specs[i]->name);
    }
    gst_object_unref(element);
  }
}
