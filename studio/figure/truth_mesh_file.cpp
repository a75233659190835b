// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "base/error.h"
#include "studio/figure/subject.h"

namespace polyhull {
namespace {

template <class T>
void append(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string ply(const TruthMesh& mesh) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex " +
      std::to_string(mesh.positions.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
      std::to_string(mesh.triangles.size() / 3) +
      "\nproperty list uchar int vertex_indices\nend_header\n";
  bytes.reserve(bytes.size() + mesh.positions.size() * 27 + mesh.triangles.size() / 3 * 13);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(bytes, mesh.positions[i][k]);
    for (int k = 0; k < 3; ++k) append(bytes, mesh.normals[i][k]);
    for (int k = 0; k < 3; ++k) {
      append(bytes, static_cast<std::uint8_t>(
                        std::lround(std::clamp(mesh.colours[i][k], 0.0f, 1.0f) * 255.0f)));
    }
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    append(bytes, std::uint8_t{3});
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<std::int32_t>(mesh.triangles[t + k]));
  }
  return bytes;
}

/// Appends numbers with a point, whatever the process's locale says.
void append_numbers(std::string& text, std::initializer_list<float> values, int digits) {
  char number[48];
  for (const float value : values) {
    const auto end =
        std::to_chars(number, number + sizeof number, value, std::chars_format::general, digits);
    text += ' ';
    text.append(number, end.ptr);
  }
}

std::string obj(const TruthMesh& mesh) {
  std::string text = "# polyhull truth mesh: position and sRGB colour per vertex\n";
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3f &p = mesh.positions[i], &c = mesh.colours[i];
    text += 'v';
    append_numbers(text, {p.x, p.y, p.z}, 8);
    append_numbers(text, {c.x, c.y, c.z}, 4);
    text += '\n';
  }
  for (const Vec3f& n : mesh.normals) {
    text += "vn";
    append_numbers(text, {n.x, n.y, n.z}, 5);
    text += '\n';
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    text += 'f';
    for (int k = 0; k < 3; ++k) {
      const std::string index = std::to_string(mesh.triangles[t + k] + 1);
      text += ' ' + index + "//" + index;
    }
    text += '\n';
  }
  return text;
}

}  // namespace

void write_truth_mesh(const TruthMesh& mesh, const std::string& path) {
  const bool is_ply = path.ends_with(".ply");
  if (!is_ply && !path.ends_with(".obj")) {
    throw Error(Error::Kind::unsupported,
                "Mesh '{}' cannot be written: its name must end in .ply or .obj.", path);
  }
  const std::string bytes = is_ply ? ply(mesh) : obj(mesh);
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.flush();
  if (!file) {
    throw Error(Error::Kind::io,
                "Mesh '{}' could not be written: {}; check that the folder exists and has space.",
                path, std::strerror(errno));
  }
}

}  // namespace polyhull
