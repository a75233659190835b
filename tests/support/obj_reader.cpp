// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/obj_reader.h"

#include <tiny_obj_loader.h>

#include <cmath>
#include <filesystem>

#include "base/error.h"

namespace polyhull {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw Error(Error::Kind::bad_input, "'{}': {}.", path, what);
}

std::size_t checked(int index, std::size_t limit, const std::string& path) {
  if (index < 0 || static_cast<std::size_t>(index) >= limit)
    fail(path, "a face refers to a vertex that is not there");
  return static_cast<std::size_t>(index);
}

}  // namespace

ObjModel read_obj(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw Error(Error::Kind::not_found, "Cannot read the OBJ file '{}'.", path);
  tinyobj::ObjReader reader;
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  if (!reader.ParseFromFile(path, config)) fail(path, "not a usable OBJ file: " + reader.Error());
  const tinyobj::attrib_t& attributes = reader.GetAttrib();
  ObjModel model;
  for (std::size_t i = 0; i + 2 < attributes.vertices.size(); i += 3) {
    const Vec3f p(attributes.vertices[i], attributes.vertices[i + 1], attributes.vertices[i + 2]);
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      fail(path, "vertex " + std::to_string(i / 3 + 1) + " is not finite");
    model.positions.push_back(p);
  }
  bool coordinates = true, normals = true;
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    const tinyobj::mesh_t& mesh = shape.mesh;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      const tinyobj::index_t& index = mesh.indices[i];
      model.triangles.push_back(
          static_cast<std::uint32_t>(checked(index.vertex_index, model.positions.size(), path)));
      coordinates = coordinates && index.texcoord_index >= 0;
      normals = normals && index.normal_index >= 0;
      if (coordinates) {
        const std::size_t t = checked(index.texcoord_index, attributes.texcoords.size() / 2, path);
        model.coordinates.emplace_back(attributes.texcoords[2 * t],
                                       attributes.texcoords[2 * t + 1]);
      }
      if (normals) {
        const std::size_t n = checked(index.normal_index, attributes.normals.size() / 3, path);
        model.normals.emplace_back(attributes.normals[3 * n], attributes.normals[3 * n + 1],
                                   attributes.normals[3 * n + 2]);
      }
    }
    for (std::size_t i = 0; i < mesh.indices.size() / 3; ++i)
      model.materials.push_back(i < mesh.material_ids.size() ? mesh.material_ids[i] : -1);
  }
  if (!coordinates) model.coordinates.clear();
  if (!normals) model.normals.clear();
  if (model.triangles.empty()) fail(path, "it has no faces");
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  for (const tinyobj::material_t& material : reader.GetMaterials())
    model.material_list.push_back(
        {material.name, Vec3f(material.diffuse[0], material.diffuse[1], material.diffuse[2]),
         material.diffuse_texname.empty() ? std::string()
                                          : (folder / material.diffuse_texname).string()});
  for (const int material : model.materials)
    if (material < -1 || material >= static_cast<int>(model.material_list.size()))
      fail(path, "a face has a material that is not there");
  return model;
}

}  // namespace polyhull
