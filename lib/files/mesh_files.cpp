// SPDX-License-Identifier: LGPL-2.1-or-later
#include "files/mesh_files.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "base/error.h"
#include "files/mesh_files_internal.h"

namespace polyhull {
namespace {

std::string ending(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

template <class T>
void append(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void write_whole_file(const std::string& path, std::string_view content) {
  const std::string part = fmt::format("{}.part{}", path, getpid());
  const auto fail = [&](const char* what) {
    const std::string reason = std::strerror(errno);
    std::remove(part.c_str());
    throw Error(Error::Kind::io,
                "Cannot {} '{}': {}; check that the folder exists, may be written and has space.",
                what, path, reason);
  };
  std::FILE* file = std::fopen(part.c_str(), "wb");
  if (!file) fail("write");
  const bool written = std::fwrite(content.data(), 1, content.size(), file) == content.size();
  const int reason = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) errno = reason;
  if (!written || !closed) fail("write");
  if (std::rename(part.c_str(), path.c_str()) != 0) fail("replace");
}

void write_ply(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  static_assert(std::endian::native == std::endian::little);
  const Hull& hull = mesh.hull;
  const char* type = options.double_precision ? "double" : "float";
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment polyhull visual hull\n"
      "comment metres per unit {:.17g}\ncomment up {:.17g} {:.17g} {:.17g}\n"
      "element vertex {}\nproperty {type} x\nproperty {type} y\nproperty {type} z\n"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      mesh.metres_per_unit, mesh.up.x, mesh.up.y, mesh.up.z, hull.vertices.size(),
      hull.triangles.size() / 3, fmt::arg("type", type));
  out.reserve(out.size() + 24 * hull.vertices.size() + 13 * hull.triangles.size() / 3);
  for (const Vec3f& vertex : hull.vertices) {
    const Vec3 world = hull.origin + Vec3(vertex);
    for (int axis = 0; axis < 3; ++axis) {
      if (options.double_precision)
        append(out, world[axis]);
      else
        append(out, static_cast<float>(world[axis]));
    }
  }
  for (std::size_t i = 0; i + 2 < hull.triangles.size(); i += 3) {
    out.push_back(3);
    for (int corner = 0; corner < 3; ++corner) append(out, hull.triangles[i + corner]);
  }
  write_whole_file(path, out);
}

bool is_mesh_file_name(const std::string& path) {
  const std::string extension = ending(path);
  return extension == ".glb" || extension == ".ply" || extension == ".obj";
}

void write_mesh_file(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  const std::string extension = ending(path);
  if (extension == ".glb")
    write_glb(mesh, path, options);
  else if (extension == ".ply")
    write_ply(mesh, path, options);
  else if (extension == ".obj")
    write_obj(mesh, path, options);
  else
    throw Error(Error::Kind::unsupported,
                "'{}' has an ending this program cannot write; use .glb, .ply or .obj.", path);
}

}  // namespace polyhull
