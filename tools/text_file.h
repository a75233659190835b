// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the programs write as text.
#pragma once

#include <fstream>
#include <string>

#include "base/error.h"

namespace polyhull {

/// Writes \p text to the file \p path. Throws Error (io), which names it.
inline void write_text(const std::string& text, const std::string& path) {
  std::ofstream out(path);
  if (!(out << text) || !out.flush())
    throw Error(Error::Kind::io,
                "Cannot write '{}'; check that the folder exists and may be written to.", path);
}

}  // namespace polyhull
