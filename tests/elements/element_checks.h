// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Checks that every element's test makes: states, documentation, messages.
#pragma once

#include <gst/gst.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "element_test.h"
#include "support/run_kind.h"

namespace polyhull::test {

/// A pipeline from a gst-launch line; fails the test where it does not parse.
inline GstElement* parse(const std::string& line) {
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(line.c_str(), &error);
  if (error != nullptr) ck_abort_msg("%s: %s", line.c_str(), error->message);
  return pipeline;
}

/// What ended a run: "" for end of stream, else the error's sentence.
inline std::string wait_for_end(GstElement* pipeline, GstClockTime timeout = 60 * GST_SECOND) {
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, timeout, static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  gst_object_unref(bus);
  if (message == nullptr) return "nothing ended within the time allowed";
  std::string result;
  if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    result = error->message;
    g_clear_error(&error);
  }
  gst_message_unref(message);
  return result;
}

/// Its element \p name, which the pipeline keeps.
inline GstElement* named(GstElement* pipeline, const std::string& name) {
  GstElement* element = gst_bin_get_by_name(GST_BIN(pipeline), name.c_str());
  fail_unless(element != nullptr, "the pipeline has no element %s", name.c_str());
  gst_object_unref(element);
  return element;
}

/// Takes \p pipeline to NULL and gives it up.
inline void stop(GstElement* pipeline) {
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

/// Runs a gst-launch line to its end and back to NULL; "" or the error's sentence.
inline std::string run_to_end(const std::string& line, GstClockTime timeout = 60 * GST_SECOND) {
  GstElement* pipeline = parse(line);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  const std::string result = wait_for_end(pipeline, timeout);
  stop(pipeline);
  return result;
}

/// Fails the test where wait_for_end() or run_to_end() gave an error's sentence.
inline void check_ended(const std::string& end) {
  fail_unless(end.empty(), "%s", end.c_str());
}

/// What scenesrc and trackstamp announce before a frame.
inline GstEvent* announcement_event(const std::string& json) {
  return gst_event_new_custom(
      GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
      gst_structure_new("polyhull-announcement", "json", G_TYPE_STRING, json.c_str(), nullptr));
}

/// Fails the test where one of \p parts is not in \p text.
inline void expect_in(const std::string& text, std::initializer_list<const char*> parts) {
  for (const char* part : parts)
    fail_unless(text.find(part) != std::string::npos, "\"%s\" is not in \"%s\"", part,
                text.c_str());
}

/// Takes a pipeline from NULL to PLAYING and back \p times times, sometimes at once and sometimes
/// after it has prerolled; ten times at most under the sanitizers, which take their time.
inline void check_states(const std::string& line, int times = 50) {
  if (sanitized()) times = std::min(times, 10);
  GstElement* pipeline = parse(line);
  for (int i = 0; i < times; ++i) {
    fail_if(gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
    if (i % 2 == 0) {
      fail_if(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND) ==
                  GST_STATE_CHANGE_FAILURE,
              "round %d", i);
    }
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_NULL),
                           GST_STATE_CHANGE_SUCCESS);
  }
  gst_object_unref(pipeline);
}

/// As docs/embedding.md says: a field of `stats` is a double by its name, else a guint64.
inline void check_statistic_types(GstElement* element) {
  if (g_object_class_find_property(G_OBJECT_GET_CLASS(element), "stats") == nullptr) return;
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  for (gint i = 0; i < gst_structure_n_fields(stats); ++i) {
    const std::string name = gst_structure_nth_field_name(stats, static_cast<guint>(i));
    bool figure = name.ends_with("-signal") || name.starts_with("memory-error") ||
                  name == "memory-trust" || name == "score" || name == "threads-used" ||
                  name == "tolerance";
    for (const char* unit : {"-ms-", "-us-", "-px-", "-mm-", "-psnr-", "-percent-"})
      figure = figure || (name + "-").find(unit) != std::string::npos;
    const GType type = gst_structure_get_field_type(stats, name.c_str());
    fail_unless(type == (figure ? G_TYPE_DOUBLE : G_TYPE_UINT64), "stats has %s as %s",
                name.c_str(), g_type_name(type));
  }
  gst_structure_free(stats);
}

/// The element says what it is and what each of its own properties does: long name, class,
/// description, author, and for every property a nick and a sentence that ends with a full stop.
inline void check_documented(const char* name) {
  GstElement* element = gst_element_factory_make(name, nullptr);
  fail_unless(element != nullptr, "there is no element %s", name);
  GstElementClass* klass = GST_ELEMENT_GET_CLASS(element);
  for (const char* key : {GST_ELEMENT_METADATA_LONGNAME, GST_ELEMENT_METADATA_KLASS,
                          GST_ELEMENT_METADATA_DESCRIPTION, GST_ELEMENT_METADATA_AUTHOR}) {
    const gchar* text = gst_element_class_get_metadata(klass, key);
    fail_unless(text != nullptr && *text != '\0', "%s has no %s", name, key);
  }
  guint count = 0;
  GParamSpec** specs = g_object_class_list_properties(G_OBJECT_GET_CLASS(element), &count);
  for (guint i = 0; i < count; ++i) {
    if (specs[i]->owner_type != G_OBJECT_TYPE(element)) continue;
    const gchar* blurb = g_param_spec_get_blurb(specs[i]);
    fail_unless(blurb != nullptr && g_str_has_suffix(blurb, "."), "%s: property %s: \"%s\"", name,
                specs[i]->name, blurb);
    GValue value = G_VALUE_INIT;
    if ((specs[i]->flags & G_PARAM_READABLE) == 0) continue;
    g_value_init(&value, specs[i]->value_type);
    g_object_get_property(G_OBJECT(element), specs[i]->name, &value);
    if ((specs[i]->flags & G_PARAM_WRITABLE) != 0) {
      fail_unless(g_param_value_defaults(specs[i], &value), "%s: %s does not start at its default",
                  name, specs[i]->name);
    }
    g_value_unset(&value);
  }
  g_free(specs);
  check_statistic_types(element);
  gst_object_unref(element);
}

/// The sentences of the warnings on \p bus, which are taken from it.
inline std::vector<std::string> warnings_on(GstBus* bus) {
  std::vector<std::string> texts;
  while (GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING)) {
    GError* found = nullptr;
    gst_message_parse_warning(message, &found, nullptr);
    texts.emplace_back(found->message);
    g_clear_error(&found);
    gst_message_unref(message);
  }
  return texts;
}

/// A counter of the element's `stats`.
inline guint64 statistic(GstElement* element, const char* field) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  guint64 value = 0;
  const gboolean found = gst_structure_get_uint64(stats, field, &value);
  gst_structure_free(stats);
  fail_unless(found, "stats has no counter %s", field);
  return value;
}

/// All of the element's `stats`, for a message.
inline std::string statistics_text(GstElement* element) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  gchar* text = gst_structure_to_string(stats);
  std::string result = text;
  g_free(text);
  gst_structure_free(stats);
  return result;
}

/// Waits until a counter of the element's `stats` is at least \p value.
inline void wait_for_statistic(GstElement* element, const char* field, guint64 value) {
  for (int i = 0; i < 6000 && statistic(element, field) < value; ++i) g_usleep(10000);
  fail_unless(statistic(element, field) >= value, "%s is %" G_GUINT64_FORMAT, field,
              statistic(element, field));
}

/// Waits for a warning on \p bus, from which those before it are taken, that has \p text.
inline void expect_warning(GstBus* bus, const char* text) {
  std::string all;
  for (int i = 0; i < 2000 && all.find(text) == std::string::npos; ++i) {
    for (const std::string& warning : warnings_on(bus)) all += warning + "\n";
    g_usleep(10000);
  }
  fail_unless(all.find(text) != std::string::npos, "\"%s\" is not in \"%s\"", text, all.c_str());
}

/// A figure of the element's `stats`.
inline double figure(GstElement* element, const char* field) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  gdouble value = 0.0;
  const gboolean found = gst_structure_get_double(stats, field, &value);
  gst_structure_free(stats);
  fail_unless(found, "stats has no figure %s", field);
  return value;
}

}  // namespace polyhull::test
