// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a lens does at the values of its zoom and focus encoders, as it was measured: a lens file.
///
/// A lens file is text in UTF-8: one or more tables, each a heading and rows of numbers. A heading
/// names its columns: `zoom`, `focus` or both (the encoders' values), and quantities with their unit:
///
///     focal_length_UNIT                  the pinhole model's
///     hfov_deg                           in its place: the field of view from side to side
///     k1 k2 p1 p2 k3 k4 k5 k6            the distortion, as in Camera; 0 where there is no column
///     projection_offset_x_UNIT, ..._y_   the principal point from the picture's middle, right, down
///     focus_distance_UNIT                what is sharp, from the entrance pupil; may be inf
///     entrance_pupil_UNIT                before the point that the tracker tells, along the view
///
/// UNIT is mm, cm, m, in or ft. Upper case counts as lower case, and blanks, brackets and the like as
/// an underscore: "Focal length (mm)" is focal_length_mm. Values stand apart by semicolons, commas,
/// tabs or blanks, whichever the heading has first of these. Encoders' values may be hexadecimal
/// (0x4000); decimals stand behind a point, or a comma where values do not stand apart by commas. Rows
/// may stand in any order. Text behind a # is a remark.
///
/// Between rows a value follows a monotone cubic (monotone_cubic.h): exact at the rows, straight where
/// they are on a straight line, between its two neighbours elsewhere. Of a field of view
/// the focal length is interpolated, of a focus distance the reciprocal. In a table of both encoders
/// the rows of each zoom make a curve over focus, whatever values of focus they have; between zooms
/// the curves' values are interpolated. Beyond the rows the value of the last one holds.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// What the encoders show; none: not told.
struct LensEncoders {
  std::optional<double> zoom, focus;
};

/// What a lens file tells for one state of the encoders; none where it has no such column.
struct LensState {
  std::optional<double> focal_length_mm;
  std::optional<double> focal_length_widths;  ///< in widths of the picture, of a field of view
  std::vector<double> distortion;             ///< as in Camera; empty: not told
  std::optional<Vec2> projection_offset_mm;
  std::optional<double> focus_distance_m;
  std::optional<double> entrance_pupil_m;
  bool outside = false;  ///< an encoder is beyond the rows, and was taken to be at their end
  bool blind = false;    ///< an encoder that one of the tables goes by is not told
};

class LensTable {
 public:
  static constexpr std::size_t largest_file = std::size_t{1} << 20;  ///< bytes
  static constexpr std::size_t most_rows = 10000;                    ///< of all tables together
  /// A focus distance beyond which there is no difference, metres; told for inf.
  static constexpr double farthest_m = 1e6;

  /// The tables in \p text. Throws Error (bad_input), beginning with \p source and the line, for a
  /// column that is none or is there twice, for values that are missing, no numbers or out of range,
  /// and for rows of the same encoder values.
  LensTable(std::string_view text, const std::string& source);

  LensState at(const LensEncoders& encoders) const;

  /// Whether all encoders' values are from 0 to 1, as OpenTrackIO's `encoders` are, and not raw.
  bool is_normalised() const { return normalised_; }

 private:
  static constexpr std::size_t quantities = 14;
  using Row = std::array<double, quantities>;
  struct Curve {  // over focus
    double zoom = 0.0;
    std::vector<double> focus;
    std::vector<Row> rows;
  };
  struct Grid {
    bool by_zoom = false, by_focus = false;
    std::array<bool, quantities> tells{};
    std::vector<Curve> curves;  // by zoom
    double first_focus = 0.0, last_focus = 0.0;
  };
  class Reader;
  static Row row_at(const Grid& grid, double zoom, double focus);

  std::vector<Grid> grids_;
  bool normalised_ = true;
};

/// The lens file \p path. Throws Error (not_found) where it cannot be read, and as LensTable does.
LensTable load_lens_table(const std::string& path);

}  // namespace polyhull
