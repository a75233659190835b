// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-calibrate wand: from pictures of a moved light, or a file of its places in them.
#pragma once

namespace polyhull::calibrate_tool {

/// The sub-command with its own arguments (\p values begins with its name). Returns the program's
/// exit status: 0 good, 2 written but not good, 1 nothing.
int run_wand(int count, char** values);

}  // namespace polyhull::calibrate_tool
