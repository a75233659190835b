// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// While boards are shown to live cameras: which views are worth keeping, what is covered, and where
/// to hold the board next.
#pragma once

#include <string>
#include <vector>

#include "studio/calibration/take.h"

namespace polyhull::calibration {

/// When there is enough to calibrate from.
struct Enough {
  std::size_t views = 20;   ///< of each camera
  double coverage = 0.8;    ///< share of each camera's picture, as CameraQuality::coverage
  std::size_t shared = 10;  ///< instants that link a camera to the others
};

/// Follows a take as it grows.
class BoardGuide {
 public:
  static constexpr int columns = 16, rows = 9;  ///< cells of a picture

  /// The cameras' names and sizes must be known.
  BoardGuide(std::vector<TakeCamera> cameras, const Enough& enough);

  /// Takes the views of one instant, at most one per camera, if one of them shows its camera
  /// something new: the board in another place, size or slant than in any view that was kept, or
  /// beside a camera with which it shares few. False: none is kept.
  bool add(const std::vector<View>& views);

  std::size_t views(std::size_t camera) const { return kept_[camera].size(); }
  std::size_t instants() const { return instants_; }
  /// Whether a cell of a camera's picture has a corner in or beside it.
  bool covered(std::size_t camera, int column, int row) const;
  double coverage(std::size_t camera) const;

  /// Where \p camera needs the board most: a column and row of 0 to 2, of the picture's ninths; its
  /// middle where all is covered.
  struct Place {
    int column = 1, row = 1;
  };
  Place next_place(std::size_t camera) const;

  /// What \p camera still needs, for who holds the board: "upper left", "slants and distances", "where
  /// 'cam2' sees it, too"; empty: nothing.
  std::string wish(std::size_t camera) const;
  bool enough() const;

 private:
  /// Where a board's corners lie, how far spread and how slanted, as parts of the picture's width.
  struct Shape {
    double x, y, wide, high, slant;
  };
  Shape shape_of(const View& view) const;
  bool is_new(const View& view) const;
  std::size_t shared(std::size_t a, std::size_t b) const {
    return shared_[a * cameras_.size() + b];
  }
  /// The camera nearest to being linked to the group of \p camera, which is not all; or none.
  std::size_t unlinked(std::size_t camera) const;

  std::vector<TakeCamera> cameras_;
  Enough enough_;
  std::vector<std::vector<Shape>> kept_;    // by camera
  std::vector<std::vector<char>> covered_;  // by camera, cell by cell
  std::vector<std::size_t> shared_;         // instants, by two cameras
  std::size_t instants_ = 0;
};

}  // namespace polyhull::calibration
