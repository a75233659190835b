// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs when polyhull is built: writes the figure's skin to argv[1] as source text.
#include <cstdio>
#include <cstring>

#include "studio/figure/figure_skin.h"

namespace {

/// The bits of \p values as an array of words.
template <class Value>
void write(std::FILE* file, const char* name, const std::vector<Value>& values) {
  static_assert(sizeof(Value) % 4 == 0);
  std::vector<std::uint32_t> words(values.size() * sizeof(Value) / 4);
  std::memcpy(words.data(), values.data(), 4 * words.size());
  std::fprintf(file, "const std::uint32_t %s[] = {", name);
  for (std::size_t i = 0; i < words.size(); ++i)
    std::fprintf(file, "%s0x%x,", i % 16 == 0 ? "\n" : "", words[i]);
  std::fprintf(file, "};\n");
}

}  // namespace

int main(int count, char** arguments) {
  std::FILE* file = count == 2 ? std::fopen(arguments[1], "w") : nullptr;
  if (file == nullptr) {
    std::fprintf(stderr, "figure_skin_writer: give one file that can be written\n");
    return 2;
  }
  const polyhull::FigureSkin skin = polyhull::make_figure_skin();
  std::fprintf(file,
               "#include <cstring>\n#include \"studio/figure/figure_skin.h\"\n"
               "namespace polyhull {\nnamespace {\n"
               "template <class Value, std::size_t count>\n"
               "void read(const std::uint32_t (&words)[count], std::vector<Value>& values) {\n"
               "  values.resize(4 * count / sizeof(Value));\n"
               "  std::memcpy(values.data(), words, sizeof words);\n}\n");
  write(file, "positions", skin.positions);
  write(file, "normals", skin.normals);
  write(file, "openness", skin.openness);
  write(file, "bones", skin.bones);
  write(file, "weights", skin.weights);
  write(file, "triangles", skin.triangles);
  std::fprintf(file, "}\nFigureSkin stored_figure_skin() {\n  FigureSkin skin;\n");
  for (const char* name : {"positions", "normals", "openness", "bones", "weights", "triangles"})
    std::fprintf(file, "  read(%s, skin.%s);\n", name, name);
  std::fprintf(file, "  return skin;\n}\n}\n");
  return std::fclose(file) == 0 ? 0 : 1;
}
