// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pictures in memory and in files (PNG, JPEG; stb_image underneath).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace polyhull {

/// Rows of 8-bit pixels without padding; channels 1 (grey), 3 (RGB) or 4 (RGBA).
struct Picture {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> pixels;
  bool empty() const { return pixels.empty(); }
  const std::uint8_t* row(int y) const {
    return pixels.data() + static_cast<std::size_t>(y) * width * channels;
  }
  std::uint8_t* row(int y) {
    return pixels.data() + static_cast<std::size_t>(y) * width * channels;
  }
};

/// Reads a PNG or JPEG file, converted to \p channels (0: as stored). Throws Error.
Picture load_picture(const std::string& path, int channels = 0);

/// Rows of samples as the file has them, without padding.
struct DeepPicture {
  int width = 0;
  int height = 0;
  int channels = 0;
  int full = 255;  ///< what a sample can be at most: 255 or 65535
  std::vector<std::uint16_t> samples;
};

/// Reads a PNG or JPEG file, its channels and its depth as stored (fewer than eight bits as eight).
/// Throws Error.
DeepPicture load_deep_picture(const std::string& path);

/// A mask's levels: 255 the subject, 0 none of it.
struct MaskLevels {
  Picture picture;      ///< one channel
  int largest = 0;      ///< of the samples
  bool by_own = false;  ///< the largest sample stands for 255
};

/// One channel of \p deep as a mask, in eight bits. Where its largest sample is below nine tenths
/// of what the depth allows, and most that is not black is as bright as it, that sample stands for
/// 255: masks of 0 and 1, or of 0 to 255 in sixteen bits. Noise and soft shades stay as they are.
MaskLevels mask_levels(const DeepPicture& deep, int channel);

/// The mask in a file: mask_levels() of a grey one, the brightness of a coloured one. Throws Error.
Picture load_grey_mask(const std::string& path);

/// Decodes the bytes of a PNG or JPEG file, converted to \p channels (0: as stored); \p name says
/// in errors what they are. Throws Error.
Picture decode_picture(std::span<const std::uint8_t> bytes, int channels, const std::string& name);

/// Writes a PNG or JPEG (quality 95) file by the name's ending: .png, .jpg or .jpeg, any case.
/// Throws Error for another ending, and where the file cannot be written.
void save_picture(const Picture& picture, const std::string& path);

/// The picture as the bytes of a PNG or JPEG file; \p quality is held between 1 and 100. Throws
/// Error where it cannot be encoded.
std::vector<std::uint8_t> encode_png(const Picture& picture);
std::vector<std::uint8_t> encode_jpeg(const Picture& picture, int quality);

}  // namespace polyhull
