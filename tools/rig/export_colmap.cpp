// SPDX-License-Identifier: LGPL-2.1-or-later
// COLMAP's text model.
#include <array>
#include <cmath>
#include <filesystem>

#include "rig/export.h"
#include "rig/file_names.h"
#include "text_file.h"

namespace polyhull::exported {
namespace {

// w x y z of a rotation, from the largest of the four, which loses no digits (Shepperd 1978).
std::array<double, 4> quaternion(const Mat3& rotation) {
  const std::array<double, 9> r = to_rows(rotation);
  const double trace = r[0] + r[4] + r[8];
  const std::array<double, 4> squares{trace, r[0], r[4], r[8]};
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i)
    if (squares[i] > squares[largest]) largest = i;
  std::array<double, 4> q{};
  const double root =
      0.5 * std::sqrt(1.0 + (largest == 0 ? trace : 2.0 * squares[largest] - trace));
  const double s = 0.25 / root;
  const double wx = s * (r[7] - r[5]), wy = s * (r[2] - r[6]), wz = s * (r[3] - r[1]);
  const double xy = s * (r[1] + r[3]), xz = s * (r[2] + r[6]), yz = s * (r[5] + r[7]);
  if (largest == 0) q = {root, wx, wy, wz};
  if (largest == 1) q = {wx, root, xy, xz};
  if (largest == 2) q = {wy, xy, root, yz};
  if (largest == 3) q = {wz, xz, yz, root};
  if (q[0] < 0.0)
    for (double& value : q) value = -value;
  return q;
}

// Model and parameters; COLMAP counts pixels from the corner of the first one, rigs from its centre.
std::string model(const Camera& camera) {
  const std::array<double, 9> k = to_rows(camera.K);
  if (k[1] != 0.0)
    throw Error(Error::Kind::unsupported,
                "Camera '{}' has skew (K12 is {}), for which COLMAP has no parameter.", camera.name,
                k[1]);
  std::vector<double> lens = camera.distortion;
  while (lens.size() > 8 && lens.back() == 0.0) lens.pop_back();
  if (lens.size() > 8)
    throw Error(Error::Kind::unsupported,
                "Camera '{}' has a thin-prism lens (s1 to s4), which COLMAP's OpenCV models do not "
                "have.",
                camera.name);
  const char* name = lens.empty() ? "PINHOLE" : lens.size() == 4 ? "OPENCV" : "FULL_OPENCV";
  if (lens.size() > 4) lens.resize(8);
  std::string text = fmt::format("{} {} {} {} {} {} {}", name, camera.width, camera.height, k[0],
                                 k[4], k[2] + 0.5, k[5] + 0.5);
  for (const double value : lens) text += fmt::format(" {}", value);
  return text;
}

}  // namespace

void colmap(const Rig& rig, const std::string& folder) {
  std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  std::string images =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as X, Y, POINT3D_ID\n";
  int id = 0;
  for (const Camera& camera : rig.cameras) {
    ++id;
    cameras += fmt::format("{} {}\n", id, model(camera));
    const auto [w, x, y, z] = quaternion(camera.R);
    images += fmt::format("{} {} {} {} {} {} {} {} {} {}.png\n\n", id, w, x, y, z, camera.t.x,
                          camera.t.y, camera.t.z, id, file_name_of(camera.name));
  }
  make_folder(folder);
  const std::filesystem::path path(folder);
  write_text(cameras, (path / "cameras.txt").string());
  write_text(images, (path / "images.txt").string());
  write_text("# no points\n", (path / "points3D.txt").string());
}

}  // namespace polyhull::exported
