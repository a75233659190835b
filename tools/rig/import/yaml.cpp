// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/import/yaml.h"

#include <fmt/core.h>

#include <cmath>

namespace polyhull::import {
namespace {

constexpr std::size_t longest = std::size_t{2} << 20, deepest = 12;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return out + '"';
}

void append_json(const YAML::Node& node, std::size_t depth, std::string& out) {
  const auto fail = [&](const char* what) { throw YAML::ParserException(node.Mark(), what); };
  if (depth > deepest || out.size() > longest) fail("too many lists within each other");
  const bool list = node.IsSequence();
  if (!list && !node.IsMap()) {
    double value = NAN;
    const bool number = node.IsScalar() && YAML::convert<double>::decode(node, value);
    out += number && std::isfinite(value) ? fmt::format("{}", value)
                                          : quoted(node.IsScalar() ? node.Scalar() : "");
    return;
  }
  out += list ? '[' : '{';
  if (node.Tag().ends_with("opencv-matrix")) out += "\"type_id\": \"opencv-matrix\",";
  for (auto item = node.begin(); item != node.end(); ++item) {
    if (!list && !item->first.IsScalar()) fail("a key that is no word");
    if (!list) out += quoted(item->first.Scalar()) + ": ";
    append_json(list ? YAML::Node(*item) : item->second, depth + 1, out);
    out += ",\n";
  }
  if (out.ends_with(",\n")) out.resize(out.size() - 2);
  if (out.back() == ',') out.pop_back();  // of a matrix without anything
  out += list ? ']' : '}';
}

}  // namespace

YAML::Node parse_yaml(std::string text) {
  if (text.starts_with("%YAML")) text[0] = '#';
  return YAML::Load(text);
}

std::string json_of_yaml(const YAML::Node& root) {
  std::string out;
  append_json(root, 0, out);
  return out;
}

}  // namespace polyhull::import
