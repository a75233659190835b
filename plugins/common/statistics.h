// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Counters and figures of one element, and warnings that do not flood the bus.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

namespace polyhull::element {

/// What an element reports in its read-only `stats` property. Names are in kebab-case and must last
/// as long as this is used, as string literals do; a name exists from its first use on, so declare()
/// those that should be seen at zero. After every name has been used once, nothing here allocates.
/// May be used from any thread.
class Statistics {
 public:
  /// \p structure_name: the name of the GstStructure, for example "contourfind-stats".
  explicit Statistics(const char* structure_name) : structure_name_(structure_name) {}

  /// Makes the counters \p names appear with the value 0.
  void declare(std::initializer_list<const char*> names);

  /// Adds \p amount to the counter \p name (guint64 in the structure).
  void count(const char* name, std::uint64_t amount = 1);

  /// Sets the figure \p name (double in the structure).
  void set(const char* name, double value);

  /// Sets the counter \p name.
  void set_count(const char* name, std::uint64_t value);

  /// The value of the counter \p name, 0 where it does not exist.
  std::uint64_t counter(const char* name) const;

  /// Sets all counters and figures to zero; the next warning of each counter is posted at once.
  void reset();

  /// A new structure with everything; the caller owns it.
  GstStructure* structure() const;

  /// The stream goes on, but something is wrong: adds 1 to the counter \p counter and posts a
  /// warning message on \p element with the sentence \p what, at most one per second and counter;
  /// the debug log has each.
  void warn(GstElement* element, const char* counter, const std::string& what);

 private:
  struct Entry {
    const char* name;
    std::variant<std::uint64_t, double> value;
    std::int64_t last_warning;  // monotonic microseconds
  };
  Entry& entry(const char* name);

  const char* structure_name_;
  mutable std::mutex mutex_;  // protects entries_
  std::vector<Entry> entries_;
};

/// The read-only boxed property `stats` (GstStructure) that every element has. \p blurb lists what
/// it holds, in full sentences.
GParamSpec* statistics_property(const char* blurb);

}  // namespace polyhull::element
