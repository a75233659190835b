// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/scene_buffers.h"

#include <algorithm>
#include <cstddef>
#include <set>

#include "render/projection.h"
#include "scene/scene.h"

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
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const SceneMesh& mesh = scene.meshes[m];
    const auto base = static_cast<std::uint32_t>(vertices.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      vertices.push_back(
          {mesh.positions[i], i < mesh.normals.size() ? mesh.normals[i] : Vec3f(0.0f, 1.0f, 0.0f),
           i < mesh.texture_coordinates.size() ? mesh.texture_coordinates[i] : Vec2f(0.0f)});
      points.push_back(mesh.positions[i]);
    }
    const auto last =
        static_cast<std::uint32_t>(std::max<std::size_t>(mesh.positions.size(), 1) - 1);
    const std::vector<int> mirrors = mirrors_of_triangles(scene, m);
    for (const int mirror : std::set<int>(mirrors.begin(), mirrors.end())) {
      const std::size_t first = indices.size();
      for (std::size_t i = 0; i < mirrors.size(); ++i)
        for (std::size_t k = 3 * i; mirrors[i] == mirror && k < 3 * i + 3; ++k)
          indices.push_back(base + std::min(mesh.triangles[k], last));
      parts_.push_back({static_cast<GLsizei>(indices.size() - first), first * sizeof(std::uint32_t),
                        mesh.material, mirror});
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

  load_textures(scene);
}

/// A scene that moves is another one in each frame, with the same pictures.
void SceneBuffers::load_textures(const Scene& scene) {
  textures_.resize(scene.textures.size());
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    const Picture& picture = *scene.textures[i];
    if (i < pictures_.size() && &*pictures_[i] == &picture) continue;
    textures_[i].reset();
    if (picture.channels == 4 && !picture.empty()) load_texture(textures_[i], picture);
  }
  pictures_ = scene.textures;
}

void SceneBuffers::draw() const {
  glBindVertexArray(array_.get());
  glDrawElements(GL_TRIANGLES, total_, GL_UNSIGNED_INT, nullptr);
}

void SceneBuffers::draw_with_materials(const Scene& scene, gl::Program& program, int unit) const {
  glBindVertexArray(array_.get());
  static const Material plain;
  for (const Part& part : parts_) {
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
    if (has_texture)
      gl::bind_texture(unit, GL_TEXTURE_2D, textures_[static_cast<std::size_t>(texture)].get());
    part.draw();
  }
}

void SceneBuffers::Part::draw() const {
  glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, reinterpret_cast<const void*>(first));
}

void SceneBuffers::draw_mirror(std::size_t mirror) const {
  glBindVertexArray(array_.get());
  for (const Part& part : parts_)
    if (part.mirror == static_cast<int>(mirror)) part.draw();
}

}  // namespace polyhull
