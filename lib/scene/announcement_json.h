// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// An announcement in JSON that has been read already.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "scene/announcement.h"

namespace polyhull {

/// As parse_announcement(), of \p root; members that an announcement does not have are left alone.
Announcement announcement_of(const nlohmann::json& root);

}  // namespace polyhull
