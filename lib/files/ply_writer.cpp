// SPDX-License-Identifier: LGPL-2.1-or-later
#include <bit>

#include "base/error.h"
#include "files/mesh_files_internal.h"

namespace polyhull {
namespace {

template <class T>
void append_bytes(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

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
        append_bytes(out, world[axis]);
      else
        append_bytes(out, static_cast<float>(world[axis]));
    }
  }
  for (std::size_t i = 0; i + 2 < hull.triangles.size(); i += 3) {
    out.push_back(3);
    for (int corner = 0; corner < 3; ++corner) append_bytes(out, hull.triangles[i + corner]);
  }
  write_whole_file(path, out);
}

}  // namespace polyhull
