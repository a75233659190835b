// SPDX-License-Identifier: LGPL-2.1-or-later
// Renders a take of boards as polyhull-calibrate reads it, FOLDER/CAMERA/INSTANT.jpg, to time it.
#include <cstdio>
#include <filesystem>

#include "base/thread_pool.h"
#include "command_line.h"
#include "support/calibration_takes.h"

int main(int count, char** values) {
  using namespace polyhull;
  using namespace polyhull::calibration;
  CommandLine command("calibration_pictures",
                      "Renders pictures of a board before a ring of cameras.");
  RingSettings settings;
  settings.board = {13, 8, 0.08};
  settings.instants = 80;
  settings.near_views = 25;
  std::string folder;
  command.option("folder", &folder, "Gets a folder per camera").required();
  command.option("--cameras", &settings.cameras, "How many");
  command.option("--instants", &settings.instants, "With the board somewhere on the stage");
  command.option("--near", &settings.near_views, "Views of each camera with the board near");
  if (const auto status = command.parse(count, values)) return *status;
  const TrueTake truth = make_ring(settings);
  const Picture drawing = BoardFinder({settings.board, 0.75, ""}).draw(60);
  const std::filesystem::path root(folder);
  for (const Camera& camera : truth.cameras)
    std::filesystem::create_directories(root / camera.name);
  parallel_for(truth.take.views.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const View& view = truth.take.views[v];
      const Camera& camera = truth.cameras[view.camera];
      const Picture picture =
          render_board(drawing, settings.board, truth.boards[view.instant], camera);
      save_picture(picture,
                   (root / camera.name / (truth.take.instants[view.instant] + ".jpg")).string());
    }
  });
  std::printf("%zu pictures of %zu cameras\n", truth.take.views.size(), truth.cameras.size());
  return 0;
}
