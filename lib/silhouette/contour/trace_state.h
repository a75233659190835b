// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a Tracer holds, which takes a field row by row. Internal.
#pragma once

#include <algorithm>
#include <vector>

#include "silhouette/contour/trace.h"
#include "silhouette/pixels/kernels.h"
#include "silhouette/pixels/row_ahead.h"

namespace polyhull {

/// One row of the field with the rows that its Laplacian reaches: above (>= 0) or below the half
/// level, with the blur's shift corrected. For columns of the frame.
struct CorrectedRow {
  const std::int16_t *here, *up, *down;
  int reach;
  std::int32_t centre, side;
  std::int32_t level;  // of the sum below
  std::int32_t operator()(std::ptrdiff_t x) const {
    const std::int32_t around = here[x - reach] + here[x + reach] + up[x] + down[x];
    return centre * here[x] - side * around - level;
  }
};

struct Tracer::State {
  void begin(int width, int height, const TraceSettings& settings);

  /// How many rows pushed before must stay valid while the next is pushed (or finish() called).
  static int rows_kept(const TraceSettings& settings);

  /// The next row, top to bottom: width values with field_pad more on both sides, and their states,
  /// both valid for the next rows_kept() pushes. \p ahead, if given: what is asked from memory
  /// meanwhile.
  void push(const std::int16_t* values, const BlockState* states,
            silhouette::RowAhead* ahead = nullptr);

  /// begin() and all rows of \p field.
  void push_all(const Field& field, const TraceSettings& settings);

  /// After all rows: what Tracer::trace() gives.
  void finish(Rings& rings, std::vector<std::int32_t>* parents);

  TraceSettings settings;
  int width = 0, height = 0, blocks = 0, words = 0;
  int reach = 1;
  std::int16_t centre = 1, side = 0;

  silhouette::RowAhead* ahead = nullptr;  // of the row being pushed

  int pushed = 0;                         // rows given
  int classified = 0;                     // rows whose bits are known
  std::vector<const std::int16_t*> rows;  // ring of the last 2*reach+2 rows
  std::vector<const BlockState*> row_states;

  // Bits of two rows of the grid, 64 columns to a word; word 0 and the last hold what is beyond the
  // frame.
  std::vector<std::uint64_t> above, below;
  // The corrected values of both rows, of mixed blocks only.
  std::vector<std::int32_t> values_above, values_below;
  std::vector<std::uint16_t> pieces, mixed_list;
  // Of one row of cells: what changes, and the values on both sides of a crossing.
  silhouette::CellChanges changes{};
  std::vector<std::int32_t> columns, near_values, far_values;
  std::vector<float> offsets;

  // Crossings made so far, and the next along the boundary; corners[v]: for `binary`, what the way
  // from v passes. The vectors are longer, so that a row of cells needs no checks.
  std::uint32_t count = 0;
  std::vector<Vec2f> vertices, corners;
  std::vector<std::uint32_t> next;
  // Those on one grid row follow each other, left to right: the first of the row above, of the row
  // below, and of every row.
  std::uint32_t row_above = 0, row_below = 0;
  std::vector<std::uint32_t> row_begins;
  // For the parents: each crossing's ring, each ring's first crossing and kind.
  std::vector<std::int32_t> ring_of;
  std::vector<std::uint32_t> first_crossing;
  std::vector<std::uint8_t> holes;

  int depth() const { return 2 * reach + 2; }
  const std::int16_t* row(int y) const {
    return rows[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) % rows.size()];
  }
  CorrectedRow corrected(int y) const {
    y = std::clamp(y, 0, height - 1);
    return {row(y),
            row(y - reach),
            row(y + reach),
            reach,
            centre,
            side,
            (centre - 4 * side) * field_half};
  }
  const BlockState* states(int y) const {
    return row_states[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) % rows.size()];
  }
  void classify(int y);
  void cells(int y);
  void cross(int y);
  template <bool binary>
  void link_cells(int y, std::uint32_t first_between);
  void advance(int until);
  void find_parents(const Rings& rings, std::vector<std::int32_t>& parents);
};

}  // namespace polyhull
