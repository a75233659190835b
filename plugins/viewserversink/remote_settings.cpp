// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewserversink/remote_settings.h"

#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "plugins/common/network/tls.h"

namespace polyhull::element {
namespace {

struct ValueUnset {
  void operator()(GValue* value) const {
    if (G_IS_VALUE(value)) g_value_unset(value);
    delete value;
  }
};
using ValueRef = std::unique_ptr<GValue, ValueUnset>;

Ref<GstElement> element_of(GstElement* beside, const std::string& name) {
  g_autoptr(GstObject) parent = gst_object_get_parent(GST_OBJECT(beside));
  GstElement* found = parent != nullptr && GST_IS_BIN(parent)
                          ? gst_bin_get_by_name_recurse_up(GST_BIN(parent), name.c_str())
                          : nullptr;
  if (found == nullptr)
    throw Error(Error::Kind::not_found,
                "There is no element '{}' in the pipeline, as settings-for says.", name);
  return Ref<GstElement>(found);
}

/// Whether clients may set \p property: one that may change while it plays, and no text, which may be
/// a file's name or say which camera this is, but for the two that are polygons.
bool is_for_clients(const GParamSpec* property) {
  constexpr guint live = GST_PARAM_CONTROLLABLE | GST_PARAM_MUTABLE_PLAYING;
  const std::string_view name = property->name;
  return (property->flags & G_PARAM_WRITABLE) != 0 && (property->flags & live) != 0 &&
         (property->value_type != G_TYPE_STRING || name == "outside-polygon" ||
          name == "inside-polygon");
}

/// The value that \p text gives the property \p name.
ValueRef value_of(GParamSpec* property, const std::string& name, const std::string& text) {
  ValueRef value(new GValue(G_VALUE_INIT));
  g_value_init(value.get(), property->value_type);
  if (!gst_value_deserialize_with_pspec(value.get(), text.c_str(), property))
    throw Error(Error::Kind::bad_input, "'{}' is no value for '{}', which is a {}.", text, name,
                g_type_name(property->value_type));
  if (g_param_value_validate(property, value.get()))
    throw Error(Error::Kind::bad_input, "'{}' is out of the range of '{}'.", text, name);
  return value;
}

}  // namespace

void apply_remote_settings(GstElement* beside, const std::string& name, const std::string& text) {
  const Ref<GstElement> element = element_of(beside, name);
  g_auto(GStrv) words = nullptr;
  g_autoptr(GError) error = nullptr;
  if (!g_shell_parse_argv(text.c_str(), nullptr, &words, &error))
    throw Error(Error::Kind::bad_input, "'{}' are no settings: {}", text, error->message);
  std::vector<std::pair<GParamSpec*, ValueRef>> changes;
  for (gchar** word = words; *word != nullptr; ++word) {
    const std::string each = *word;
    const std::size_t equals = each.find('=');
    const std::string key = each.substr(0, equals);
    GParamSpec* property =
        equals == std::string::npos
            ? nullptr
            : g_object_class_find_property(G_OBJECT_GET_CLASS(element.get()), key.c_str());
    if (property == nullptr || !is_for_clients(property))
      throw Error(
          Error::Kind::bad_input,
          "'{}' is no property of '{}' that clients can set: one that may change while it plays, "
          "and no file or other text; expected are such as \"sigma=1.5\".",
          key, name);
    changes.emplace_back(property, value_of(property, key, each.substr(equals + 1)));
  }
  for (const auto& [property, value] : changes)
    g_object_set_property(G_OBJECT(element.get()), property->name, value.get());
}

}  // namespace polyhull::element
