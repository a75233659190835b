// SPDX-License-Identifier: LGPL-2.1-or-later
// Changes of lights and nodes as people write them.

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "scene/changes/scene_changes.h"
#include "scene/changes/words.h"

namespace polyhull {
namespace {

constexpr float most_given = 1e6f;
constexpr float most_repeated = 1e12f;      // what words that stand there again and again come to
constexpr std::size_t longest_text = 4096;  // as an announcement's names

Error not_understood(std::string_view what, const char* expected) {
  return Error(Error::Kind::bad_input,
               "Changes of a scene are not understood at '{}': expected {}, as in 'lamp "
               "move=0,-0.2,0 turn=0,90,0; \"key light\" move=1,0,0'.",
               what, expected);
}

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

}  // namespace

void skip_blanks(std::string_view& rest) {
  while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
}

std::optional<Word> next_word(std::string_view& rest) {
  skip_blanks(rest);
  if (rest.empty() || rest.front() == ';') return {};
  Word word;
  if (const char quote = rest.front(); quote == '"' || quote == '\'') {
    const std::size_t end = rest.find(quote, 1);
    if (end == rest.npos) throw not_understood(rest, "a quotation mark behind the name");
    word = {std::string(rest.substr(1, end - 1)), true};
    rest.remove_prefix(end + 1);
    return word;
  }
  std::size_t end = 0;
  while (end < rest.size() && !is_space(rest[end]) && rest[end] != ';') ++end;
  word.text = rest.substr(0, end);
  rest.remove_prefix(end);
  return word;
}

namespace {

/// \p count numbers with commas between, each from \p least to \p most; none: they are not.
std::optional<Vec3f> numbers_of(std::string_view text, int count, float least, float most) {
  Vec3f out(0.0f);
  for (int k = 0; k < count; ++k) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out[k]);
    if (error != std::errc() || !(out[k] >= least && out[k] <= most)) return {};
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (k + 1 == count) break;
    if (text.empty() || text.front() != ',') return {};
    text.remove_prefix(1);
  }
  return text.empty() ? std::optional(out) : std::nullopt;
}

/// NAME=VALUE in an entry.
struct Setting {
  const std::string& word;
  std::string name, value;

  explicit Setting(const std::string& text) : word(text) {
    const std::size_t equals = text.find('=');
    name = text.substr(0, equals);
    if (equals != text.npos) value = text.substr(equals + 1);
  }
  Vec3f numbers(int count, float least, float most, const char* expected) const {
    const std::optional<Vec3f> read = numbers_of(value, count, least, most);
    if (!read) throw not_understood(word, expected);
    return *read;
  }
  /// What lights and nodes have alike; false: it is something else.
  bool take_motion(Vec3f& move, Vec3f& turn) const {
    if (name == "move")
      move = numbers(3, -most_given, most_given, "move=X,Y,Z in metres, each from -1e6 to 1e6");
    else if (name == "turn")
      turn = numbers(3, -most_given, most_given, "turn=X,Y,Z in degrees, each from -1e6 to 1e6");
    else
      return false;
    return true;
  }
};

void take(const Setting& setting, LightChange& change) {
  if (setting.take_motion(change.move, change.turn)) return;
  if (setting.name == "intensity")
    change.intensity = std::min(
        change.intensity * setting.numbers(1, 0.0f, most_given, "intensity=FACTOR from 0 to 1e6").x,
        most_repeated);
  else if (setting.name == "colour")
    change.colour =
        setting.numbers(3, 0.0f, most_given, "colour=RED,GREEN,BLUE, each from 0 to 1e6");
  else if (setting.name == "size")
    change.size = std::clamp(
        change.size * setting.numbers(1, 0.001f, 1000.0f, "size=FACTOR from 0.001 to 1000").x,
        1.0f / most_repeated, most_repeated);
  else
    throw not_understood(setting.word, "one of intensity=, colour=, move=, turn= and size=");
}

void take(const Setting& setting, NodeChange& change) {
  if (setting.take_motion(change.move, change.turn)) return;
  if (setting.name == "scale") {
    change.scale = std::clamp(
        change.scale * setting.numbers(1, 0.001f, 1000.0f, "scale=FACTOR from 0.001 to 1000").x,
        0.001f, 1000.0f);
  } else if (setting.name == "visible") {
    change.visible = setting.value == "yes" || setting.value == "true";
    if (!*change.visible && setting.value != "no" && setting.value != "false")
      throw not_understood(setting.word, "visible=yes or visible=no");
  } else {
    throw not_understood(setting.word, "one of move=, turn=, scale= and visible=");
  }
}

/// The entries of \p text: who is meant goes to name(), which gives what the settings go to.
template <class Name>
void read_entries(std::string_view text, const Name& name) {
  if (text.size() > longest_text) throw not_understood(text.substr(0, 40), "at most 4096 bytes");
  while (!text.empty()) {
    if (const std::optional<Word> who = next_word(text)) {
      if (!who->quoted && who->text.find('=') != std::string::npos)
        throw not_understood(who->text, "a name first");
      auto& change = name(*who);
      while (const std::optional<Word> word = next_word(text)) take(Setting(word->text), change);
    }
    if (!text.empty()) text.remove_prefix(1);  // the semicolon
  }
}

}  // namespace

std::vector<LightChange> parse_light_changes(std::string_view text) {
  std::vector<LightChange> changes;
  read_entries(text, [&](const Word& who) -> LightChange& {
    LightChange& change = changes.emplace_back();
    change.light = who.text;
    change.quoted = who.quoted;
    return change;
  });
  return changes;
}

std::vector<NodeChange> parse_node_changes(std::string_view text) {
  std::vector<NodeChange> changes;
  read_entries(text, [&](const Word& who) -> NodeChange& {
    changes.emplace_back().node = who.text;
    return changes.back();
  });
  return changes;
}

}  // namespace polyhull
