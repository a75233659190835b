// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/changes/mirror_choice.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "scene/changes/named_parts.h"
#include "scene/changes/words.h"

namespace polyhull {
namespace {

constexpr std::size_t longest_choice = 4096;

Error no_choice(std::string_view what) {
  return Error(Error::Kind::bad_input,
               "A choice of mirrors is not understood at '{}': expected names with semicolons "
               "between, as in 'floor; \"tall mirror\"' or '-window', or 'auto'.",
               what);
}

/// The names of what shows \p mirror, and of all that it hangs on.
std::set<std::string> names_of(const Mirror& mirror, const Scene& scene) {
  std::set<std::string> names;
  for (const int tile : mirror.meshes) {
    const SceneMesh& mesh = scene.meshes[static_cast<std::size_t>(tile)];
    names.insert(mesh.name);
    for (int n = mesh.node; n >= 0 && !scene.nodes.empty();
         n = scene.nodes[static_cast<std::size_t>(n)].parent)
      names.insert(scene.nodes[static_cast<std::size_t>(n)].name);
  }
  return names;
}

bool has_any(const std::set<std::string>& names, const std::vector<std::string>& wanted) {
  return std::any_of(wanted.begin(), wanted.end(),
                     [&](const std::string& name) { return names.contains(name); });
}

}  // namespace

MirrorChoice parse_mirror_choice(std::string_view text) {
  if (text.size() > longest_choice) throw no_choice(text.substr(0, 40));
  MirrorChoice choice;
  if (text == "auto") return choice;
  while (!text.empty()) {
    skip_blanks(text);
    const std::string_view entry = text.substr(0, 40);
    const bool minus = !text.empty() && text.front() == '-';
    if (minus) text.remove_prefix(1);
    const std::optional<Word> name = next_word(text);
    if ((minus && !name) || (name && name->text.empty()) || next_word(text)) throw no_choice(entry);
    if (name) (minus ? choice.left_out : choice.shown).push_back(name->text);
    if (!text.empty()) text.remove_prefix(1);  // the semicolon
  }
  return choice;
}

ChosenMirrors choose_mirrors(const MirrorChoice& choice, const Scene& scene) {
  ChosenMirrors out;
  if (choice.shown.empty() && choice.left_out.empty()) return out;
  std::set<std::string> known;
  std::vector<std::string> there;
  for (const Mirror& mirror : scene.mirrors) {
    const std::set<std::string> names = names_of(mirror, scene);
    out.left_out.push_back((!choice.shown.empty() && !has_any(names, choice.shown)) ||
                           has_any(names, choice.left_out));
    known.insert(names.begin(), names.end());
    for (const int tile : mirror.meshes) {
      const std::string& own = scene.meshes[static_cast<std::size_t>(tile)].name;
      if (std::find(there.begin(), there.end(), own) == there.end()) there.push_back(own);
    }
  }
  std::string missing;
  for (const auto& names : {choice.shown, choice.left_out})
    for (const std::string& name : names)
      if (!known.contains(name)) add_missing(missing, name);
  if (!missing.empty()) out.missing = missing_words(scene.name, "mirror", missing, there, false);
  return out;
}

}  // namespace polyhull
