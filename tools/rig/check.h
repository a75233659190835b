// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What can be said of a rig by looking at its numbers.
#pragma once

#include <string>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

struct RigReport {
  std::string table;                  ///< one line per camera
  std::vector<std::string> warnings;  ///< what is probably wrong, a sentence each
};

/// The table, and what is wrong or implausible (see plausible.h too). \p rig must be valid.
RigReport examine_rig(const Rig& rig);

}  // namespace polyhull
