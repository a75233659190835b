// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/kept_pictures.h"

#include <fmt/core.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <system_error>

#include "base/content_hash.h"

namespace polyhull {
namespace {

constexpr std::uint32_t most_pictures = 64, most_pixels = 1u << 24;

/// What a file begins with; then each picture's size, then the pixels of all.
struct Header {
  std::array<char, 8> magic = {'p', 'h', 'p', 'i', 'c', 's', '1', '\n'};
  std::uint64_t content = 0;  // content_of()
  std::uint64_t count = 0;
};

struct Size {
  std::uint32_t width = 0, height = 0;
};

std::uint64_t content_of(const std::vector<Picture>& pictures) {
  ContentHash hash;
  for (const Picture& picture : pictures) {
    hash.add(picture.width);
    hash.add(picture.height);
    hash.add(picture.pixels);
  }
  return hash.value();
}

template <class T>
bool read(std::ifstream& file, T* out, std::size_t count) {
  const auto bytes = static_cast<std::streamsize>(count * sizeof(T));
  return static_cast<bool>(file.read(reinterpret_cast<char*>(out), bytes));
}

template <class T>
void write(std::ofstream& file, const T* in, std::size_t count) {
  file.write(reinterpret_cast<const char*>(in), static_cast<std::streamsize>(count * sizeof(T)));
}

}  // namespace

std::vector<Picture> kept_pictures(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  Header header;
  if (!read(file, &header, 1) || header.magic != Header{}.magic || header.count > most_pictures)
    return {};
  std::vector<Size> sizes(header.count);
  if (!read(file, sizes.data(), sizes.size())) return {};
  std::vector<Picture> out;
  for (const Size& size : sizes) {
    if (size.width > most_pixels || size.height > most_pixels) return {};
    const std::uint64_t pixels = std::uint64_t{size.width} * size.height;
    if (pixels > most_pixels) return {};
    Picture picture{static_cast<int>(size.width), static_cast<int>(size.height), 4, {}};
    picture.pixels.resize(4 * pixels);
    if (!read(file, picture.pixels.data(), picture.pixels.size())) return {};
    out.push_back(std::move(picture));
  }
  if (content_of(out) != header.content) return {};
  return out;
}

void keep_pictures(const std::vector<Picture>& pictures, const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  // Under another name until it is whole.
  std::filesystem::path unfinished = path;
  unfinished += fmt::format(".{}", getpid());
  std::ofstream file(unfinished, std::ios::binary);
  Header header;
  header.content = content_of(pictures);
  header.count = pictures.size();
  write(file, &header, 1);
  for (const Picture& picture : pictures) {
    const Size size{static_cast<std::uint32_t>(picture.width),
                    static_cast<std::uint32_t>(picture.height)};
    write(file, &size, 1);
  }
  for (const Picture& picture : pictures) write(file, picture.pixels.data(), picture.pixels.size());
  file.close();
  if (file) std::filesystem::rename(unfinished, path, error);
  if (!file || error) std::filesystem::remove(unfinished, error);
}

}  // namespace polyhull
