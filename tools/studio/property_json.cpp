// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/property_json.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>

namespace polyhull {
namespace {

using Json = nlohmann::ordered_json;

// At most so much of a value in a message.
std::string shown(const Json& value) {
  const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return text.size() <= 60 ? text : text.substr(0, 60) + "…";
}

std::optional<std::string> refuse(const Json& value, const std::string& expected) {
  return fmt::format("is {}; expected {}", shown(value), expected);
}

// A number as a GValue of \p type, which holds it exactly, or not at all.
template <class Number, class Set>
std::optional<std::string> set_whole(GValue* target, const Json& value, Number least, Number most,
                                     Set set) {
  const std::string expected = fmt::format("a whole number from {} to {}", least, most);
  bool fits = false;
  if (value.is_number_unsigned())
    fits = std::in_range<Number>(value.get<std::uint64_t>());
  else if (value.is_number_integer())
    fits = std::in_range<Number>(value.get<std::int64_t>());
  if (!fits) return refuse(value, expected);
  const Number number = value.get<Number>();
  if (number < least || number > most) return refuse(value, expected);
  set(target, number);
  return std::nullopt;
}

std::optional<std::string> set_real(GValue* target, const Json& value, double least, double most) {
  const std::string expected = fmt::format("a number from {:g} to {:g}", least, most);
  if (!value.is_number()) return refuse(value, expected);
  const double number = value.get<double>();
  if (!(number >= least && number <= most)) return refuse(value, expected);
  if (G_VALUE_HOLDS_DOUBLE(target))
    g_value_set_double(target, number);
  else
    g_value_set_float(target, static_cast<float>(number));
  return std::nullopt;
}

std::optional<std::string> set_enum(GValue* target, const Json& value, const GParamSpec* spec) {
  const GEnumClass* choice = G_PARAM_SPEC_ENUM(spec)->enum_class;
  std::string nicks;
  for (guint i = 0; i < choice->n_values; ++i) {
    const char* nick = choice->values[i].value_nick;
    if (value.is_string() && value.get_ref<const std::string&>() == nick) {
      g_value_set_enum(target, choice->values[i].value);
      return std::nullopt;
    }
    nicks += fmt::format("{}{}", nicks.empty() ? "" : ", ", nick);
  }
  return refuse(value, "one of " + nicks);
}

std::optional<std::string> set_text(GValue* target, const Json& value) {
  if (value.is_null()) return std::nullopt;  // not set
  if (!value.is_string()) return refuse(value, "a text or null");
  const std::string& text = value.get_ref<const std::string&>();
  if (text.find('\0') != text.npos) return refuse(value, "a text without zero bytes");
  g_value_set_string(target, text.c_str());
  return std::nullopt;
}

std::optional<std::string> fill(GValue* target, const Json& value, const GParamSpec* spec) {
  if (G_IS_PARAM_SPEC_BOOLEAN(spec)) {
    if (!value.is_boolean()) return refuse(value, "true or false");
    g_value_set_boolean(target, value.get<bool>());
    return std::nullopt;
  }
#define WHOLE(KIND, kind)                                               \
  if (G_IS_PARAM_SPEC_##KIND(spec))                                     \
    return set_whole(target, value, G_PARAM_SPEC_##KIND(spec)->minimum, \
                     G_PARAM_SPEC_##KIND(spec)->maximum, g_value_set_##kind);
  WHOLE(INT, int)
  WHOLE(UINT, uint)
  WHOLE(INT64, int64)
  WHOLE(UINT64, uint64)
#undef WHOLE
  if (G_IS_PARAM_SPEC_DOUBLE(spec))
    return set_real(target, value, G_PARAM_SPEC_DOUBLE(spec)->minimum,
                    G_PARAM_SPEC_DOUBLE(spec)->maximum);
  if (G_IS_PARAM_SPEC_FLOAT(spec))
    return set_real(target, value, G_PARAM_SPEC_FLOAT(spec)->minimum,
                    G_PARAM_SPEC_FLOAT(spec)->maximum);
  if (G_IS_PARAM_SPEC_ENUM(spec)) return set_enum(target, value, spec);
  if (G_IS_PARAM_SPEC_STRING(spec)) return set_text(target, value);
  if (value.is_null() && G_VALUE_HOLDS_BOXED(target)) return std::nullopt;  // not set
  const std::string expected =
      fmt::format("a text that GStreamer reads as {}", g_type_name(spec->value_type));
  if (!value.is_string() ||
      !gst_value_deserialize(target, value.get_ref<const std::string&>().c_str()))
    return refuse(value, expected);
  return std::nullopt;
}

std::optional<Json> json_of(double number) {
  return std::isfinite(number) ? std::optional<Json>(number) : std::nullopt;
}

std::optional<Json> json_of(const char* text) {
  return g_utf8_validate(text, -1, nullptr) ? std::optional<Json>(text) : std::nullopt;
}

}  // namespace

bool is_setting(const GParamSpec* spec) {
  return (spec->flags & G_PARAM_READWRITE) == G_PARAM_READWRITE &&
         !(spec->flags & G_PARAM_CONSTRUCT_ONLY) && !g_type_is_a(spec->value_type, G_TYPE_OBJECT) &&
         !g_type_is_a(spec->value_type, G_TYPE_POINTER) && std::string_view(spec->name) != "name";
}

std::optional<Json> property_json(GObject* object, const GParamSpec* spec) {
  g_auto(GValue) value = G_VALUE_INIT;
  g_value_init(&value, spec->value_type);
  g_object_get_property(object, spec->name, &value);
  if (G_VALUE_HOLDS_BOOLEAN(&value)) return static_cast<bool>(g_value_get_boolean(&value));
  if (G_VALUE_HOLDS_INT(&value)) return g_value_get_int(&value);
  if (G_VALUE_HOLDS_UINT(&value)) return g_value_get_uint(&value);
  if (G_VALUE_HOLDS_INT64(&value)) return g_value_get_int64(&value);
  if (G_VALUE_HOLDS_UINT64(&value)) return g_value_get_uint64(&value);
  if (G_VALUE_HOLDS_DOUBLE(&value)) return json_of(g_value_get_double(&value));
  if (G_VALUE_HOLDS_FLOAT(&value)) return json_of(static_cast<double>(g_value_get_float(&value)));
  if (G_IS_PARAM_SPEC_ENUM(spec)) {
    const GEnumValue* found =
        g_enum_get_value(G_PARAM_SPEC_ENUM(spec)->enum_class, g_value_get_enum(&value));
    return found ? std::optional<Json>(found->value_nick) : std::nullopt;
  }
  if (G_VALUE_HOLDS_STRING(&value)) {
    const char* text = g_value_get_string(&value);
    return text ? json_of(text) : Json();
  }
  if (G_VALUE_HOLDS_BOXED(&value) && g_value_get_boxed(&value) == nullptr) return Json();
  g_autofree char* text = gst_value_serialize(&value);
  return text ? json_of(text) : std::nullopt;
}

std::optional<std::string> set_property_json(GObject* object, const GParamSpec* spec,
                                             const Json& value) {
  g_auto(GValue) target = G_VALUE_INIT;
  g_value_init(&target, spec->value_type);
  if (auto problem = fill(&target, value, spec)) return problem;
  g_object_set_property(object, spec->name, &target);
  return std::nullopt;
}

}  // namespace polyhull
