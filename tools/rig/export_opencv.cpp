// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenCV's FileStorage files, YAML.
#include <filesystem>
#include <span>

#include "rig/export.h"
#include "rig/file_names.h"
#include "text_file.h"

namespace polyhull::exported {
namespace {

// Always with an exponent: FileStorage reads what looks like a whole number as an int.
std::string matrix_text(const char* name, int rows, std::span<const double> values) {
  std::string data;
  for (const double value : values)
    data += fmt::format("{}{:.16e}", data.empty() ? "" : ", ", value);
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
                     name, rows, values.size() / static_cast<std::size_t>(rows), data);
}

std::string text_of(const Camera& camera) {
  std::string text = fmt::format("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n",
                                 camera.width, camera.height);
  text += matrix_text("camera_matrix", 3, to_rows(camera.K));
  if (!camera.distortion.empty())
    text += matrix_text("distortion_coefficients", 1, camera.distortion);
  text += matrix_text("R", 3, to_rows(camera.R));
  text += matrix_text("T", 3, std::array{camera.t.x, camera.t.y, camera.t.z});
  return text;
}

}  // namespace

void opencv(const Rig& rig, const std::string& folder) {
  make_folder(folder);
  for (const Camera& camera : rig.cameras)
    write_text(text_of(camera),
               (std::filesystem::path(folder) / (file_name_of(camera.name) + ".yml")).string());
}

}  // namespace polyhull::exported
