// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// In which pose a scene is shown.
#pragma once

#include <string>

namespace polyhull {

struct ScenePose {
  std::string nodes;            ///< how its nodes differ from the file's, for parse_node_changes()
  int animation = 0;            ///< of the file's, numbered from 1 on; 0: none
  double animation_time = 0.0;  ///< seconds from its begin
  bool operator==(const ScenePose&) const = default;
};

}  // namespace polyhull
