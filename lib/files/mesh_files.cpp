// SPDX-License-Identifier: LGPL-2.1-or-later
#include "files/mesh_files.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>

#include "base/error.h"
#include "base/plain_text.h"
#include "files/mesh_files_internal.h"

namespace polyhull {
namespace {

struct Format {
  const char* ending;
  void (*write)(const Mesh& mesh, const std::string& path, const MeshFileOptions& options);
};
constexpr Format formats[] = {{".glb", write_glb}, {".ply", write_ply}, {".obj", write_obj}};

/// By the ending of \p path; null: none of these.
const Format* format_of(const std::string& path) {
  const std::string ending = lower_case(std::filesystem::path(path).extension().string());
  const auto* found = std::find_if(std::begin(formats), std::end(formats),
                                   [&](const Format& format) { return ending == format.ending; });
  return found != std::end(formats) ? found : nullptr;
}

}  // namespace

void write_whole_file(const std::string& path, std::string_view content) {
  const std::string part = fmt::format("{}.part{}", path, getpid());
  const auto fail = [&](const char* what) {
    const std::string reason = std::strerror(errno);
    std::remove(part.c_str());
    throw Error(Error::Kind::io,
                "Cannot {} '{}': {}; check that the folder exists, may be written and has space.",
                what, path, reason);
  };
  std::FILE* file = std::fopen(part.c_str(), "wb");
  if (!file) fail("write");
  const bool written = std::fwrite(content.data(), 1, content.size(), file) == content.size();
  const int reason = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) errno = reason;
  if (!written || !closed) fail("write");
  if (std::rename(part.c_str(), path.c_str()) != 0) fail("replace");
}

std::string mesh_file_endings() {
  std::string list;
  for (const Format& format : formats) {
    if (&format != std::begin(formats)) list += &format == std::end(formats) - 1 ? " or " : ", ";
    list += format.ending;
  }
  return list;
}

bool is_mesh_file_name(const std::string& path) {
  return format_of(path) != nullptr;
}

void write_mesh_file(const Mesh& mesh, const std::string& path, const MeshFileOptions& options) {
  const Format* format = format_of(path);
  if (format == nullptr)
    throw Error(Error::Kind::unsupported, "'{}' has an ending this program cannot write; use {}.",
                path, mesh_file_endings());
  format->write(mesh, path, options);
}

}  // namespace polyhull
