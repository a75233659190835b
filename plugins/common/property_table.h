// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Properties of an element as a table over the members of a plain settings struct. The struct's
/// default member initialisers are the only place that holds a default: the GParamSpec reads it
/// there. Several elements can carry the same table (silhouette carries those of the three it
/// unites).
///
/// Values are written under the element's object lock; an element copies the whole struct once per
/// frame under the same lock and works on its copy.
#pragma once

#include <gst/gst.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/vector.h"
#include "plugins/common/enums.h"
#include "plugins/common/object_lock.h"

namespace polyhull::element {

/// When a property may be set.
enum class Change {
  live,  ///< any time; takes effect with the next frame; numbers can be driven by GstController
  when_ready,  ///< only in the states NULL and READY
};

/// Frames or pulses per second, as video caps have it; its limits are whole numbers.
struct Fraction {
  int numerator = 0, denominator = 1;
};

/// A row of a table; see property().
template <class Settings>
struct Property {
  const char* name;
  const char* blurb;  ///< in full sentences, with unit and range
  double minimum;
  double maximum;
  Change change;
  GParamSpec* (*make)(const Property&);
  bool (*set)(Settings&, const GValue*);  ///< false: the value is not of the form
  void (*get)(const Settings&, GValue*);
  const char* form = "a number";  ///< what set() takes, for people
};

namespace detail {

template <auto Member>
struct MemberOf;
template <class S, class T, T S::*Pointer>
struct MemberOf<Pointer> {
  using Settings = S;
  using Type = T;
};

template <class T, class Settings>
GParamSpec* make_spec(const Property<Settings>& p, const T& standard) {
  int flags = G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS;
  flags |= p.change == Change::live ? GST_PARAM_MUTABLE_PLAYING : GST_PARAM_MUTABLE_READY;
  if (p.change == Change::live && !std::is_same_v<T, std::string> && !std::is_same_v<T, Fraction>)
    flags |= GST_PARAM_CONTROLLABLE;
  const auto f = static_cast<GParamFlags>(flags);
  if constexpr (std::is_same_v<T, bool>) {
    return g_param_spec_boolean(p.name, p.name, p.blurb, standard, f);
  } else if constexpr (std::is_enum_v<T>) {
    return g_param_spec_enum(p.name, p.name, p.blurb, enum_type<T>(), static_cast<gint>(standard),
                             f);
  } else if constexpr (std::is_same_v<T, int>) {
    return g_param_spec_int(p.name, p.name, p.blurb, static_cast<gint>(p.minimum),
                            static_cast<gint>(p.maximum), standard, f);
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    return g_param_spec_uint(p.name, p.name, p.blurb, static_cast<guint>(p.minimum),
                             static_cast<guint>(p.maximum), standard, f);
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    return g_param_spec_uint64(
        p.name, p.name, p.blurb, static_cast<guint64>(p.minimum),
        p.maximum >= 18446744073709551615.0 ? G_MAXUINT64 : static_cast<guint64>(p.maximum),
        standard, f);
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    return g_param_spec_int64(p.name, p.name, p.blurb, static_cast<gint64>(p.minimum),
                              static_cast<gint64>(p.maximum), standard, f);
  } else if constexpr (std::is_same_v<T, double>) {
    return g_param_spec_double(p.name, p.name, p.blurb, p.minimum, p.maximum, standard, f);
  } else if constexpr (std::is_same_v<T, Fraction>) {
    return gst_param_spec_fraction(p.name, p.name, p.blurb, static_cast<gint>(p.minimum), 1,
                                   static_cast<gint>(p.maximum), 1, standard.numerator,
                                   standard.denominator, f);
  } else {
    static_assert(std::is_same_v<T, std::string>, "no GObject property for this type");
    return g_param_spec_string(p.name, p.name, p.blurb,
                               standard.empty() ? nullptr : standard.c_str(), f);
  }
}

template <class T>
bool read_value(T& target, const GValue* value) {
  if constexpr (std::is_same_v<T, bool>) {
    target = g_value_get_boolean(value) != FALSE;
  } else if constexpr (std::is_enum_v<T>) {
    target = static_cast<T>(g_value_get_enum(value));
  } else if constexpr (std::is_same_v<T, int>) {
    target = g_value_get_int(value);
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    target = g_value_get_uint(value);
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    target = g_value_get_uint64(value);
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    target = g_value_get_int64(value);
  } else if constexpr (std::is_same_v<T, double>) {
    // GObject's range check lets NaN pass.
    if (std::isnan(g_value_get_double(value))) return false;
    target = g_value_get_double(value);
  } else if constexpr (std::is_same_v<T, Fraction>) {
    target = {gst_value_get_fraction_numerator(value), gst_value_get_fraction_denominator(value)};
  } else {
    const gchar* text = g_value_get_string(value);
    target = text != nullptr ? text : "";
  }
  return true;
}

template <class T>
void write_value(const T& source, GValue* value) {
  if constexpr (std::is_same_v<T, bool>) {
    g_value_set_boolean(value, source);
  } else if constexpr (std::is_enum_v<T>) {
    g_value_set_enum(value, static_cast<gint>(source));
  } else if constexpr (std::is_same_v<T, int>) {
    g_value_set_int(value, source);
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    g_value_set_uint(value, source);
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    g_value_set_uint64(value, source);
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    g_value_set_int64(value, source);
  } else if constexpr (std::is_same_v<T, double>) {
    g_value_set_double(value, source);
  } else if constexpr (std::is_same_v<T, Fraction>) {
    gst_value_set_fraction(value, source.numerator, source.denominator);
  } else {
    g_value_set_string(value, source.empty() ? nullptr : source.c_str());
  }
}

}  // namespace detail

/// One row of a table: the property \p name over the member \p Member of the settings struct.
/// \p minimum and \p maximum matter for numbers only.
template <auto Member>
constexpr auto property(const char* name, const char* blurb, double minimum = 0.0,
                        double maximum = 0.0, Change change = Change::live) {
  using Settings = typename detail::MemberOf<Member>::Settings;
  using T = typename detail::MemberOf<Member>::Type;
  return Property<Settings>{
      name,
      blurb,
      minimum,
      maximum,
      change,
      [](const Property<Settings>& p) { return detail::make_spec<T>(p, Settings{}.*Member); },
      [](Settings& settings, const GValue* value) {
        return detail::read_value<T>(settings.*Member, value);
      },
      [](const Settings& settings, GValue* value) {
        detail::write_value<T>(settings.*Member, value);
      }};
}

/// Off and on, for a bool whose property is typed so.
enum class Switch { off, on };

/// How a member of another type is shown, and taken from what is shown: a bool as a Switch, a colour
/// (0..1) as big-endian ARGB, whose alpha is not used.
inline Switch shown(bool on) {
  return on ? Switch::on : Switch::off;
}
inline void take(bool& on, Switch value) {
  on = value == Switch::on;
}
inline std::uint32_t shown(const Vec3f& colour) {
  std::uint32_t argb = 0xff;
  for (int c = 0; c < 3; ++c)
    argb = argb << 8 | static_cast<std::uint32_t>(std::lround(255.0f * colour[c]));
  return argb;
}
inline void take(Vec3f& colour, std::uint32_t argb) {
  colour = Vec3f(argb >> 16 & 0xff, argb >> 8 & 0xff, argb & 0xff) / 255.0f;
}

/// As property(), of the type that shown() makes of the member.
template <auto Member>
constexpr auto shown_property(const char* name, const char* blurb, double minimum = 0.0,
                              double maximum = 0.0) {
  using Settings = typename detail::MemberOf<Member>::Settings;
  using T = decltype(shown(Settings{}.*Member));
  return Property<Settings>{name,
                            blurb,
                            minimum,
                            maximum,
                            Change::live,
                            [](const Property<Settings>& p) {
                              return detail::make_spec<T>(p, shown(Settings{}.*Member));
                            },
                            [](Settings& settings, const GValue* value) {
                              T given{};
                              detail::read_value(given, value);
                              take(settings.*Member, given);
                              return true;
                            },
                            [](const Settings& settings, GValue* value) {
                              detail::write_value(shown(settings.*Member), value);
                            }};
}

/// A copy of \p table in which the property \p from is called \p to; the name must be a literal.
template <class Settings>
std::vector<Property<Settings>> renamed(std::span<const Property<Settings>> table,
                                        std::string_view from, const char* to) {
  std::vector<Property<Settings>> copy(table.begin(), table.end());
  for (Property<Settings>& row : copy) {
    if (row.name == from) row.name = to;
  }
  return copy;
}

}  // namespace polyhull::element
