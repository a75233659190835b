// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What stands on the stage: a closed surface that moves in time, with a colour at each of its
/// points.
///
/// Colours are such that the light a point sends out is the same in all directions (a matt surface
/// under the soft light of a studio): one colour per surface point, which cameras, a truth renderer
/// and a textured hull can be compared by.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/vector.h"
#include "rig/rig.h"
#include "studio/figure/light.h"

namespace polyhull {

/// A subject at one instant. All arrays have one entry per vertex.
struct SubjectFrame {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;  ///< unit length, outward
};

class SubjectInstant;

/// A closed (unless said otherwise) triangle mesh whose vertices move. Metres, y up, standing on y
/// = 0.
class Subject {
 public:
  virtual ~Subject() = default;

  /// Three vertex indices per triangle, outside seen counter-clockwise; the same at all times.
  const std::vector<std::uint32_t>& triangles() const { return triangles_; }
  std::size_t vertex_count() const { return vertex_count_; }

  /// Of a closed surface: entry 3 t + k is the triangle beyond the side of triangle t from its
  /// corner k to the next. Found when first asked for. Safe to call from several threads.
  const std::vector<std::uint32_t>& neighbours() const;

  /// The surface at \p seconds; a function of the time alone. Safe to call from several threads.
  virtual void pose(double seconds, SubjectFrame& frame) const = 0;

  /// The subject at \p seconds. The last few instants that were asked for are kept: cameras that ask
  /// for the same share it (subject_instant.h). Safe to call from several threads.
  std::shared_ptr<const SubjectInstant> instant(double seconds) const;

  /// Diffuse albedo (linear Rec. 709) times the share of the studio's light that reaches the point,
  /// at barycentric coordinates \p at of triangle number \p triangle; detail finer than \p width
  /// metres is averaged.
  virtual Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float width) const = 0;

  /// Whether each edge joins two triangles.
  bool closed() const { return closed_; }

  /// Nearly the same subject with fewer triangles, for cameras of whose pixels each sees \p pixel
  /// metres of it; null where there is none that they could not tell from this one.
  std::shared_ptr<const Subject> coarser(float pixel) const;

  /// Empty, or what is wrong with the surface (it is not closed), in a sentence.
  const std::string& warning() const { return warning_; }

 protected:
  std::vector<std::uint32_t> triangles_;
  std::size_t vertex_count_ = 0;
  bool closed_ = true;
  std::string warning_;
  std::shared_ptr<const Subject> coarser_;
  float coarser_pixel_ = 0.0f;  ///< metres, from which coarser_ will do

 private:
  mutable std::once_flag neighbours_found_;
  mutable std::vector<std::uint32_t> neighbours_;
  mutable std::mutex instants_mutex_;
  mutable std::vector<std::shared_ptr<const SubjectInstant>> instants_;  // oldest first
};

/// The procedural figure for "" and "figure", the same with a coat of hair for "hairy" (each made
/// once per process and shared), else the subject of an OBJ file, scaled to \p height metres (0:
/// taken as metres), which turns about itself once in ten seconds. Throws Error if the file is missing, is no OBJ file or has no triangles.
std::shared_ptr<const Subject> open_subject(const std::string& name, double height = 0.0);

/// The colour (sRGB, 0..1) that a point of \p subject sends out.
Vec3f outgoing_colour(const Subject& subject, const SubjectFrame& frame, std::uint32_t triangle,
                      const Vec3f& at, float width);

/// Where a subject stands in a rig's world: rotation and scale from metres, y up, to the rig's up
/// and unit, and the place: the world's origin, or where the rig's bounds do not hold it, the
/// middle of their floor.
struct Placement {
  Mat3 linear{1.0};  ///< rotation times scale
  Vec3 origin{0.0};
  Vec3 operator()(const Vec3& X) const { return linear * X + origin; }
};
Placement placement_for(const Rig& rig);

/// The true surface in the rig's world at one instant, with colours at its vertices: what a hull, a
/// depth picture or a composite is compared with.
struct TruthMesh {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;
  std::vector<Vec3f> colours;  ///< outgoing, sRGB, 0..1
  std::vector<std::uint32_t> triangles;
};
TruthMesh truth_mesh(const Subject& subject, const Rig& rig, double seconds);

/// Writes \p mesh to \p path: binary PLY (.ply) or OBJ with colours after the positions (.obj).
/// Throws Error: unknown ending, not writable.
void write_truth_mesh(const TruthMesh& mesh, const std::string& path);

}  // namespace polyhull
