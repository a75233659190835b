// SPDX-License-Identifier: LGPL-2.1-or-later
#include <charconv>
#include <filesystem>

#include "files/mesh_files_internal.h"
#include "files/textured_parts.h"

namespace polyhull {
namespace {

void append(std::string& out, double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  out.append(text, end);
}

void append_vertices(std::string& out, const std::vector<Vec3f>& positions, const Vec3& origin) {
  for (const Vec3f& position : positions) {
    const Vec3 world = origin + Vec3(position);
    out += "v ";
    append(out, world.x);
    out += ' ';
    append(out, world.y);
    out += ' ';
    append(out, world.z);
    out += '\n';
  }
}

void append_faces(std::string& out, const std::vector<std::uint32_t>& triangles,
                  std::size_t first_vertex, std::size_t first_coordinate) {
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    out += i % 3 == 0 ? "f " : " ";
    out += std::to_string(triangles[i] + first_vertex);
    if (first_coordinate > 0) out += "/" + std::to_string(triangles[i] + first_coordinate);
    if (i % 3 == 2) out += '\n';
  }
}

/// What a reader has to know of the rig's world where it is not what most take it for.
std::string world_comment(const Mesh& mesh) {
  if (mesh.metres_per_unit == 1.0 && mesh.up == Vec3(0.0, 1.0, 0.0)) return "";
  std::string out = "# metres per unit ";
  append(out, mesh.metres_per_unit);
  out += "\n# up";
  for (int axis = 0; axis < 3; ++axis) {
    out += ' ';
    append(out, mesh.up[axis]);
  }
  return out + "\n";
}

std::string word(const std::string& name) {
  std::string result;
  for (const char c : name) result += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return result;
}

std::string material(const std::string& name, const Vec3f& colour, const std::string& picture) {
  std::string out = "newmtl " + name + "\nKa 0 0 0\nKs 0 0 0\nillum 1\nKd ";
  append(out, colour.x);
  out += ' ';
  append(out, colour.y);
  out += ' ';
  append(out, colour.z);
  out += '\n';
  if (!picture.empty()) out += "map_Kd " + picture + "\n";
  return out;
}

}  // namespace

void write_obj(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  std::string out = "# polyhull visual hull\n" + world_comment(mesh) + "o hull\n";
  if (!mesh.texturing || !options.textured) {
    append_vertices(out, mesh.hull.vertices, mesh.hull.origin);
    append_faces(out, mesh.hull.triangles, 1, 0);
    write_whole_file(path, out);
    return;
  }
  const std::filesystem::path stem = std::filesystem::path(path).replace_extension();
  // Names in the files must hold no space: readers cut there.
  const std::string library = stem.filename().string() + ".mtl";
  out += "mtllib " + library + "\n";
  std::string materials;
  std::size_t first_vertex = 1, first_coordinate = 1;
  for (const TexturedPart& part : textured_parts(mesh)) {
    std::string name = "unseen";
    if (part.view >= 0) {
      const View& view = mesh.views[part.view].view;
      name = std::to_string(part.view) + "_" + word(view.camera);
      const std::string picture = stem.filename().string() + "-" + name + ".png";
      const std::vector<std::uint8_t> encoded = encode_png(texture_picture(mesh, part.view));
      write_whole_file((stem.parent_path() / picture).string(),
                       {reinterpret_cast<const char*>(encoded.data()), encoded.size()});
      materials += material(name, Vec3f(1.0f), picture);
    } else {
      materials += material(name, mesh.texturing->untextured, "");
    }
    append_vertices(out, part.positions, mesh.hull.origin);
    for (const Vec2f& coordinate : part.coordinates) {
      out += "vt ";
      append(out, coordinate.x);
      out += ' ';
      append(out, 1.0 - coordinate.y);  // OBJ counts upwards
      out += '\n';
    }
    out += "usemtl " + name + "\n";
    append_faces(out, part.triangles, first_vertex, part.view >= 0 ? first_coordinate : 0);
    first_vertex += part.positions.size();
    first_coordinate += part.coordinates.size();
  }
  write_whole_file(std::filesystem::path(stem).concat(".mtl").string(), materials);
  write_whole_file(path, out);
}

}  // namespace polyhull
