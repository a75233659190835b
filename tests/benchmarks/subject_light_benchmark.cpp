// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene's light on a subject against paths: the kinds of lit_walk.h at each stop of its walk, PSNR over
// the figure's pixels in sRGB codes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "base/picture.h"
#include "base/srgb.h"
#include "command_line.h"
#include "lit_walk.h"

int main(int argc, char** argv) {
  using namespace polyhull;
  using enum synthetic::WalkKind;
  constexpr int width = 200, height = 300;
  CommandLine command("subject_light_benchmark", "The scene's light on a subject against paths");
  std::string folder;
  int paths = 256;
  command.option("--output", &folder,
                 "folder for pictures of each stop: the kinds from left to right");
  command.option("--paths", &paths, "of a pixel");
  if (const auto status = command.parse(argc, argv)) return *status;
  synthetic::LitWalk walk(width, height, static_cast<std::uint32_t>(paths));
  std::printf("%-20s | even:           | open:%19s | relit:\n", "dB against", "");
  std::printf("%-20s |%8s%8s |%8s%8s%8s |%8s%8s%8s%8s%8s%8s\n", "", "off", "shade", "off", "shade",
              "clear", "off", "shade", "form", "clear", "open", "known");
  int number = 0;
  for (const synthetic::Stop& stop : synthetic::walk_stops) {
    const synthetic::LitWalk::Shown shown = walk.at(stop, {even, open, relit});
    std::printf("%-20s", stop.name);
    const auto print = [&](synthetic::WalkKind truth,
                           std::initializer_list<synthetic::WalkKind> kinds) {
      std::printf(" |");
      for (const synthetic::WalkKind kind : kinds)
        std::printf("%8.2f", synthetic::psnr_of_codes(shown[kind], shown[truth]));
    };
    print(even, {off, shade});
    print(open, {off, shade, clear});
    print(relit, {off, shade, form, clear, open, known});
    std::printf("\n");
    std::fflush(stdout);
    if (folder.empty()) continue;
    const int kinds = static_cast<int>(shown.colours.size());
    Picture picture{kinds * width, height, 4, {}};
    picture.pixels.assign(static_cast<std::size_t>(4) * kinds * width * height, 60);
    for (int k = 0; k < kinds; ++k)
      for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
        const int x = shown.pixels[i] % width, y = shown.pixels[i] / width;
        std::uint8_t* const pixel = picture.row(y) + 4 * (k * width + x);
        for (int c = 0; c < 3; ++c)
          pixel[c] = static_cast<std::uint8_t>(std::lround(
              255.0f * srgb_encoded(std::clamp(shown.colours[static_cast<std::size_t>(k)][i][c],
                                               0.0f, 1.0f))));
        pixel[3] = 255;
      }
    save_picture(picture, folder + "/light-" + std::to_string(number++) + ".png");
  }
  return 0;
}
