// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The colours of screen and subject all over the picture, in square tiles: what a mixed pixel is a
/// mixture of. Internal.
///
/// Some rows are sampled. A pixel is taken for screen or for subject where its signal is, and where
/// those of the pixels beside it are, too, so that no edge counts. A tile's screen is the mean of its
/// samples, if they are as alike as the camera's noise lets them be, which hair before a screen is not;
/// it stays where it is hidden later. The light on a screen changes slowly: a tile that shows none
/// has the quadratic polynomial of position that fits the others, and the mean of what these differ
/// from it around the tile.
///
/// A tile's subject is the mean of what this frame shows of it in the tile and, half as much, in those
/// beside it; up to four tiles away from these it is their neighbours' mean.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/vector.h"

namespace polyhull::silhouette {

class LocalColours {
 public:
  /// Of one tile; R, G, B in levels.
  struct Tile {
    Vec3f screen{0.0f};   ///< where any screen was seen anywhere: see has_screen()
    Vec3f subject{0.0f};  ///< with has_subject
    bool has_subject = false;
    bool plain = false;           ///< this frame's samples show screen alone, here and beside
    bool seen = false;            ///< the screen was seen in this tile
    bool varies = false;          ///< and its light varies within the tile, which is not fitted
    float spread = 0.0f;          ///< of its signal, beyond noise, in the numbers of add_row()
    float subject_spread = 0.0f;  ///< likewise
  };

  /// Begins anew, for frames of this size.
  void begin(int width, int height);
  bool begun() const { return !tiles_.empty(); }

  /// Begins a frame of whose columns [x0, x1) count. \p screen_signal, \p noise: the screen's signal
  /// and its standard deviation, in the numbers of add_row().
  void begin_frame(int x0, int x1, int screen_signal, double noise);
  /// The signals of a row's columns, for all rows that is_sampled(), from top to bottom.
  void add_row(int y, const std::int16_t* signal);
  /// R, G, B, A of pixels [a, b) of row y.
  using Colours = std::function<const std::uint8_t*(int y, int a, int b)>;
  /// \p colours is asked where colours are needed.
  void finish_frame(const Colours& colours);

  /// The standard deviation of the signal, in the numbers of add_row(), that is exceeded in half
  /// of the tiles that show enough of the screen in this frame, or in a tenth of those that show enough of the
  /// subject; 0 without any.
  double screen_spread() const { return spread(screens_, 0.5); }
  double subject_spread() const { return spread(subjects_, 0.9); }

  /// A pixel of the frame's sampled rows that is neither screen nor subject, and its tile.
  struct Mixed {
    std::size_t tile;
    Vec3f colour;
  };
  const std::vector<Mixed>& mixed() const { return mixed_; }

  /// The share of the subject's pixels, away from edges, that have too much of the screen's colour to be told
  /// from mixtures by themselves; 0 where hardly any is solid.
  double nearly_solid() const {
    return solid_ < 4.0 * size() ? 0.0 : nearly_solid_ / (nearly_solid_ + solid_);
  }
  /// From the next frame on these count as the subject's, too.
  void take_nearly_solid() { subject_below_ = 0.45; }

  /// Takes one colour for all of the screen, or of the subject, instead of what finish_frame() found.
  void assume_screen(const Vec3f& colour);
  void assume_subject(const Vec3f& colour);
  /// The mean of all that this frame shows of the subject; none: nothing.
  std::optional<Vec3f> mean_subject() const;

  /// Two rows of pixels in each row of tiles.
  bool is_sampled(int y) const { return y % (size() / 2) == size() / 4; }

  /// The colours of all that may be solid subject in a tile and those beside it, each the mean of a
  /// few pixels of a row; appended.
  void solid_colours(int column, int row, std::vector<Vec3f>& out) const;

  int size() const { return 1 << shift_; }
  int across() const { return across_; }
  int down() const { return down_; }
  bool has_screen() const { return has_screen_; }
  const Tile& tile(std::size_t index) const { return tiles_[index]; }
  const Tile& tile(int column, int row) const { return tiles_[index(column, row)]; }

 private:
  struct Sum {
    Vec3f colour{0.0f};
    float weight = 0.0f;
    float count = 0.0f, signal = 0.0f, square = 0.0f;  // of all, not weighted
  };
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(across_) +
           static_cast<std::size_t>(column);
  }
  using Polynomial = std::array<Vec3f, 6>;  // quadratic, of position
  static float variance(const Sum& sum);    // of the signal
  float beyond_noise(const Sum& sum) const;
  struct Row {
    const std::int16_t* signal;
    const std::uint8_t *kinds, *upper, *lower;  // its own, and of the sampled rows beside it
    int y;
  };
  Row row_of(std::size_t row) const;
  void sum_row(std::size_t row, const Colours& colours);
  // \p rgb: of columns [from, to).
  void sum_solids(std::size_t row, int from, int to, const std::uint8_t* rgb);
  void find_solids();
  void sum_screen(std::size_t row, int from, int to, const std::uint8_t* rgb);
  void sum_subject(std::size_t row, int from, int to, const std::uint8_t* rgb);
  double spread(const std::vector<Sum>& sums, double quantile) const;
  void find_screens();
  // mark() for each tile that counts() and those beside it.
  template <class Counts, class Mark>
  void mark_beside(const Counts& counts, const Mark& mark) const;
  Polynomial fitted() const;
  void evaluate(const Polynomial& fit);  // into values_
  void spread_screens();
  void find_subjects();

  int shift_ = 4, across_ = 0, down_ = 0;
  bool has_screen_ = false;
  int screen_signal_ = 0;
  double noise_ = 0.0;
  std::vector<Tile> tiles_, before_;
  std::vector<Vec3f> values_;                 // of the polynomial at the tiles
  std::vector<std::uint8_t> shown_;           // tiles whose samples show more than screen
  std::vector<std::uint8_t> beside_subject_;  // tiles
  std::vector<Sum> screens_, subjects_, smooth_, beside_;
  struct Position {
    int column, row;
  };
  std::vector<Position> known_;  // tiles with a subject's colour
  std::vector<std::vector<Sum>> levels_;
  std::vector<Mixed> mixed_;
  double subject_below_ = 0.25;              // of the screen's signal: less is subject
  double solid_ = 0.0, nearly_solid_ = 0.0;  // pixels
  int x0_ = 0, x1_ = 0;                      // columns
  std::vector<int> rows_;                    // sampled ones, and of their pixels
  std::vector<std::int16_t> signals_;        // signals
  std::vector<std::uint8_t> kinds_;          // and kinds
  // Of few pixels of a sampled row: of those that may be solid subject, and how many these are.
  struct Solid {
    Vec3f sum{0.0f};
    int count = 0;
  };
  std::vector<Solid> solids_;  // row by row
  // The colours of those that count, row by row, and where each tile of each row begins.
  std::vector<Vec3f> solid_colours_;
  std::vector<std::size_t> solids_from_;
  std::size_t solids_across() const;
};

}  // namespace polyhull::silhouette
