// SPDX-License-Identifier: LGPL-2.1-or-later
// Kalibr's camchain.yaml.
#include "base/error.h"
#include "rig/export.h"

namespace polyhull::exported {
namespace {

std::string lens(const Camera& camera) {
  std::vector<double> values = camera.distortion;
  while (values.size() > 4 && values.back() == 0.0) values.pop_back();
  if (values.size() > 4)
    throw Error(Error::Kind::unsupported,
                "Camera '{}' has a lens of {} coefficients; Kalibr's radtan model has k1 k2 p1 p2 "
                "alone.",
                camera.name, camera.distortion.size());
  return values.empty() ? "  distortion_model: none\n  distortion_coeffs: []\n"
                        : fmt::format(
                              "  distortion_model: radtan\n  distortion_coeffs: [{}, {}, "
                              "{}, {}]\n",
                              values[0], values[1], values[2], values[3]);
}

std::string transform(const char* name, const Mat3& R, const Vec3& t) {
  const std::array<double, 9> r = to_rows(R);
  return fmt::format(
      "  {}:\n  - [{}, {}, {}, {}]\n  - [{}, {}, {}, {}]\n  - [{}, {}, {}, {}]\n  - [0, 0, 0, 1]\n",
      name, r[0], r[1], r[2], t.x, r[3], r[4], r[5], t.y, r[6], r[7], r[8], t.z);
}

// In double quotes, as YAML and JSON write it.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    else
      result += c;
  }
  return result + '"';
}

}  // namespace

std::string kalibr(const Rig& rig) {
  std::string text;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    const std::array<double, 9> k = to_rows(camera.K);
    if (k[1] != 0.0)
      throw Error(Error::Kind::unsupported,
                  "Camera '{}' has skew (K12 is {}), for which Kalibr has no parameter.",
                  camera.name, k[1]);
    text += fmt::format("cam{}:\n  camera_model: pinhole\n  intrinsics: [{}, {}, {}, {}]\n", i,
                        k[0], k[4], k[2], k[5]);
    text += lens(camera);
    text += fmt::format("  resolution: [{}, {}]\n", camera.width, camera.height);
    text += "  rostopic: " + quoted("/" + camera.name + "/image_raw") + "\n";
    text += transform("T_cam_imu", camera.R, camera.t);
    if (i == 0) continue;
    const Camera& last = rig.cameras[i - 1];
    const Mat3 R = camera.R * glm::transpose(last.R);
    text += transform("T_cn_cnm1", R, camera.t - R * last.t);
  }
  return text;
}

}  // namespace polyhull::exported
