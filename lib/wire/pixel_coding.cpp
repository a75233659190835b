// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/pixel_coding.h"

#include <lz4.h>
#include <turbojpeg.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "wire/zstd_contexts.h"

namespace polyhull {
namespace {

using Bytes = std::span<const std::uint8_t>;

// Of zstd: above it each halving of what is left takes four times as long (docs/benchmarks-network.md).
constexpr int zstd_level = 1;

template <auto Free>
struct FreeWith {
  template <class T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};

[[noreturn]] void fail(const char* what) {
  throw Error(Error::Kind::bad_input, "A view's packed pixels are damaged: {}.", what);
}

/// One row of one channel less its left neighbours; \p above: the first sample of the row before.
void subtract_left(const std::uint8_t* row, int width, std::uint8_t above, std::uint8_t* out) {
  out[0] = static_cast<std::uint8_t>(row[0] - above);
  for (int x = 1; x < width; ++x) out[x] = static_cast<std::uint8_t>(row[x] - row[x - 1]);
}

void add_left(std::uint8_t* row, int width, std::uint8_t above) {
  std::uint8_t sum = above;
  for (int x = 0; x < width; ++x) row[x] = sum = static_cast<std::uint8_t>(sum + row[x]);
}

/// What the neighbours do not tell, plane by plane. \p row: room for a row of four planes.
void decorrelate(const PixelShape& shape, const std::uint8_t* pixels, int stride,
                 std::vector<std::uint8_t>& row, std::uint8_t* out) {
  const auto width = static_cast<std::size_t>(shape.width);
  const std::size_t plane = width * static_cast<std::size_t>(shape.height);
  row.resize(4 * width);
  std::uint8_t above[4] = {};
  for (int y = 0; y < shape.height; ++y) {
    const std::uint8_t* in = pixels + static_cast<std::ptrdiff_t>(y) * stride;
    std::uint8_t* to = out + static_cast<std::size_t>(y) * width;
    if (shape.channels == 1) {
      subtract_left(in, shape.width, above[0], to);
      above[0] = in[0];
      continue;
    }
    std::uint8_t *red = row.data(), *green = red + width, *blue = green + width,
                 *alpha = blue + width;
    for (std::size_t x = 0; x < width; ++x) {
      red[x] = static_cast<std::uint8_t>(in[4 * x] - in[4 * x + 1]);
      green[x] = in[4 * x + 1];
      blue[x] = static_cast<std::uint8_t>(in[4 * x + 2] - in[4 * x + 1]);
      alpha[x] = in[4 * x + 3];
    }
    for (std::size_t c = 0; c < 4; ++c) {
      subtract_left(red + c * width, shape.width, above[c], to + c * plane);
      above[c] = red[c * width];
    }
  }
}

/// The way back; \p planes is changed.
void recorrelate(const PixelShape& shape, std::uint8_t* planes, std::uint8_t* pixels) {
  const auto width = static_cast<std::size_t>(shape.width);
  const std::size_t plane = width * static_cast<std::size_t>(shape.height);
  std::uint8_t above[4] = {};
  for (int y = 0; y < shape.height; ++y) {
    std::uint8_t* from = planes + static_cast<std::size_t>(y) * width;
    for (std::size_t c = 0; c < static_cast<std::size_t>(shape.channels); ++c) {
      add_left(from + c * plane, shape.width, above[c]);
      above[c] = from[c * plane];
    }
    if (shape.channels == 1) {
      std::memcpy(pixels + static_cast<std::size_t>(y) * width, from, width);
      continue;
    }
    const std::uint8_t *red = from, *green = from + plane, *blue = from + 2 * plane,
                       *alpha = from + 3 * plane;
    std::uint8_t* out = pixels + static_cast<std::size_t>(y) * width * 4;
    for (std::size_t x = 0; x < width; ++x) {
      out[4 * x] = static_cast<std::uint8_t>(red[x] + green[x]);
      out[4 * x + 1] = green[x];
      out[4 * x + 2] = static_cast<std::uint8_t>(blue[x] + green[x]);
      out[4 * x + 3] = alpha[x];
    }
  }
}

void copy_alpha(std::span<const std::uint8_t> pixels, int stride, const PixelShape& shape,
                std::vector<std::uint8_t>& alpha) {
  const auto width = static_cast<std::size_t>(shape.width);
  alpha.resize(width * static_cast<std::size_t>(shape.height));
  for (int y = 0; y < shape.height; ++y) {
    const std::uint8_t* in = pixels.data() + static_cast<std::ptrdiff_t>(y) * stride;
    std::uint8_t* out = alpha.data() + static_cast<std::size_t>(y) * width;
    for (std::size_t x = 0; x < width; ++x) out[x] = in[4 * x + 3];
  }
}

/// Whether \p jpeg is of the kind that tjCompress2() writes (ITU-T T.81, B.1.1.3): baseline, with one
/// scan of three components and nothing behind it. Of others, which are read as well, a small one can
/// take hours: each scan goes over the whole picture, and there may be as many as its sender likes.
bool is_plain(Bytes jpeg) {
  bool frame = false;
  std::size_t at = 2;
  for (;; at += 2 + (std::size_t{jpeg[at + 2]} << 8 | jpeg[at + 3])) {
    if (at + 10 > jpeg.size() || jpeg[at] != 0xff) return false;
    const std::uint8_t marker = jpeg[at + 1];
    if (marker == 0xda) break;  // the scan
    const bool frames = marker == 0xc0;
    if (frames && (frame || jpeg[at + 9] != 3)) return false;
    frame = frame || frames;
    const bool tables = marker == 0xc4 || marker == 0xdb || marker == 0xdd;
    const bool notes = (marker >= 0xe0 && marker <= 0xef) || marker == 0xfe;
    if (!frames && !tables && !notes) return false;
  }
  if (!frame || jpeg[at + 4] != 3) return false;
  // In a scan 0xff is followed by 0 or by a restart's number.
  const auto end = jpeg.end();
  auto byte = jpeg.begin() + static_cast<std::ptrdiff_t>(at + 2);
  for (;;) {
    byte = std::find(byte, end, 0xff);
    if (byte == end || ++byte == end) return false;
    if (*byte != 0 && (*byte < 0xd0 || *byte > 0xd7)) break;
  }
  return *byte == 0xd9 && byte + 1 == end;
}

}  // namespace

struct PixelEncoder::State {
  ZstdPacker zstd{ZSTD_createCCtx()};
  std::unique_ptr<void, FreeWith<tjDestroy>> jpeg{tjInitCompress()};
  std::vector<std::uint8_t> row, alpha, planes, block;

  std::size_t pack_zstd(Bytes bytes, std::size_t from) {
    block.resize(from + ZSTD_compressBound(bytes.size()));
    const std::size_t size = ZSTD_compressCCtx(zstd.get(), block.data() + from, block.size() - from,
                                               bytes.data(), bytes.size(), zstd_level);
    if (ZSTD_isError(size) != 0)
      throw Error(Error::Kind::io, "zstd could not pack a picture: {}.", ZSTD_getErrorName(size));
    return size;
  }

  void pack_lz4(Bytes bytes) {
    const int most = LZ4_compressBound(static_cast<int>(bytes.size()));
    block.resize(static_cast<std::size_t>(most));
    const int size = LZ4_compress_default(reinterpret_cast<const char*>(bytes.data()),
                                          reinterpret_cast<char*>(block.data()),
                                          static_cast<int>(bytes.size()), most);
    block.resize(static_cast<std::size_t>(size));
  }

  /// Four bytes of the JPEG's size, the JPEG, then the matte by zstd.
  void pack_jpeg(const PixelShape& shape, Bytes pixels, int stride, int quality) {
    const unsigned long most = tjBufSize(shape.width, shape.height, TJSAMP_444);
    block.resize(4 + most);
    unsigned long size = most;
    unsigned char* to = block.data() + 4;
    if (tjCompress2(jpeg.get(), pixels.data(), shape.width, stride, shape.height, TJPF_RGBX, &to,
                    &size, TJSAMP_444, quality, TJFLAG_NOREALLOC) != 0)
      throw Error(Error::Kind::io, "A picture could not be made a JPEG: {}.",
                  tjGetErrorStr2(jpeg.get()));
    for (int i = 0; i < 4; ++i) block[i] = static_cast<std::uint8_t>(size >> (8 * i));
    copy_alpha(pixels, stride, shape, alpha);
    planes.resize(alpha.size());
    decorrelate({shape.width, shape.height, 1}, alpha.data(), shape.width, row, planes.data());
    block.resize(4 + size + pack_zstd(planes, 4 + size));
  }
};

PixelEncoder::PixelEncoder() : state_(std::make_unique<State>()) {}
PixelEncoder::~PixelEncoder() = default;

std::span<const std::uint8_t> PixelEncoder::encode(PixelCoding coding, const PixelShape& shape,
                                                   std::span<const std::uint8_t> pixels, int stride,
                                                   int quality) {
  State& s = *state_;
  if (shape.bytes() > most_decoded_bytes)
    throw Error(Error::Kind::bad_input,
                "A picture of {} x {} pixels is too large to be packed: {} bytes are the most.",
                shape.width, shape.height, most_decoded_bytes);
  if (coding == PixelCoding::jpeg) {
    if (shape.channels != 4)
      throw Error(Error::Kind::bad_input, "A grey picture, which is a matte, is not made a JPEG.");
    s.pack_jpeg(shape, pixels, stride, quality);
    return s.block;
  }
  s.planes.resize(shape.bytes());
  decorrelate(shape, pixels.data(), stride, s.row, s.planes.data());
  if (coding == PixelCoding::zstd) {
    s.block.resize(s.pack_zstd(s.planes, 0));
  } else if (coding == PixelCoding::lz4) {
    s.pack_lz4(s.planes);
  } else {
    throw Error(Error::Kind::bad_input, "Raw pixels are not packed.");
  }
  return s.block;
}

struct PixelDecoder::State {
  ZstdUnpacker zstd{ZSTD_createDCtx()};
  std::unique_ptr<void, FreeWith<tjDestroy>> jpeg{tjInitDecompress()};
  std::vector<std::uint8_t> planes, alpha;

  void unpack_zstd(Bytes block, std::size_t size) {
    planes.resize(size);
    const std::size_t got =
        ZSTD_decompressDCtx(zstd.get(), planes.data(), size, block.data(), block.size());
    if (ZSTD_isError(got) != 0) fail(ZSTD_getErrorName(got));
    if (got != size) fail("they are fewer than the region of interest has");
  }

  void unpack_lz4(Bytes block, std::size_t size) {
    planes.resize(size);
    const int got = LZ4_decompress_safe(reinterpret_cast<const char*>(block.data()),
                                        reinterpret_cast<char*>(planes.data()),
                                        static_cast<int>(block.size()), static_cast<int>(size));
    if (got != static_cast<int>(size)) fail("LZ4 does not give the region of interest's");
  }

  void unpack_jpeg(const PixelShape& shape, Bytes block, std::span<std::uint8_t> pixels) {
    if (block.size() < 4) fail("they are fewer than four bytes");
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size |= static_cast<std::size_t>(block[i]) << (8 * i);
    if (size > block.size() - 4) fail("the JPEG is cut off");
    const Bytes picture = block.subspan(4, size);
    if (!is_plain(picture)) fail("the JPEG is cut off, or not of the kind that viewencode makes");
    int width = 0, height = 0, sampling = 0, space = 0;
    if (tjDecompressHeader3(jpeg.get(), picture.data(), picture.size(), &width, &height, &sampling,
                            &space) != 0) {
      jpeg.reset(tjInitDecompress());  // which would find the next one damaged, too
      fail("the JPEG's head is damaged");
    }
    if (width != shape.width || height != shape.height)
      fail("the JPEG has another size than the region of interest");
    // A JPEG that is cut off is no picture, even though it can be drawn.
    if (tjDecompress2(jpeg.get(), picture.data(), picture.size(), pixels.data(), width, 4 * width,
                      height, TJPF_RGBX, TJFLAG_STOPONWARNING) != 0)
      fail(tjGetErrorStr2(jpeg.get()));
    const PixelShape matte{shape.width, shape.height, 1};
    unpack_zstd(block.subspan(4 + size), matte.bytes());
    alpha.resize(matte.bytes());
    recorrelate(matte, planes.data(), alpha.data());
    for (std::size_t i = 0; i < alpha.size(); ++i) pixels[4 * i + 3] = alpha[i];
  }
};

PixelDecoder::PixelDecoder() : state_(std::make_unique<State>()) {}
PixelDecoder::~PixelDecoder() = default;

void PixelDecoder::decode(PixelCoding coding, const PixelShape& shape,
                          std::span<const std::uint8_t> block, std::span<std::uint8_t> pixels) {
  State& s = *state_;
  if (shape.bytes() > most_decoded_bytes || block.size() > most_decoded_bytes)
    fail("they would take more than 256 MiB");
  if (coding == PixelCoding::jpeg && shape.channels == 4) {
    s.unpack_jpeg(shape, block, pixels);
    return;
  }
  if (coding == PixelCoding::zstd) {
    s.unpack_zstd(block, shape.bytes());
  } else if (coding == PixelCoding::lz4) {
    s.unpack_lz4(block, shape.bytes());
  } else {
    fail("this coding does not go with this kind of picture");
  }
  recorrelate(shape, s.planes.data(), pixels.data());
}

}  // namespace polyhull
