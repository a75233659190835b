// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/picture.h"

#include <algorithm>
#include <fstream>
#include <optional>

#include "base/error.h"
#include "base/plain_text.h"
#include "base/whole_file.h"

// The implementation is compiled here, whichever other library carries its own.
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace polyhull {
namespace {

Error unencodable(const Picture& picture, const char* format) {
  return Error(
      Error::Kind::io,
      "A picture of {}x{} pixels in {} channels could not be encoded as {}: expected a size "
      "above 0 and 1 to 4 channels.",
      picture.width, picture.height, picture.channels, format);
}

void append(void* context, void* data, int size) {
  auto* bytes = static_cast<std::vector<std::uint8_t>*>(context);
  const auto* begin = static_cast<const std::uint8_t*>(data);
  bytes->insert(bytes->end(), begin, begin + size);
}

std::string lower_ending(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : lower_case(path.substr(dot + 1));
}

/// Whether the Huffman tables of a JPEG have as many codes as there can be, at most 256. stb_image of
/// 2022 writes those of a damaged one behind the room that it has for them. True for other files.
bool huffman_tables_fit(std::span<const std::uint8_t> bytes) {
  const auto at = [&](std::size_t i) { return i < bytes.size() ? std::size_t{bytes[i]} : 0; };
  if (at(0) != 0xFF || at(1) != 0xD8) return true;
  for (std::size_t i = 2; i + 4 <= bytes.size();) {
    const std::size_t marker = at(i + 1);
    const bool alone = marker == 0 || marker == 1 || (marker >= 0xD0 && marker <= 0xD9);
    if (at(i) != 0xFF || marker == 0xFF || alone) {  // between markers, or one without a segment
      ++i;
      continue;
    }
    const std::size_t end = i + 2 + std::max<std::size_t>(at(i + 2) << 8 | at(i + 3), 2);
    for (std::size_t table = i + 4; marker == 0xC4 && table < end;) {
      std::size_t codes = 0;
      for (std::size_t k = 1; k <= 16; ++k) codes += at(table + k);
      if (codes > 256) return false;
      table += 17 + codes;
    }
    i = end;
  }
  return true;
}

/// \p problem is what the message says where they are none.
Picture decode(std::span<const std::uint8_t> bytes, int channels, const std::string& problem) {
  Picture picture;
  int stored = 0;
  stbi_uc* data = nullptr;
  const bool fits = huffman_tables_fit(bytes);
  if (fits) {
    data = stbi_load_from_memory(bytes.data(), static_cast<int>(bytes.size()), &picture.width,
                                 &picture.height, &stored, channels);
  }
  if (!data) {
    throw Error(Error::Kind::bad_input, "{} ({}).", problem,
                fits ? stbi_failure_reason() : "damaged Huffman table");
  }
  picture.channels = channels ? channels : stored;
  picture.pixels.assign(
      data, data + static_cast<std::size_t>(picture.width) * picture.height * picture.channels);
  stbi_image_free(data);
  return picture;
}

}  // namespace

Picture load_picture(const std::string& path, int channels) {
  const std::optional<std::string> bytes = whole_file(path);
  if (!bytes)
    throw Error(Error::Kind::not_found, "Picture '{}' cannot be opened for reading.", path);
  return decode({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, channels,
                fmt::format("Picture '{}' is not a readable PNG or JPEG file", path));
}

Picture decode_picture(std::span<const std::uint8_t> bytes, int channels, const std::string& name) {
  return decode(bytes, channels, fmt::format("The {} is not a readable PNG or JPEG picture", name));
}

DeepPicture load_deep_picture(const std::string& path) {
  DeepPicture deep;
  if (!stbi_is_16_bit(path.c_str())) {
    const Picture picture = load_picture(path);
    deep.width = picture.width;
    deep.height = picture.height;
    deep.channels = picture.channels;
    deep.samples.assign(picture.pixels.begin(), picture.pixels.end());
    return deep;
  }
  deep.full = 65535;
  stbi_us* data = stbi_load_16(path.c_str(), &deep.width, &deep.height, &deep.channels, 0);
  if (!data)
    throw Error(Error::Kind::bad_input, "Picture '{}' is not a readable PNG file ({}).", path,
                stbi_failure_reason());
  deep.samples.assign(data,
                      data + static_cast<std::size_t>(deep.width) * deep.height * deep.channels);
  stbi_image_free(data);
  return deep;
}

MaskLevels mask_levels(const DeepPicture& deep, int channel) {
  MaskLevels levels{{deep.width, deep.height, 1, {}}};
  const std::size_t pixels = static_cast<std::size_t>(deep.width) * deep.height;
  const auto sample = [&](std::size_t i) { return int{deep.samples[i * deep.channels + channel]}; };
  for (std::size_t i = 0; i < pixels; ++i) levels.largest = std::max(levels.largest, sample(i));
  std::size_t lit = 0, bright = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    lit += sample(i) > 0;
    bright += 10 * sample(i) >= 9 * std::max(1, levels.largest);
  }
  levels.by_own = lit > 0 && 10 * levels.largest < 9 * deep.full && 2 * bright > lit;
  const int full = levels.by_own ? levels.largest : deep.full;
  levels.picture.pixels.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    levels.picture.pixels[i] = static_cast<std::uint8_t>(
        full == 65535 ? sample(i) >> 8 : (sample(i) * 255 + full / 2) / full);
  return levels;
}

Picture load_grey_mask(const std::string& path) {
  const DeepPicture deep = load_deep_picture(path);
  return deep.channels <= 2 ? mask_levels(deep, 0).picture : load_picture(path, 1);
}

std::vector<std::uint8_t> encode_png(const Picture& picture) {
  std::vector<std::uint8_t> bytes;
  if (!stbi_write_png_to_func(append, &bytes, picture.width, picture.height, picture.channels,
                              picture.pixels.data(), picture.width * picture.channels))
    throw unencodable(picture, "PNG");
  return bytes;
}

std::vector<std::uint8_t> encode_jpeg(const Picture& picture, int quality) {
  std::vector<std::uint8_t> bytes;
  if (!stbi_write_jpg_to_func(append, &bytes, picture.width, picture.height, picture.channels,
                              picture.pixels.data(), std::clamp(quality, 1, 100)))
    throw unencodable(picture, "JPEG");
  return bytes;
}

void save_picture(const Picture& picture, const std::string& path) {
  const std::string ending = lower_ending(path);
  if (ending != "png" && ending != "jpg" && ending != "jpeg") {
    throw Error(Error::Kind::unsupported,
                "Picture '{}' cannot be written: its name must end in .png or .jpg.", path);
  }
  const std::vector<std::uint8_t> bytes =
      ending == "png" ? encode_png(picture) : encode_jpeg(picture, 95);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.flush();
  if (!file)
    throw Error(Error::Kind::io,
                "Picture '{}' could not be written; check that the folder exists, may be written "
                "and has space.",
                path);
}

}  // namespace polyhull
