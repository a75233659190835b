// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene's geometry, materials and textures on the graphics processor.
#pragma once

#include <vector>

#include "render/gl/objects/gl_objects.h"
#include "render/gl/objects/program.h"
#include "scene/scene.h"

namespace polyhull {

class SceneBuffers {
 public:
  /// Uploads \p scene.
  void load(const Scene& scene);

  const Bounds& bounds() const { return bounds_; }

  /// All triangles in one call; the program is in use.
  void draw() const;

  /// Mesh by mesh with its material's uniforms (shaders/material.glsl), the texture on unit
  /// \p unit.
  void draw_with_materials(const Scene& scene, gl::Program& program, int unit) const;

  /// One of Scene::mirrors alone.
  void draw_mirror(std::size_t mirror) const;

 private:
  void load_textures(const Scene& scene);
  /// What of a mesh lies in one mirror, or in none.
  struct Part {
    GLsizei count = 0;
    std::size_t first = 0;  // byte offset of its indices
    int material = 0;
    int mirror = -1;
    void draw() const;
  };
  mutable gl::VertexArray array_;
  gl::Buffer vertices_;
  gl::Buffer indices_;
  mutable std::vector<gl::Texture> textures_;
  std::vector<SharedPicture> pictures_;  // theirs, held so that no others take their addresses
  std::vector<Part> parts_;
  GLsizei total_ = 0;
  Bounds bounds_;
};

}  // namespace polyhull
