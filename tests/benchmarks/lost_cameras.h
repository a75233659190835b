// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What is left of a body when cameras of a rig are lost.
#pragma once

#include <string>
#include <vector>

#include "measure.h"
#include "rig/rig.h"

namespace polyhull::benchmark {

/// The rigs that ship: the built-in one of four cameras, five.json and eight.json.
struct NamedRig {
  std::string name;
  Rig rig;
};
std::vector<NamedRig> shipped_rigs();

/// A row of \p table for each of three bodies and of some choices of cameras that \p rig can lose (one,
/// all but three, all but two): how many times the hull's volume becomes, how far hull and refined
/// surface then are from the body, and how much of it they cover half way between all cameras. With
/// \p sheets, a folder, pictures from there: across the losses and the truth, down the viewpoints.
void study_losses(Table& table, const NamedRig& rig, const std::string& sheets);

/// Rows of \p table: the figure in colours, as it is seen half way between the cameras of \p rig, against
/// the truth, dB: by all cameras, without each, and as it was some frames before.
void study_colours(Table& table, const NamedRig& rig);

}  // namespace polyhull::benchmark
