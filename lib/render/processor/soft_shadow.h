// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What subjects take of soft light from all around (RenderFrame::soft_light):
///   E(x) = sum over its parts of  b(x, part) o(x, part) cos_x irradiance
/// b: a subject stands between (and the scene's own surfaces do not, o). Such light's shadow changes slowly over
/// a surface: it is asked for at every fourth pixel of every fourth row, and of 4 x 4 neighbours each asks for
/// another sixteenth of the parts, which are sets from all around. The filter that gathers them and what brings
/// them to all pixels keep to one surface, as in area_shadow.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "render/processor/receiver_grid.h"
#include "render/processor/soft_masks.h"

namespace polyhull::processor {

/// E over the picture, by channel, where RenderFrame::sky is 1; kept from frame to frame.
class SoftShadow : public ReceiverGrid {
 public:
  /// The pixels of which draw() asks the view's layer for \p part: its middles, and the samples of the
  /// view's mirror.
  static Rectangle asked(const Rectangle& part, const LayerView& view);

  /// Computes E in \p part of the picture, as \p view sees it, at every \p step pixels (2 or 4): what \p
  /// subjects take, which are ready. Where all that is as in the last call, so is E, and nothing is asked. Returns
  /// whether what the scene itself hides is kept from before.
  bool draw(const SoftMasks& subjects, const TracedScene& scene, const ShadowView& view,
            const Rectangle& part, int step);

  /// E at the middles of the 16 pixels from (x, y) on, as AreaShadow::taken(). False, and nothing written,
  /// where all is 0.
  bool taken(const SceneLayer& layer, int x, int y, float (&taken)[3][16]) const;
  /// No less than any of these, but for rounding: taken() interpolates.
  Vec3f most(int x, int y) const;

 private:
  static constexpr int coarsest = 4;
  static constexpr int margin = 3 * coarsest;  // pixels of the picture that are gathered

  bool find_candidates(const SoftMasks& subjects, const TracedScene& scene, const ShadowView& view,
                       std::size_t number);
  struct Scratch {
    std::vector<std::uint32_t> pixels, asking;
    std::vector<std::uint64_t> hidden;
    std::vector<std::pair<std::uint32_t, std::uint64_t>> unknown;  // pixels and their bits
    SoftPoints points;
  };
  static Scratch& scratch();
  std::uint64_t find_unknown(const TracedScene& scene, std::span<const EnvironmentPart> parts,
                             Scratch& scratch);
  std::uint64_t look_up(const SoftMasks& subjects, const TracedScene& scene, int set);
  std::uint64_t find_open(const TracedScene& scene, const Vec3f& way, std::uint64_t bit,
                          const std::vector<std::uint32_t>& pixels);
  void gather(std::size_t number);
  using Edge = float[2][4][SoftRows::most];
  bool find_rows(int x, int y, Edge& edge, SoftRows& rows) const;

  std::uint64_t directions_ = 0;  // SoftMasks::directions() of what is known of the scene's part
  // What stays as long as the view, the scene and the directions do; by pixel of the grid.
  std::vector<std::uint8_t> block_known_;  // by block, 1: the depths are
  SparseArray<std::uint64_t> open_known_;  // by direction of its set: whether the scene's is
  SparseArray<std::uint64_t> open_;        // and lets the ray through
  // Of this frame, and of the next one where that asks for the same.
  std::array<SparseArray<float>, 3> sum_, gathered_;  // E by channel
  std::uint64_t generation_ = 0;                      // SoftMasks::generation() of it; 0: of none
  Rectangle part_;
};

}  // namespace polyhull::processor
