// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the programs read and write as text.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/plain_text.h"
#include "base/whole_file.h"

namespace polyhull {

/// Writes \p text to the file \p path. Throws Error (io), which names it.
inline void write_text(const std::string& text, const std::string& path) {
  std::ofstream out(path);
  if (!(out << text) || !out.flush())
    throw Error(Error::Kind::io,
                "Cannot write '{}'; check that the folder exists and may be written to.", path);
}

/// The text of the file \p path, as plain_text() makes it. Throws Error (not_found) where there is
/// none, which names it, and (bad_input) for bytes that are no text, but for those of gzip, and for more
/// than \p most MiB: no file of settings has 16.
inline std::string read_text(const std::string& path, std::size_t most = 16) {
  std::optional<std::string> text = whole_file(path, (most << 20) + 1);
  if (!text)
    throw Error(Error::Kind::not_found,
                "Cannot read '{}'; check that it exists, is a file and may be read.", path);
  if (text->size() > (most << 20))
    throw Error(Error::Kind::bad_input, "'{}' has more than {} MiB; it is no such file.", path,
                most);
  std::string plain = plain_text(*std::move(text), path);
  if (!plain.starts_with("\x1f\x8b") && plain.find('\0') != plain.npos)
    throw Error(
        Error::Kind::bad_input,
        "'{}' is no text but a binary file, as Matlab's .mat and numpy's .npy and .npz are; "
        "write what is in it as text.",
        path);
  return plain;
}

/// Makes the folder \p path where it is missing. Throws Error (io), which names it.
inline void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path))
    throw Error(Error::Kind::io,
                "Cannot make the folder '{}'; check that it may be made there and that no file has "
                "its name.",
                path);
}

}  // namespace polyhull
