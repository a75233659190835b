// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs when polyhull is built: writes the figure's skins to argv[1] as source text.
#include <cstdio>
#include <cstring>

#include "studio/figure/figure_skin.h"

namespace {

/// The bits of \p values as an array of words, part \p name of skin number \p skin.
template <class Value>
void write(std::FILE* file, const char* name, std::size_t skin, const std::vector<Value>& values) {
  static_assert(sizeof(Value) % 4 == 0);
  std::vector<std::uint32_t> words(values.size() * sizeof(Value) / 4);
  std::memcpy(words.data(), values.data(), 4 * words.size());
  std::fprintf(file, "const std::uint32_t %s_%zu[] = {", name, skin);
  for (std::size_t i = 0; i < words.size(); ++i)
    std::fprintf(file, "%s0x%x,", i % 16 == 0 ? "\n" : "", words[i]);
  std::fprintf(file, "};\n");
}

constexpr const char* parts[] = {"positions", "normals", "openness",
                                 "bones",     "weights", "triangles"};

void write(std::FILE* file, std::size_t number, const polyhull::FigureSkin& skin) {
  write(file, parts[0], number, skin.positions);
  write(file, parts[1], number, skin.normals);
  write(file, parts[2], number, skin.openness);
  write(file, parts[3], number, skin.bones);
  write(file, parts[4], number, skin.weights);
  write(file, parts[5], number, skin.triangles);
}

}  // namespace

int main(int count, char** arguments) {
  std::FILE* file = count == 2 ? std::fopen(arguments[1], "w") : nullptr;
  if (file == nullptr) {
    std::fprintf(stderr, "figure_skin_writer: give one file that can be written\n");
    return 2;
  }
  std::fprintf(file,
               "#include <cstring>\n#include \"studio/figure/figure_skin.h\"\n"
               "namespace polyhull {\nnamespace {\n"
               "template <class Value, std::size_t count>\n"
               "void read(const std::uint32_t (&words)[count], std::vector<Value>& values) {\n"
               "  values.resize(4 * count / sizeof(Value));\n"
               "  std::memcpy(values.data(), words, sizeof words);\n}\n");
  const polyhull::FigureSkin finest = polyhull::make_figure_skin();
  write(file, 0, finest);
  for (std::size_t i = 0; i < polyhull::coarser_skins.size(); ++i)
    write(file, i + 1, polyhull::coarser_figure_skin(finest, polyhull::coarser_skins[i].triangles));
  std::fprintf(file, "}\nFigureSkin stored_figure_skin(std::size_t index) {\n  FigureSkin skin;\n");
  for (std::size_t i = 0; i <= polyhull::coarser_skins.size(); ++i)
    for (const char* name : parts)
      std::fprintf(file, "  if (index == %zu) read(%s_%zu, skin.%s);\n", i, name, i, name);
  std::fprintf(file, "  return skin;\n}\n}\n");
  return std::fclose(file) == 0 ? 0 : 1;
}
