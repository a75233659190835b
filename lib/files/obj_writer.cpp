// SPDX-License-Identifier: LGPL-2.1-or-later
#include <charconv>
#include <filesystem>

#include "base/content_hash.h"
#include "base/error.h"
#include "files/mesh_files_internal.h"
#include "files/textured_parts.h"

namespace polyhull {
namespace {

/// As few digits as tell \p value from its neighbours, and no exponent: plain readers know none.
template <typename Number>
void append(std::string& out, Number value) {
  char text[400];  // the largest double has 309 digits, the smallest some 340
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr;
  out.append(text, end);
}

template <typename Vector>
void append_line(std::string& out, const char* keyword, const Vector& numbers) {
  out += keyword;
  for (int k = 0; k < numbers.length(); ++k) {
    out += ' ';
    append(out, numbers[k]);
  }
  out += '\n';
}

void append_vertices(std::string& out, const std::vector<Vec3f>& positions,
                     const std::vector<Vec3f>& normals, const Vec3& origin) {
  for (const Vec3f& position : positions) append_line(out, "v", origin + Vec3(position));
  for (const Vec3f& normal : normals) append_line(out, "vn", normal);
}

/// The numbers that the next vertex, texture coordinates and normal will have; 0 for one that these
/// triangles do not have.
struct FirstNumbers {
  std::size_t vertex = 1, coordinates = 0, normal = 0;
};

void append_faces(std::string& out, const std::vector<std::uint32_t>& triangles,
                  const FirstNumbers& first) {
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    out += i % 3 == 0 ? "f " : " ";
    out += std::to_string(triangles[i] + first.vertex);
    if (first.coordinates > 0) out += "/" + std::to_string(triangles[i] + first.coordinates);
    if (first.normal > 0)
      out += (first.coordinates > 0 ? "/" : "//") + std::to_string(triangles[i] + first.normal);
    if (i % 3 == 2) out += '\n';
  }
}

/// What a reader has to know of the rig's world where it is not what most take it for.
std::string world_comment(const Mesh& mesh) {
  if (mesh.metres_per_unit == 1.0 && mesh.up == Vec3(0.0, 1.0, 0.0)) return "";
  std::string out = "# metres per unit ";
  append(out, mesh.metres_per_unit);
  out += '\n';
  append_line(out, "# up", mesh.up);
  return out;
}

std::string word(const std::string& name) {
  std::string result;
  for (const char c : name) result += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return result;
}

std::string material(const std::string& name, const Vec3f& colour, const std::string& picture) {
  std::string out = "newmtl " + name + "\nKa 0 0 0\nKs 0 0 0\nillum 1\n";
  append_line(out, "Kd", colour);
  if (!picture.empty()) out += "map_Kd " + picture + "\n";
  return out;
}

/// What the names of the files beside \p path begin with. OBJ files name them, and plain readers cut
/// there at blanks, take what follows # for a comment and a - at the front for an option. Where the
/// file's own name cannot stand, a few digits tell its files from those of another ("my hull.obj"
/// from "my_hull.obj", "hull.OBJ" from "hull.obj").
std::string plain_stem(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  std::string plain = stem;
  for (char& c : plain)
    if (static_cast<unsigned char>(c) <= ' ' || c == '#' || c == 127) c = '_';
  if (plain.starts_with('-')) plain[0] = '_';
  if (plain == stem && path.extension() == ".obj") return plain;
  ContentHash hash;
  const std::string name = path.filename().string();
  hash.add_bytes(name.data(), name.size());
  return fmt::format("{}-{:06x}", plain, hash.value() >> 40);
}

}  // namespace

void write_obj(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  std::string out = "# polyhull visual hull\n" + world_comment(mesh) + "o hull\n";
  if (!mesh.texturing || !options.textured) {
    append_vertices(out, mesh.hull.vertices, mesh.hull.normals, mesh.hull.origin);
    append_faces(out, mesh.hull.triangles, {1, 0, mesh.hull.normals.empty() ? 0u : 1u});
    write_whole_file(path, out);
    return;
  }
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const std::string stem = plain_stem(path), library = stem + ".mtl";
  out += "mtllib " + library + "\n";
  std::string materials;
  FirstNumbers next{1, 1, 1};
  for (const TexturedPart& part : textured_parts(mesh)) {
    std::string name = "unseen";
    if (part.view >= 0) {
      const View& view = mesh.views[part.view].view;
      name = std::to_string(part.view) + "_" + word(view.camera);
      const std::string picture = stem + "-" + name + ".png";
      const std::vector<std::uint8_t> encoded = encode_png(texture_picture(mesh, part.view));
      write_whole_file((folder / picture).string(),
                       {reinterpret_cast<const char*>(encoded.data()), encoded.size()});
      materials += material(name, Vec3f(1.0f), picture);
    } else {
      materials += material(name, mesh.texturing->untextured, "");
    }
    append_vertices(out, part.positions, part.normals, mesh.hull.origin);
    for (const Vec2f& coordinates : part.coordinates)  // OBJ counts upwards
      append_line(out, "vt", Vec2f(coordinates.x, 1.0f - coordinates.y));
    out += "usemtl " + name + "\n";
    append_faces(out, part.triangles,
                 {next.vertex, part.coordinates.empty() ? 0 : next.coordinates,
                  part.normals.empty() ? 0 : next.normal});
    next.vertex += part.positions.size();
    next.coordinates += part.coordinates.size();
    next.normal += part.normals.size();
  }
  write_whole_file((folder / library).string(), materials);
  write_whole_file(path, out);
}

}  // namespace polyhull
