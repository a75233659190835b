// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What streams a take has.
#pragma once

#include <vector>

#include "take/database.h"
#include "take/take.h"

namespace polyhull {

/// In the order they were made. Throws Error where the tables cannot be read; a last packet that
/// cannot makes the stream end where that begins.
std::vector<TakeStream> read_streams(TakeDatabase& database);

}  // namespace polyhull
