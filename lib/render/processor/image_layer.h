// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Image-based subjects (imagehull/image_hull.h) as one eye sees them: a ray through each pixel, and
/// where surface and background meet, or something stands before something else, one through each of
/// its samples. What the rays find becomes points to be coloured, as those of triangles.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "imagehull/image_subject.h"
#include "raster/screen_triangles.h"
#include "render/processor/skin.h"

namespace polyhull::processor {

/// A subject ready to be drawn, and what it was made ready of.
struct ReadySubject {
  Skin skin;
  std::uint64_t content = 0;
  Mat4 local_to_scene{1.0};
  SkinLight light;
  double scale = 1.0;  ///< units of the scene to a unit of the mesh
  // Of an image-based subject; else null and unused.
  std::shared_ptr<const ImageSubject> image;
  Mat4 from_scene{1.0};    ///< to the mesh's world
  std::vector<int> views;  ///< of its mesh, by the skin's slots
};

/// What decides a subject layer.
struct SubjectEye {
  std::size_t number = 0;       ///< of the eyes that the skins were prepared for
  Mat4 pixels_from_scene{1.0};  ///< homogeneous
  Facing facing = Facing::clockwise;
  std::optional<Vec4> kept;  ///< only what is on this plane's positive side, scene coordinates
};

/// The views of an image-based subject that \p eyes (mesh world coordinates) may take colours from:
/// where the viewing angle decides, for each eye those nearest to it as seen from the subject's middle,
/// more than are blended at any point; else all.
std::vector<int> views_for(const Mesh& mesh, const std::vector<Vec3>& eyes);

class ImageLayer {
 public:
  /// A thread's working memory: by sample, as SampleRows::id, who is seen.
  struct Scratch {
    struct Seen {
      std::uint32_t subject, face;
    };
    std::vector<Seen> seen;
    ImageHull::Scratch hull;
    ImageHull::Bundle bundle;
  };

  /// The subjects are now those that are image-based of \p subjects, on a screen of width x height.
  void fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
            int height);

  /// What of band \p band subjects may touch.
  Rectangle painted(int band) const;

  /// Draws what is nearer than what \p rows has: its inverse depth is written, and its id becomes no
  /// triangle's. find_items() takes packed rows.
  void draw(const std::vector<ReadySubject>& subjects, const SampleRows& rows,
            Scratch& scratch) const;

  /// Adds what draw() has found to its subjects' \p items: of a pixel one for each surface in it.
  void find_items(const std::vector<ReadySubject>& subjects, const SampleRows& rows,
                  const Scratch& scratch, std::vector<SkinItems>& items) const;

 private:
  /// A subject as the eye sees it. Directions have length 1 along the eye's axis, in units of the scene.
  struct Sight {
    std::uint32_t subject = 0;
    Rectangle part;  // of the screen that it may touch
    ImageHull::Origin origin;
    Vec3f place{0.0f};           // of the eye, local coordinates
    Vec3f first, x, y;           // the direction through (0, 0), and its change with x and y
    bool cut = false;            // only what is on the kept plane's positive side
    float kept = 0.0f;           // how far on its positive side the eye lies, and
    Vec3f kept_change{0.0f};     // by how much that grows along first, x and y
    std::vector<Vec3f> centres;  // of the cameras by slot, local coordinates
    Vec3f way(float column, float row) const { return first + column * x + row * y; }
    float near(float column, float row) const;
  };
  struct Block;
  void look(const ImageHull& hull, const Sight& sight, const Block& block, Scratch& scratch,
            ImageHull::Hits& hits) const;
  void draw_block(const ImageHull& hull, const Sight& sight, int left, int top,
                  const SampleRows& rows, Scratch& scratch) const;
  static void put(const Sight& sight, const SampleRows& rows, int left, int top, int sample,
                  const ImageHull::Hits& hits, Scratch& scratch);
  static void add_item(const ReadySubject& subject, const Sight& sight, float column, float row,
                       float inverse, std::uint32_t face, float share, std::uint32_t pixel,
                       SkinItems& items);

  std::vector<Sight> sights_;
};

}  // namespace polyhull::processor
