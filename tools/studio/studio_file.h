// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A studio file (docs/studio.md): the settings of a pipeline's elements, by element and by camera.
#pragma once

#include <gst/gst.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace polyhull {

class StudioFile {
 public:
  /// Reads a file's text; \p source names it in messages. Throws Error (bad_input) for what is not
  /// JSON (line and column) or nested too deeply, of another format or version, or not laid out as a studio file (the key).
  static StudioFile parse(const std::string& text, const std::string& source);

  /// What apply() found.
  struct Report {
    std::vector<std::string> problems;       ///< unknown properties, wrong types and ranges
    std::vector<std::string> without_taker;  ///< keys, elements and cameras that are not there
  };

  /// Sets what the file holds on the elements of \p pipeline, wrong values left out, and keeps in
  /// mind how all settings then are.
  Report apply(GstBin* pipeline);

  /// Takes back what the elements' settings are now: those that the file holds, and those that have
  /// changed since apply(). What has no taker stays as it is. Returns the settings that a file cannot
  /// hold (property_json()) and that are left as the file has them, as "ELEMENT.PROPERTY".
  std::vector<std::string> read_back(GstBin* pipeline);

  /// The file's text, indented.
  std::string text() const;

 private:
  using Json = nlohmann::ordered_json;
  /// By property; nothing for what a file cannot hold.
  using Settings = std::map<std::string, std::optional<Json>>;

  static Settings settings_of(GstElement* element);
  void apply_to(GstElement* element, const std::string& where, const Json& properties,
                Report& report) const;

  Json file_;
  std::string source_;
  std::map<std::string, Settings> applied_;  // by element
};

}  // namespace polyhull
