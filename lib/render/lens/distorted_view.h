// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Drawing into pictures that a lens has distorted, by renderers that know pinhole cameras.
///
/// A background's picture D is as its camera saw it, distortion included: pixel d shows what the
/// pinhole pixel u(d) shows, u the inverse of the distortion (rig/lens.h). So a picture of another
/// program, of a real camera or of scenesrc means the same, and who applies the distortion to what
/// is drawn is this class alone:
///
///   B(p) = D(distort(p))                 the background in a pinhole picture with overscan, which
///                                        shows all that D shows
///   C = the renderer's composite over B
///   D'(d) = C(u(d)) where any of the 16 pixels of C around u(d) is not as in B, else D(d)
///
/// Values between pixels are those of Catmull and Rom's cubics on the codes. Background and subject
/// go through one and the same u, so they are in register whatever the coefficients; what the
/// background loses of its sharpness by being resampled twice, it loses only where shadows and
/// mirror images change it and along the subject's border.
///
/// The overscan picture has the focal length, in pixels, of D and up to `most_pixels` times D's
/// pixels; a lens that would ask for more is drawn more coarsely. u and distort are exact at every
/// eighth pixel and cubic in between. Where the model of a lens turns back, pixels at the picture's rim
/// have no u; they stay D(d), in cells of eight pixels.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "render/depth_picture.h"
#include "rig/camera.h"

namespace polyhull {

class DistortedView {
 public:
  static constexpr double most_pixels = 4.0;

  /// From now on of \p viewport, whose picture has its width and height; true: it distorts, and what
  /// is below is of use. Throws Error (bad_input) for numbers that are not finite or no focal length.
  bool set(const Camera& viewport);
  bool active() const { return active_; }

  /// The overscan's camera: the viewport's place and axes, a size and a K of its own.
  const Camera& pinhole() const { return pinhole_; }

  /// Takes what \p part (pinhole pixels) shows of \p picture, RGBA rows \p stride bytes apart, into
  /// before() and drawn(), with what the cubics reach beside it. Beyond that both are alike, of frames
  /// before. What is there of the same picture is kept; of one that comes again, all is taken. Until
  /// the next time drawn() may be written within \p part alone.
  void take(const std::uint8_t* picture, int stride, const Rectangle& part);

  /// What the pinhole's picture shows of \p depth, which is of the picture, of its size or another: to
  /// the nearest pixel; beyond its borders it goes on as its last pixels.
  std::shared_ptr<const DepthPicture> take(const DepthPicture& depth) const;

  /// RGBA rows without gaps.
  const std::uint8_t* before() const { return before_.data(); }
  std::uint8_t* drawn() { return drawn_.data(); }
  int stride() const { return 4 * pinhole_.width; }

  /// The pixels of the picture that \p part (pinhole pixels) can change.
  Rectangle reach(const Rectangle& part) const;

  /// Brings drawn(), which differs from before() within \p changed alone, into \p target, which holds
  /// the picture that was taken; only pixels that change are written.
  void give(const Rectangle& changed, std::uint8_t* target, int stride) const;

  /// The pinhole's pixel that the picture's pixel (x, y) shows, as drawing takes it.
  Vec2 place(int x, int y) const;

 private:
  static constexpr int cell = 8;  // pixels between nodes

  /// Places in one picture of every eighth pixel of another: of node (i, j), pixel (8 i, 8 j), i and
  /// j from -1 to two beyond the last cell's own.
  struct Grid {
    int columns = 0, rows = 0;  // cells
    std::vector<Vec2> places;
    std::size_t index(int i, int j) const {
      return static_cast<std::size_t>(j + 1) * static_cast<std::size_t>(columns + 3) +
             static_cast<std::size_t>(i + 1);
    }
    const Vec2& at(int i, int j) const { return places[index(i, j)]; }
    Vec2& at(int i, int j) { return places[index(i, j)]; }
    void extend();
  };
  template <typename Map>
  static Grid grid_of(int width, int height, const Map& map);
  void lay_out(const Camera& viewport);
  template <typename Map>
  void find_lost(const Map& real_of);
  void make_alike();
  bool remember(const std::uint8_t* picture, int stride);
  void resample(const Rectangle& part);
  Rectangle grown(const Rectangle& part) const;
  Rectangle seen(int i, int j) const;
  std::vector<char> cells_changed(const Rectangle& changed) const;
  template <typename Wanted, typename Work>
  static void for_runs(const Grid& grid, const Rectangle& part, const Wanted& wanted,
                       const Work& work);

  bool active_ = false;
  Camera viewport_, pinhole_;
  Grid to_pinhole_, to_picture_;
  std::vector<char> lost_;  // cells of to_pinhole_, row by row, with a corner that has no place
  std::vector<std::uint8_t> picture_;  // the last that was taken, rows without gaps
  Rectangle held_;                     // of what of it before_ is
  Rectangle written_;                  // where drawn_ need not be as before_
  std::vector<std::uint8_t> before_, drawn_;
};

}  // namespace polyhull
