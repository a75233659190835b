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
    std::vector<std::uint32_t> ids, ribbon_ids, together, covered;
    ImageLayer::Scratch images;
    std::vector<SkinItems> items;
    SkinScratch skin;
  };

  /// Brings the subjects' triangles to a screen of width x height.
  void fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
            int height);

  /// Draws what of \p part lies in band \p band, hidden by \p scene and, where given, only where
  /// \p frame marks its mirror: premultiplied linear colours and coverage, row by row, of the
  /// rectangle that it returns; beside that there is nothing. \p drawn: the scene's layers have
  /// something at all. \p depth, where it is given, hides, too.
  Rectangle paint(const std::vector<ReadySubject>& subjects, int band, const Rectangle& part,
                  const SceneLayer& scene, const SceneLayer* frame, bool drawn,
                  const DepthPicture* depth, Scratch& scratch, std::vector<glm::vec4>& into) const;

 private:
  Rectangle painted(int band, const Rectangle& part) const;
  void hide(const Rectangle& rows, const SceneLayer& scene, const SceneLayer* frame,
            Scratch& scratch) const;
  void hide(const Rectangle& rows, const LayerView& view, const DepthPicture& depth,
            Scratch& scratch) const;
  /// Triangles, and by their ids what they are of.
  struct Drawn {
    struct Origin {
      std::uint32_t subject, first;  // its first vertex
      bool wide;
    };
    ScreenTriangles triangles;
    std::vector<Origin> origins;
    void add(const std::vector<ReadySubject>& subjects, std::size_t subject, const SubjectEye& eye,
             std::size_t first, std::size_t last, Facing facing);
    /// Whether the triangles of two ids are of one surface.
    bool joined(const std::vector<ReadySubject>& subjects, std::uint32_t a, std::uint32_t b) const;
    /// Adds what piece \p number shows at (\p x, \p y) of the screen.
    void add_item(const std::vector<ReadySubject>& subjects, std::uint32_t number, double x,
                  double y, float share, std::uint32_t pixel, std::vector<SkinItems>& items) const;
  };
  void find_items(const std::vector<ReadySubject>& subjects, const Rectangle& rows, int samples,
                  const Drawn& drawn, const std::vector<std::uint32_t>& ids,
                  Scratch& scratch) const;
  static std::size_t find_covered(const std::uint32_t* ids, std::size_t pixels, int samples,
                                  Scratch& scratch);
  void draw_ribbons(int band, const SampleRows& rows, Scratch& scratch) const;

  Drawn hulls_, ribbons_;
  ImageLayer images_;
};

}  // namespace polyhull::processor
