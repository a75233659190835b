// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/key_frames.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/plain_text.h"
#include "base/whole_file.h"

namespace polyhull {
namespace {

using nlohmann::json;

constexpr std::size_t most_bytes = std::size_t{16} << 20;
constexpr std::size_t most_keys = 100'000;
constexpr double farthest = 1e6;     // metres, and seconds
constexpr double least_step = 1e-6;  // seconds between key frames

constexpr std::pair<const char*, Easing> easings[] = {{"smooth", Easing::smooth},
                                                      {"linear", Easing::linear},
                                                      {"ease-in", Easing::ease_in},
                                                      {"ease-out", Easing::ease_out},
                                                      {"ease-in-out", Easing::ease_in_out}};

/// The slope, as a multiple of the mean one, with which a move of this easing begins or ends; none:
/// its neighbours say. A cubic that begins at rest and ends at 3/2 of the mean speed is the nearest
/// to an even acceleration.
std::optional<double> share_of_slope(Easing easing, bool at_end) {
  constexpr double full = 1.5;
  switch (easing) {
    case Easing::linear:
      return 1.0;
    case Easing::ease_in:
      return at_end ? full : 0.0;
    case Easing::ease_out:
      return at_end ? 0.0 : full;
    case Easing::ease_in_out:
      return 0.0;
    case Easing::smooth:
      break;
  }
  return std::nullopt;
}

/// \p slope as far as a move of the mean slope \p mean stays monotone with it.
double limited(double slope, double mean) {
  return std::clamp(slope, std::min(0.0, 3.0 * mean), std::max(0.0, 3.0 * mean));
}

// ---- the file

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw Error(Error::Kind::bad_input, "{}: {}.", where, what);
}

std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > 40) text = text.substr(0, 40) + "...";
  return text;
}

double number(const json& value, double least, double most, const std::string& where,
              const std::string& expected) {
  const double result = value.is_number() ? value.get<double>() : NAN;
  if (!(result >= least && result <= most))
    fail(where,
         fmt::format("is {}; expected {} from {:g} to {:g}", shown(value), expected, least, most));
  return result;
}

Vec3 place(const json& value, const std::string& where) {
  constexpr const char* expected = "three numbers [x, y, z], metres,";
  if (!value.is_array() || value.size() != 3)
    fail(where, fmt::format("is {}; expected {} from {:g} to {:g}", shown(value), expected,
                            -farthest, farthest));
  Vec3 result;
  for (int i = 0; i < 3; ++i)
    result[i] = number(value[static_cast<std::size_t>(i)], -farthest, farthest, where, expected);
  return result;
}

Easing easing(const json& value, const std::string& where) {
  std::string names;
  for (const auto& [name, easing] : easings) {
    if (value.is_string() && value.get_ref<const std::string&>() == name) return easing;
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", name);
  }
  fail(where, fmt::format("is {}; expected one of {}", shown(value), names));
}

void check_members(const json& object, std::initializer_list<const char*> known,
                   const std::string& where) {
  for (const auto& [name, value] : object.items()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::string names;
    for (const char* each : known)
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", each);
    fail(where, fmt::format("{} is unknown; there are {}", shown(json(name)), names));
  }
}

/// What \p value leaves out is as in \p before; null: it is the first.
KeyFrame read_key(const json& value, const KeyFrame* before, const std::string& where) {
  if (!value.is_object())
    fail(where, fmt::format("is {}; expected an object such as {{\"time\": 2, \"eye\": [0, 1.5, "
                            "3], \"target\": [0, 1, 0], \"field-of-view\": 50}}",
                            shown(value)));
  check_members(value, {"time", "eye", "target", "field-of-view", "easing", "cut"}, where);
  KeyFrame key;
  if (before) {
    key.pose = before->pose;
    key.field_of_view = before->field_of_view;
  }
  for (const char* name : {"time", "eye", "target", "field-of-view"})
    if (!value.contains(name) && (!before || std::string_view(name) == "time"))
      fail(where, fmt::format("'{}' is missing{}", name,
                              before ? "" : "; the first key frame must have it"));
  key.time = number(value["time"], 0.0, farthest, where + ".time", "seconds");
  if (const auto at = value.find("eye"); at != value.end())
    key.pose.eye = place(*at, where + ".eye");
  if (const auto at = value.find("target"); at != value.end())
    key.pose.target = place(*at, where + ".target");
  if (const auto at = value.find("field-of-view"); at != value.end())
    key.field_of_view = number(*at, 1.0, 170.0, where + ".field-of-view", "degrees");
  if (const auto at = value.find("easing"); at != value.end())
    key.easing = easing(*at, where + ".easing");
  if (const auto at = value.find("cut"); at != value.end()) {
    if (!at->is_boolean())
      fail(where + ".cut", fmt::format("is {}; expected true or false", shown(*at)));
    key.cut = at->get<bool>();
  }
  if (key.cut && value.contains("easing"))
    fail(where, "has both \"cut\" and \"easing\"; a cut has no way that could be eased");
  if (key.pose.eye == key.pose.target)
    fail(where, "eye and target are at one place; move one of them");
  if (before && !(key.time >= before->time + least_step) && !(key.cut && key.time == before->time))
    fail(where + ".time",
         fmt::format("is {:g}, that of the key frame before {:g}; times must grow (only a cut may "
                     "have the time of the one before)",
                     key.time, before->time));
  return key;
}

}  // namespace

KeyFrames::KeyFrames(std::vector<KeyFrame> keys) : keys_(std::move(keys)) {
  for (const KeyFrame& key : keys_) {
    const auto& [eye, target] = key.pose;
    values_.push_back({eye.x, eye.y, eye.z, target.x, target.y, target.z, key.field_of_view});
    const bool first = shots_.empty();
    shots_.push_back(first ? 0 : shots_.back() + key.cut);
  }
}

/// Whether something moves to the key frame \p segment from the one before.
bool KeyFrames::is_move(std::size_t segment) const {
  return segment >= 1 && segment < keys_.size() && !keys_[segment].cut;
}

/// Of the move to the key frame \p segment.
double KeyFrames::mean_slope(std::size_t segment, std::size_t value) const {
  return (values_[segment][value] - values_[segment - 1][value]) /
         (keys_[segment].time - keys_[segment - 1].time);
}

/// At the key frame \p key, of the move to \p segment, which ends or begins there.
double KeyFrames::slope_at(std::size_t key, std::size_t segment, std::size_t value) const {
  const bool at_end = key == segment;
  const double mean = mean_slope(segment, value);
  if (const auto share = share_of_slope(keys_[segment].easing, at_end)) return *share * mean;
  const std::size_t other = at_end ? segment + 1 : segment - 1;
  if (!is_move(other)) return 0.0;
  const double next = mean_slope(other, value);
  if (const auto share = share_of_slope(keys_[other].easing, !at_end))
    return limited(*share * next, mean);
  const double width = keys_[segment].time - keys_[segment - 1].time,
               next_width = keys_[other].time - keys_[other - 1].time;
  const double central = (mean * next_width + next * width) / (width + next_width);
  return limited(limited(central, mean), next);
}

KeyFrames::View KeyFrames::at(double seconds) const {
  const auto after =
      std::upper_bound(keys_.begin(), keys_.end(), seconds,
                       [](double time, const KeyFrame& key) { return time < key.time; });
  const auto next = static_cast<std::size_t>(after - keys_.begin());
  const std::size_t last = next > 0 ? next - 1 : 0;
  Values values = values_[last];
  if (next > 0 && is_move(next)) {
    const double width = keys_[next].time - keys_[last].time;
    const double u = (seconds - keys_[last].time) / width;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double from = values_[last][i], to = values_[next][i];
      if (from == to) continue;
      const double m = mean_slope(next, i), begin = slope_at(last, next, i),
                   end = slope_at(next, next, i);
      const double value =
          from +
          width * u * (begin + u * (3.0 * m - 2.0 * begin - end + u * (begin + end - 2.0 * m)));
      values[i] = std::clamp(value, std::min(from, to), std::max(from, to));
    }
  }
  return {{{values[0], values[1], values[2]}, {values[3], values[4], values[5]}},
          values[6],
          shots_[last]};
}

KeyFrames parse_key_frames(std::string_view text, const std::string& source) {
  const auto root = parse_json<json>(plain_text(std::string(text), source), source);
  if (!root.is_object() || root.value("format", json()) != "polyhull-key-frames")
    fail(source, "no key frames: expected an object with \"format\": \"polyhull-key-frames\"");
  check_members(root, {"format", "version", "description", "keys"}, source);
  if (root.value("version", json()) != 1)
    throw Error(Error::Kind::unsupported, "{}: version {}; this program reads version 1.", source,
                shown(root.value("version", json())));
  const json keys = root.value("keys", json());
  if (!keys.is_array() || keys.empty() || keys.size() > most_keys)
    fail(source + ": keys", fmt::format("expected a list of 1 to {} key frames", most_keys));
  std::vector<KeyFrame> read;
  for (std::size_t i = 0; i < keys.size(); ++i)
    read.push_back(read_key(keys[i], read.empty() ? nullptr : &read.back(),
                            fmt::format("{}: keys[{}]", source, i)));
  return KeyFrames(std::move(read));
}

KeyFrames load_key_frames(const std::string& path) {
  std::optional<std::string> text = whole_file(path, most_bytes + 1);
  if (!text)
    throw Error(Error::Kind::not_found,
                "Cannot read the key frames '{}'; check that the file exists and may be read.",
                path);
  if (text->size() > most_bytes)
    fail(path,
         fmt::format("the file has more than {} MiB; these are no key frames", most_bytes >> 20));
  return parse_key_frames(*text, path);
}

}  // namespace polyhull
