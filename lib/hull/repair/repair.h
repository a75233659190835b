// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rings that the other cameras do not confirm: holes that bad keying has torn into one camera's
/// silhouette, and pieces of background in it.
///
/// A true gap in the subject (a hand on the hip) and a hole in a matte look the same to one camera;
/// the others can tell some of them apart. With H_k the hull without camera k, ray by ray and exact
/// (agreement.h):
///
///  1. A hole of k is filled where it is proven wrong. That H_k lies behind it is no proof: the hull
///     of the others always holds the body and what few cameras cannot exclude, the gap between two
///     legs. But a body leaves no silhouette uncovered. Where a pixel well inside another camera's
///     silhouette has no part of the whole hull behind it, some silhouette is wrong; where leaving
///     out k covers it, and leaving out no other camera does, the body is in k's hole. A twentieth of
///     the hole's rays must meet such a place in one of the four cameras that look most along k's
///     axis or against it, where the hull lacks the most; and H_k must lie behind all of the hole.
///     One hole at a time is filled, the one with the most proof first, since what it covers proves
///     nothing for the next.
///  2. A piece, a ring of foreground, is dropped where most of it has no part of H_k behind it,
///     while another piece of that silhouette does. Background seen by one camera has none.
///
/// What is filled or dropped goes by leaving out rings, so contours stay simple, and silhouettes
/// without such rings stay as they are to the byte. Bites at the outline are no rings: they stay.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// What of silhouettes is mended.
enum class Repair : std::uint8_t {
  off,
  holes,  ///< holes that the other cameras prove wrong are filled
  both,   ///< and pieces that they do not confirm are dropped
};

struct RepairOptions {
  Repair repair = Repair::off;
  Unseen unseen = Unseen::carve;  ///< as in HullOptions
  int threads = 1;                ///< of the pool; below 1 counts as 1
  bool operator==(const RepairOptions&) const = default;
};

/// What is wrong with one camera's silhouette.
struct ViewRepair {
  std::uint32_t holes = 0;               ///< to be filled
  std::uint32_t pieces = 0;              ///< to be dropped
  std::vector<std::uint32_t> leave_out;  ///< the rings without which it is mended, ascending
  bool operator==(const ViewRepair&) const = default;
};

/// One entry for each of \p silhouettes (pinhole pixels), the same for any number of threads. Of
/// fewer than three nothing is wrong: one camera's word against another's. The hull's bounds play no
/// part. Where a point is not finite nothing is looked at: HullBuilder::build() refuses such rings.
/// Of each silhouette the 32 largest holes and pieces are.
std::vector<ViewRepair> find_repairs(std::span<const Silhouette> silhouettes,
                                     const RepairOptions& options);

/// \p rings but for those numbered \p leave_out (ascending).
Rings without_rings(const Rings& rings, std::span<const std::uint32_t> leave_out);

}  // namespace polyhull
