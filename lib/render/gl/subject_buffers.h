// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One placed hull on the graphics processor: geometry, the pictures of the views that colour it,
/// their occlusion maps.
#pragma once

#include <cstdint>
#include <vector>

#include "render/gl/objects/gl_objects.h"
#include "render/gl/objects/program.h"
#include "render/subject/hull_vertices.h"
#include "render/subject/view_picture.h"

namespace polyhull {

inline constexpr int view_slots = most_candidates;

/// What upload() did, for statistics.
struct UploadCounts {
  std::uint64_t pictures = 0;          ///< uploaded
  std::uint64_t pictures_skipped = 0;  ///< of views that colour nothing visible
  std::uint64_t pixels = 0;
};

class SubjectBuffers {
 public:
  /// Uploads positions and triangles for shadow maps.
  void upload_shape(const Hull& hull);

  /// Uploads what the eyes in \p eyes (mesh world coordinates; the viewport's, then the mirrored
  /// one) see, whose pixels measure \p pixel_size at depth 1, and \p levels smaller pictures of each
  /// view (subject/view_picture.h). \p all_views uploads
  /// unused pictures too (skipping off). \p soft: the first eye sees a soft edge (subject/soft_edge.h).
  UploadCounts upload_skin(const Mesh& mesh, const std::vector<Vec3>& eyes, double pixel_size,
                           int levels, bool all_views, bool soft);

  /// Uploads PlacedSubject::form for the vertices of upload_skin(); empty: none is drawn with.
  void upload_form(const std::vector<Vec3f>& form);

  /// Draws the shape; a hull_depth program is in use.
  void draw_shape() const;

  /// Draws the narrow triangles (subject/hull_vertices.h) that eye \p eye sees; sets the hull program's
  /// uniforms that belong to the mesh. Uses texture units 0, 1 and 3 and uniform block binding 0.
  void draw_skin(std::size_t eye, gl::Program& program) const;
  /// Whether eye \p eye sees wide triangles.
  bool has_wide(std::size_t eye) const;
  /// Draws them, like draw_skin(), by a program of WIDE triangles. Uses texture unit 2, too.
  void draw_wide(std::size_t eye, gl::Program& program) const;
  /// Draws the soft edge that the first eye sees, like draw_skin().
  void draw_ribbons(gl::Program& program) const;

  bool has_distortion() const { return distortion_; }
  /// Whether upload_form() has given it one, for programs of RELIT triangles.
  bool is_relit() const { return !form_.empty(); }

 private:
  void draw_range(GLint first, GLsizei count, gl::Program& program) const;
  void find_vertices(const Mesh& mesh, const std::vector<Vec3>& eyes, double pixel_size);
  void upload_pictures(const Mesh& mesh, const std::vector<int>& views, int levels,
                       UploadCounts& counts);
  void upload_maps(const Mesh& mesh);
  void upload_lists();
  void upload_flows(const Mesh& mesh, const Vec3& eye);
  void upload_views(const Mesh& mesh);

  struct Range {
    GLint first = 0;
    GLsizei count = 0;
  };
  mutable gl::VertexArray shape_array_, skin_array_;
  gl::Buffer positions_, indices_, skin_, forms_;
  mutable gl::Buffer views_;
  mutable gl::Texture lists_;
  /// Layers of one size, each with smaller ones, that become more and larger as is asked for.
  struct PictureArray {
    GLenum format, transfer, type;
    mutable gl::Texture texture{};
    int width = 0, height = 0, layers = 0, levels = 1;

    /// Makes room, and binds it to unit 0.
    void grow(int least_width, int least_height, std::size_t least_layers, int least_levels = 1);
  };
  PictureArray pictures_{GL_SRGB8_ALPHA8, GL_RGBA, GL_UNSIGNED_BYTE};
  PictureArray maps_{GL_RG16F, GL_RG, GL_HALF_FLOAT};
  PictureArray flows_{GL_RG8_SNORM, GL_RG, GL_BYTE};  // most_of_view layers for each view
  GLsizei shape_count_ = 0;
  std::vector<Range> ranges_;  // of the eyes' narrow triangles, then of the ribbons
  std::vector<Range> wide_;    // of the eyes' wide triangles
  HullDrawing drawing_;
  std::vector<Vec3f> form_;          // by vertex of it
  std::vector<std::uint32_t> half_;  // one occlusion map as two half floats per texel
  bool use_maps_ = false, distortion_ = false, soft_ = false;
  std::vector<float> rests_;  // by view, what its rim counts
  bool use_flows_ = false;
  std::vector<std::int8_t> offsets_;
  std::vector<glm::vec4> flow_shares_;  // by slot: the other's slot and its share, twice
  float depth_tolerance_ = 0.0f;
  int best_ = 2;
  float fill_range_ = 0.0f;
};

}  // namespace polyhull
