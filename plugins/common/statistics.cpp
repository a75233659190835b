// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/statistics.h"

#include <cstring>

#include "plugins/common/guard.h"
#include "plugins/common/log.h"

namespace polyhull::element {

Statistics::Entry& Statistics::entry(const char* name) {
  for (Entry& known : entries_) {
    if (std::strcmp(known.name, name) == 0) return known;
  }
  return entries_.emplace_back(Entry{name, std::uint64_t{0}, INT64_MIN});
}

void Statistics::declare(std::initializer_list<const char*> names) {
  const std::scoped_lock lock(mutex_);
  for (const char* name : names) entry(name);
}

void Statistics::count(const char* name, std::uint64_t amount) {
  const std::scoped_lock lock(mutex_);
  Entry& counter = entry(name);
  if (auto* value = std::get_if<std::uint64_t>(&counter.value)) *value += amount;
}

void Statistics::set(const char* name, double value) {
  const std::scoped_lock lock(mutex_);
  entry(name).value = value;
}

void Statistics::set_count(const char* name, std::uint64_t value) {
  const std::scoped_lock lock(mutex_);
  entry(name).value = value;
}

std::uint64_t Statistics::counter(const char* name) const {
  const std::scoped_lock lock(mutex_);
  for (const Entry& known : entries_) {
    if (std::strcmp(known.name, name) != 0) continue;
    const auto* value = std::get_if<std::uint64_t>(&known.value);
    return value != nullptr ? *value : 0;
  }
  return 0;
}

void Statistics::reset() {
  const std::scoped_lock lock(mutex_);
  for (Entry& known : entries_) {
    known.last_warning = INT64_MIN;
    if (std::holds_alternative<double>(known.value)) {
      known.value = 0.0;
    } else {
      known.value = std::uint64_t{0};
    }
  }
}

GstStructure* Statistics::structure() const {
  GstStructure* result = gst_structure_new_empty(structure_name_);
  const std::scoped_lock lock(mutex_);
  for (const Entry& known : entries_) {
    if (const auto* value = std::get_if<std::uint64_t>(&known.value)) {
      gst_structure_set(result, known.name, G_TYPE_UINT64, static_cast<guint64>(*value), nullptr);
    } else {
      gst_structure_set(result, known.name, G_TYPE_DOUBLE, std::get<double>(known.value), nullptr);
    }
  }
  return result;
}

void Statistics::warn(GstElement* element, const char* counter, const std::string& what) {
  const std::string text = sentence(what);
  const std::int64_t now = g_get_monotonic_time();
  bool quiet = false;
  {
    const std::scoped_lock lock(mutex_);
    Entry& known = entry(counter);
    if (auto* value = std::get_if<std::uint64_t>(&known.value)) *value += 1;
    quiet = known.last_warning != INT64_MIN && now - known.last_warning < G_USEC_PER_SEC;
    if (!quiet) known.last_warning = now;
  }
  // Posted without the lock: a bus handler may read the statistics.
  GST_CAT_WARNING_OBJECT(category_of(element), element, "%s", text.c_str());
  if (!quiet) GST_ELEMENT_WARNING(element, STREAM, FAILED, ("%s", text.c_str()), (nullptr));
}

GParamSpec* statistics_property(const char* blurb) {
  return g_param_spec_boxed("stats", "Statistics", blurb, GST_TYPE_STRUCTURE,
                            static_cast<GParamFlags>(G_PARAM_READABLE | G_PARAM_STATIC_STRINGS));
}

}  // namespace polyhull::element
