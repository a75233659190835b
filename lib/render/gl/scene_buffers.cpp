// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/scene_buffers.h"

#include <algorithm>
#include <cstddef>

#include "render/projection.h"

namespace polyhull {
namespace {

struct SceneVertex {
  Vec3f position;
  Vec3f normal;
  Vec2f uv;
};

void load_texture(gl::Texture& texture, const Picture& picture) {
  gl::bind_texture(0, GL_TEXTURE_2D, texture.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, picture.width, picture.height, 0, GL_RGBA,
               GL_UNSIGNED_BYTE, picture.pixels.data());
  glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_REPEAT);
}

}  // namespace

void SceneBuffers::load(const Scene& scene) {
  std::vector<SceneVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Vec3f> points;
  parts_.clear();
  for (const SceneMesh& mesh : scene.meshes) {
    const auto base = static_cast<std::uint32_t>(vertices.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      vertices.push_back(
          {mesh.positions[i], i < mesh.normals.size() ? mesh.normals[i] : Vec3f(0.0f, 1.0f, 0.0f),
           i < mesh.texture_coordinates.size() ? mesh.texture_coordinates[i] : Vec2f(0.0f)});
      points.push_back(mesh.positions[i]);
    }
    parts_.push_back({static_cast<GLsizei>(mesh.triangles.size()),
                      indices.size() * sizeof(std::uint32_t), mesh.material});
    for (const std::uint32_t index : mesh.triangles) {
      indices.push_back(
          base +
          std::min<std::uint32_t>(index, static_cast<std::uint32_t>(
                                             std::max<std::size_t>(mesh.positions.size(), 1) - 1)));
    }
  }
  total_ = static_cast<GLsizei>(indices.size());
  bounds_ = bounds_of(points);

  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(SceneVertex)),
               vertices.data(), GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.get());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data(),
               GL_STATIC_DRAW);
  const auto attribute = [](GLuint index, GLint size, std::size_t offset) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, sizeof(SceneVertex),
                          reinterpret_cast<const void*>(offset));
  };
  attribute(0, 3, offsetof(SceneVertex, position));
  attribute(1, 3, offsetof(SceneVertex, normal));
  attribute(2, 2, offsetof(SceneVertex, uv));
  glBindVertexArray(0);

  textures_.clear();
  textures_.resize(scene.textures.size());
  for (std::size_t i = 0; i < scene.textures.size(); ++i)
    if (scene.textures[i].channels == 4 && !scene.textures[i].empty())
      load_texture(textures_[i], scene.textures[i]);
}

void SceneBuffers::draw() const {
  glBindVertexArray(array_.get());
  glDrawElements(GL_TRIANGLES, total_, GL_UNSIGNED_INT, nullptr);
}

void SceneBuffers::draw_with_materials(const Scene& scene, gl::Program& program, int unit,
                                       int marked) const {
  glBindVertexArray(array_.get());
  static const Material plain;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    const bool known =
        part.material >= 0 && part.material < static_cast<int>(scene.materials.size());
    const Material& material =
        known ? scene.materials[static_cast<std::size_t>(part.material)] : plain;
    const int texture = material.base_colour_texture;
    const bool has_texture = texture >= 0 && texture < static_cast<int>(textures_.size()) &&
                             textures_[static_cast<std::size_t>(texture)].made();
    program.set("base_colour", material.base_colour);
    program.set("metallic", material.metallic);
    program.set("emission", material.emission);
    program.set("mirror", material.is_mirror());
    program.set("look_up", !material.is_mirror());
    program.set("has_texture", has_texture);
    program.set("f0", material.f0());
    program.set("marked", static_cast<int>(i) == marked);
    if (has_texture)
      gl::bind_texture(unit, GL_TEXTURE_2D, textures_[static_cast<std::size_t>(texture)].get());
    glDrawElements(GL_TRIANGLES, part.count, GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(part.first));
  }
}

void SceneBuffers::draw_mesh(int mesh) const {
  if (mesh < 0 || mesh >= static_cast<int>(parts_.size())) return;
  const Part& part = parts_[static_cast<std::size_t>(mesh)];
  glBindVertexArray(array_.get());
  glDrawElements(GL_TRIANGLES, part.count, GL_UNSIGNED_INT,
                 reinterpret_cast<const void*>(part.first));
}

}  // namespace polyhull
