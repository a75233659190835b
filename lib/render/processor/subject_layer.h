// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The subjects as one eye sees them, the viewport's own or the one that a mirror makes: their triangles
/// on the screen, hidden by the scene sample by sample, each coloured once per pixel.
#pragma once

#include <optional>
#include <vector>

#include "raster/screen_triangles.h"
#include "render/depth_picture.h"
#include "render/frame.h"
#include "render/processor/image_layer.h"
#include "render/processor/scene/scene_layer.h"
#include "render/processor/skin.h"

namespace polyhull::processor {

class SubjectLayer {
 public:
  /// A thread's working memory.
  struct Scratch {
    std::vector<float> inverse;
    std::vector<std::uint32_t> ids, ribbon_ids;
    ImageLayer::Scratch images;
    std::vector<std::vector<SkinSpot>> spots;  // by subject
    std::vector<SkinItems> items;
    SkinScratch skin;
  };

  /// Brings the subjects' triangles to a screen of width x height.
  void fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
            int height);

  /// Draws what of \p part lies in band \p band, hidden by \p scene and, where given, only where
  /// \p mirror is seen: premultiplied linear colours and coverage, row by row, of the
  /// rectangle that it returns; beside that there is nothing. \p drawn: the scene's layers have
  /// something at all. \p depth, where it is given, hides, too.
  Rectangle paint(const std::vector<ReadySubject>& subjects, int band, const Rectangle& part,
                  const SceneLayer& scene, const Aperture* mirror, bool drawn,
                  const DepthPicture* depth, Scratch& scratch, std::vector<glm::vec4>& into) const;

 private:
  Rectangle painted(int band, const Rectangle& part) const;
  static void hide(const Rectangle& part, const SceneLayer& scene, const Aperture* mirror,
                   const SampleRows& rows);
  static void hide(const Rectangle& part, const LayerView& view, const DepthPicture& depth,
                   const SampleRows& rows);
  /// Triangles, and by their ids and numbers what they are of.
  struct Drawn {
    struct Origin {
      std::uint32_t subject, first;  // its first vertex
      bool wide;
    };
    ScreenTriangles triangles;
    std::vector<Origin> origins;             // by id
    std::vector<const SkinCorner*> corners;  // by number: three
    bool wide = false;                       // any is
    void clear(int width, int height);
    void add(const std::vector<ReadySubject>& subjects, std::size_t subject, const SubjectEye& eye,
             std::size_t first, std::size_t last, Facing facing);
    const Origin& origin(std::uint32_t number) const { return origins[triangles.piece(number).id]; }
    /// Whether two triangles, by their numbers, are of one surface.
    bool joined(const std::vector<ReadySubject>& subjects, std::uint32_t a, std::uint32_t b) const;
    /// Skin::form() at a spot.
    Vec3f form_at(const Skin& skin, const SkinSpot& spot) const;
    /// Adds the spots' points to their subject's.
    void add_items(const ReadySubject& subject, const std::vector<SkinSpot>& spots,
                   SkinItems& items) const;
  };
  void find_items(const std::vector<ReadySubject>& subjects, const SampleRows& rows,
                  const Drawn& drawn, const std::uint32_t* ids, Scratch& scratch) const;
  void draw_ribbons(int band, const SampleRows& rows, Scratch& scratch) const;

  Drawn hulls_, ribbons_;
  ImageLayer images_;
};

}  // namespace polyhull::processor
