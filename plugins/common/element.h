// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How an element of this plugin is declared, and a pad with properties of its own: a C++ struct is
/// its state, made and deleted with the GObject, and a function class_init() describes its class.
///
///     struct Blur {
///       static constexpr char type_name[] = "PolyhullBlur";
///       static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
///       static void class_init(gpointer klass);
///
///       explicit Blur(gpointer object);  // what GObject calls init
///       BlurSettings settings;           // under the object lock
///       Statistics statistics{"blur-stats"};
///     };
///
///     gboolean start(GstBaseTransform* base) {
///       state_of<Blur>(base).statistics.reset();
///       return TRUE;
///     }
///
///     void Blur::class_init(gpointer klass) {
///       add_properties<Blur>(klass, blur_properties(), &Blur::settings);
///       add_statistics<Blur>(klass, "Counters since the start: frames.");
///       set_metadata(klass, "Blur", "Filter/Effect/Video", "Blurs what comes");
///       add_template(klass, "sink", GST_PAD_SINK, "video/x-raw");
///       GST_BASE_TRANSFORM_CLASS(klass)->start = start;
///     }
///
///     GST_ELEMENT_REGISTER_DEFINE(blur, "blur", GST_RANK_NONE, type_of<Blur>())
///
/// What a state may have besides: `void property_set(gpointer object, std::string_view name)`,
/// called after a property was set, without a lock; `GstStructure* statistics_of(gpointer object)`,
/// what the property `stats` shows in the place of `statistics`; `static void
/// add_interfaces(GType)`.
#pragma once

#include <gst/gst.h>

#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "plugins/common/log.h"
#include "plugins/common/object_lock.h"
#include "plugins/common/property_table.h"
#include "plugins/common/statistics.h"

namespace polyhull::element {

namespace detail {

/// How a property of an object is written and read; both take the locks they need.
struct Accessors {
  std::function<void(gpointer object, const GValue*)> set;
  std::function<void(gpointer object, GValue*)> get;
};

/// What there is once for each class.
template <class State>
struct Class {
  inline static gint offset = 0;  // from an object to the pointer to its state
  inline static gpointer parent = nullptr;
  inline static std::vector<Accessors> properties;  // by property id, less 1
};

/// Registers a GObject type with room for the pointer to its state at \p offset.
GType register_type(const char* name, GType base, GClassInitFunc class_init,
                    GInstanceInitFunc instance_init, gint* offset);

/// Lets an element be saved and loaded by GstPreset: its writable properties, under GStreamer's own
/// rules for what is one; other types stay as they are.
void add_presets(GType type);

/// Says that property \p name was set to what is not \p form and keeps its value: by a warning
/// message, or on standard error while no pipeline could take that.
void warn_not_of_form(gpointer object, const char* name, const char* form, double minimum,
                      double maximum);

}  // namespace detail

/// The state of \p object, which is of the type of State or of one derived from it.
template <class State>
State& state_of(gpointer object) {
  return **reinterpret_cast<State**>(static_cast<char*>(object) + detail::Class<State>::offset);
}

/// The class that the type of State derives from, for GST_..._CLASS(parent_class<State>()).
template <class State>
gpointer parent_class() {
  return detail::Class<State>::parent;
}

namespace detail {

template <class State>
void set_property(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Class<State>::properties[id - 1].set(object, value);
  if (_gst_debug_min >= GST_LEVEL_DEBUG) log_property(object, value, spec);
  if constexpr (requires(State & s) { s.property_set(object, spec->name); })
    state_of<State>(object).property_set(object, spec->name);
}

template <class State>
void get_property(GObject* object, guint id, GValue* value, GParamSpec*) {
  Class<State>::properties[id - 1].get(object, value);
}

template <class State>
void finalize(GObject* object) {
  delete &state_of<State>(object);
  G_OBJECT_CLASS(parent_class<State>())->finalize(object);
}

template <class State>
void class_init(gpointer klass, gpointer) {
  Class<State>::parent = g_type_class_peek_parent(klass);
  g_type_class_adjust_private_offset(klass, &Class<State>::offset);
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property<State>;
  object_class->get_property = get_property<State>;
  object_class->finalize = finalize<State>;
  State::class_init(klass);
}

template <class State>
void instance_init(GTypeInstance* object, gpointer) {
  *reinterpret_cast<State**>(reinterpret_cast<char*>(object) + Class<State>::offset) =
      new State(object);
}

}  // namespace detail

/// The GObject type whose state is State; registered by the first call.
template <class State>
GType type_of() {
  static const GType type = [] {
    const GType made =
        detail::register_type(State::type_name, State::base_type(), detail::class_init<State>,
                              detail::instance_init<State>, &detail::Class<State>::offset);
    if constexpr (requires { State::add_interfaces(made); }) State::add_interfaces(made);
    detail::add_presets(made);
    return made;
  }();
  return type;
}

/// Adds a property that is no row of a table.
template <class State>
void add_property(gpointer klass, GParamSpec* spec, detail::Accessors accessors) {
  auto& properties = detail::Class<State>::properties;
  properties.push_back(std::move(accessors));
  g_object_class_install_property(G_OBJECT_CLASS(klass), static_cast<guint>(properties.size()),
                                  spec);
}

/// Adds the properties of \p table, which must last, over the settings \p member of State
/// (or of what either derives from). A value that is not of its form is refused with a warning and
/// changes nothing.
template <class State, class Table, class Owner, class Settings>
void add_properties(gpointer klass, const Table& table, Settings Owner::*member) {
  for (const auto& row : table) {
    const auto set = [&row, member](gpointer object, const GValue* value) {
      bool accepted = false;
      {
        const ObjectLock lock(object);
        accepted = row.set(state_of<State>(object).*member, value);
      }
      if (!accepted) detail::warn_not_of_form(object, row.name, row.form, row.minimum, row.maximum);
    };
    const auto get = [&row, member](gpointer object, GValue* value) {
      const ObjectLock lock(object);
      row.get(state_of<State>(object).*member, value);
    };
    add_property<State>(klass, row.make(row), {set, get});
  }
}

/// Adds the read-only property `stats` (GstStructure), which every element has. \p blurb lists what
/// it holds, in full sentences.
template <class State>
void add_statistics(gpointer klass, const char* blurb) {
  const auto get = [](gpointer object, GValue* value) {
    State& state = state_of<State>(object);
    if constexpr (requires { state.statistics_of(object); }) {
      g_value_take_boxed(value, state.statistics_of(object));
    } else {
      g_value_take_boxed(value, state.statistics.structure());
    }
  };
  add_property<State>(klass, statistics_property(blurb), {nullptr, get});
}

/// The element's long name, its class ("Filter/Effect/Video") and what it does.
void set_metadata(gpointer klass, const char* long_name, const char* classification,
                  const char* description);

/// Adds a pad template: always there, or on request.
void add_template(gpointer klass, const char* name, GstPadDirection direction, const char* caps,
                  GType pad_type = G_TYPE_NONE, GstPadPresence presence = GST_PAD_ALWAYS);

/// What of \p caps, whose reference it takes, \p filter (null: all) lets pass, in its order.
GstCaps* filtered(GstCaps* caps, GstCaps* filter);

}  // namespace polyhull::element
