// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any line as settings that a client sends for an element, which has properties of
// each kind that elements have. What may not be set stays as it is, and values stay in their ranges.
#include <gst/gst.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include "base/error.h"
#include "plugins/viewserversink/remote_settings.h"

namespace {

constexpr auto live = static_cast<GParamFlags>(G_PARAM_READWRITE | GST_PARAM_MUTABLE_PLAYING);

enum Id : guint { number = 1, real, flag, whole, format, fraction, polygon, location, size };

struct Keyer {
  GstElement parent;
};
struct KeyerClass {
  GstElementClass parent;
};

G_DEFINE_TYPE(Keyer, keyer, GST_TYPE_ELEMENT)

void set(GObject*, guint id, const GValue* value, GParamSpec*) {
  switch (id) {
    case number:
      if (std::abs(g_value_get_int(value)) > 5) std::abort();
      break;
    case real:
      if (!(g_value_get_double(value) >= 0.0 && g_value_get_double(value) <= 1.0)) std::abort();
      break;
    case fraction:
      if (gst_value_get_fraction_denominator(value) == 0) std::abort();
      break;
    case location:
    case size:
      std::abort();
    default:
      break;
  }
}

void keyer_class_init(KeyerClass* klass) {
  GObjectClass* object = G_OBJECT_CLASS(klass);
  object->set_property = set;
  const auto add = [&](guint id, GParamSpec* spec) {
    g_object_class_install_property(object, id, spec);
  };
  add(number, g_param_spec_int("number", "", "", -5, 5, 0, live));
  add(real, g_param_spec_double("real", "", "", 0.0, 1.0, 0.0, live));
  add(flag, g_param_spec_boolean("flag", "", "", FALSE, live));
  add(whole, g_param_spec_uint64("whole", "", "", 0, 1000, 0, live));
  add(format, g_param_spec_enum("format", "", "", GST_TYPE_FORMAT, GST_FORMAT_TIME, live));
  add(fraction, gst_param_spec_fraction("fraction", "", "", 0, 1, 1000, 1, 1, 1, live));
  add(polygon, g_param_spec_string("inside-polygon", "", "", "", live));
  add(location, g_param_spec_string("location", "", "", "", live));
  add(size, g_param_spec_int("size", "", "", 0, 5, 0, G_PARAM_READWRITE));
}

void keyer_init(Keyer*) {}

GstElement* pipeline = nullptr;
GstElement* sink = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  gst_init(count, arguments);
  gst_debug_set_default_threshold(GST_LEVEL_NONE);
  g_log_set_default_handler([](const gchar*, GLogLevelFlags, const gchar*, gpointer) {}, nullptr);
  pipeline = gst_pipeline_new(nullptr);
  for (const char* each : {"keyer", "sink"}) {
    auto* element = static_cast<GstElement*>(g_object_new(keyer_get_type(), "name", each, nullptr));
    gst_bin_add(GST_BIN(pipeline), element);
    sink = element;
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t count) {
  using namespace polyhull;
  std::string line(reinterpret_cast<const char*>(data), count);
  line = line.substr(0, line.find('\0'));  // as lines end there, too
  try {
    element::apply_remote_settings(sink, "keyer", line);
  } catch (const Error&) {
  }
  g_autofree gchar* called = gst_object_get_name(GST_OBJECT(sink));
  if (std::strcmp(called, "sink") != 0) std::abort();
  return 0;
}
