// SPDX-License-Identifier: LGPL-2.1-or-later
#include "environment/radiance_picture.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "base/error.h"
#include "base/picture.h"
#include "base/srgb.h"
#include "base/whole_file.h"

namespace polyhull {
namespace {

constexpr int most_columns = 16384, most_rows = 8192;

void check_size(const std::string& path, int width, int height) {
  if (width >= 1 && height >= 1 && width <= most_columns && height <= most_rows) return;
  throw Error(Error::Kind::bad_input,
              "Picture '{}' has {}x{} pixels; at least 1x1 and at most {}x{} were expected. Make "
              "it smaller.",
              path, width, height, most_columns, most_rows);
}

/// A .hdr file's bytes, read from the first on. stb_image would show what a file that is cut off lacks as black.
class HdrReader {
 public:
  HdrReader(const std::string& path, std::string_view bytes) : path_(path), rest_(bytes) {}

  RadiancePicture read() {
    read_header();
    const auto width = static_cast<std::size_t>(picture_.width);
    // Not for more rows than the file may hold: its header alone says little.
    const std::size_t least_row = std::min(4 * width, 4 + 8 * ((width + 126) / 127));
    picture_.pixels.reserve(
        width * std::min(static_cast<std::size_t>(picture_.height), rest_.size() / least_row + 1));
    std::vector<Rgbe> row(width);
    for (row_ = 0; row_ < picture_.height; ++row_) {
      read_row(row);
      for (const Rgbe& pixel : row) picture_.pixels.push_back(value_of(pixel));
    }
    return std::move(picture_);
  }

 private:
  using Rgbe = std::array<std::uint8_t, 4>;

  Error broken(const std::string& what) const {
    return Error(Error::Kind::bad_input, "Picture '{}' is not a readable .hdr file: {}.", path_,
                 what);
  }

  std::string_view line() {
    const std::size_t end = rest_.find('\n');
    if (end == std::string_view::npos) throw broken("it ends within its header");
    const std::string_view found = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return found;
  }

  /// "-Y HEIGHT +X WIDTH" after the lines of the header and an empty one.
  void read_header() {
    for (std::string_view found = line(); !found.empty(); found = line()) {
      if (found.starts_with("FORMAT=") && found.find("rle_rgbe") == std::string_view::npos)
        throw broken(fmt::format(
            "it has '{}' where FORMAT=32-bit_rle_rgbe was expected; save it as RGB", found));
      if (found.starts_with("EXPOSURE=")) read_exposure(found);
    }
    const std::string_view size = line();
    const std::size_t across = size.find(" +X ");
    if (!size.starts_with("-Y ") || across == std::string_view::npos)
      throw broken(fmt::format("its size is given as '{}'; '-Y HEIGHT +X WIDTH' was expected",
                               size.substr(0, 40)));
    const auto number = [](std::string_view text) {
      int value = 0;
      std::from_chars(text.data(), text.data() + text.size(), value);
      return value;
    };
    picture_.height = number(size.substr(3, across - 3));
    picture_.width = number(size.substr(across + 4));
    check_size(path_, picture_.width, picture_.height);
  }

  /// By what the pixels have been multiplied; of several lines by all of them.
  void read_exposure(std::string_view line) {
    const std::size_t number = line.find_first_not_of(' ', line.find('=') + 1);
    const std::string_view text = line.substr(std::min(number, line.size()));
    float factor = 0.0f;
    std::from_chars(text.data(), text.data() + text.size(), factor);
    exposure_ *= factor;
    if (!(exposure_ > 0.0f && std::isfinite(exposure_)))
      throw broken(fmt::format("it has '{}' where a finite number above 0 was expected",
                               line.substr(0, 40)));
  }

  std::uint8_t byte() {
    if (rest_.empty())
      throw broken(fmt::format("it is cut off in row {} of {}", row_ + 1, picture_.height));
    const auto value = static_cast<std::uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }

  /// Of a row that is not packed. The oldest files repeat a pixel by one that no other way of writing has.
  void read_pixel(Rgbe& pixel) {
    for (std::uint8_t& value : pixel) value = byte();
    if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1)
      throw broken(fmt::format(
          "row {} has runs of pixels as only the oldest programs wrote them (1, 1, 1 and their "
          "number); save it with another program",
          row_ + 1));
  }

  void read_row(std::span<Rgbe> row) {
    Rgbe first;
    read_pixel(first);
    const bool packed = first[0] == 2 && first[1] == 2 && first[2] < 128;
    if (!packed) {
      row[0] = first;
      for (Rgbe& pixel : row.subspan(1)) read_pixel(pixel);
      return;
    }
    if (static_cast<std::size_t>(first[2] << 8 | first[3]) != row.size())
      throw broken(fmt::format("row {} has another length than the picture", row_ + 1));
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t x = 0; x < row.size();) {
        const std::uint8_t count = byte();
        const bool run = count > 128;
        const std::size_t length = run ? count - 128u : count;
        if (length == 0 || length > row.size() - x)
          throw broken(fmt::format("row {} holds more than its {} pixels", row_ + 1, row.size()));
        std::uint8_t value = 0;
        for (std::size_t i = 0; i < length; ++i) {
          if (i == 0 || !run) value = byte();
          row[x++][k] = value;
        }
      }
    }
  }

  Vec3f value_of(const Rgbe& pixel) const {
    if (pixel[3] == 0) return Vec3f(0.0f);
    return Vec3f(pixel[0], pixel[1], pixel[2]) * std::ldexp(1.0f, pixel[3] - 136) / exposure_;
  }

  const std::string& path_;
  std::string_view rest_;
  RadiancePicture picture_;
  float exposure_ = 1.0f;
  int row_ = 0;
};

}  // namespace

RadiancePicture load_radiance(const std::string& path) {
  const std::optional<std::string> bytes = whole_file(path);
  if (!bytes)
    throw Error(Error::Kind::not_found, "Picture '{}' cannot be opened for reading.", path);
  if (bytes->starts_with("#?")) return HdrReader(path, *bytes).read();
  if (bytes->starts_with("\x76\x2f\x31\x01"))
    throw Error(Error::Kind::unsupported,
                "Picture '{}' is an OpenEXR file, which is not read; save it as Radiance .hdr "
                "(Blender: Image > Save As).",
                path);
  const Picture picture =
      decode_picture({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, 3,
                     "environment picture '" + path + "', which is no .hdr file,");
  check_size(path, picture.width, picture.height);
  RadiancePicture out{picture.width, picture.height, {}};
  for (std::size_t i = 0; i + 2 < picture.pixels.size(); i += 3)
    out.pixels.emplace_back(srgb_to_linear(picture.pixels[i]),
                            srgb_to_linear(picture.pixels[i + 1]),
                            srgb_to_linear(picture.pixels[i + 2]));
  return out;
}

}  // namespace polyhull
