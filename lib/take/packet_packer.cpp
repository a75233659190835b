// SPDX-License-Identifier: LGPL-2.1-or-later
#include <zstd.h>

#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "base/error.h"
#include "take/number_filter.h"
#include "take/packet_before.h"
#include "take/packing.h"
#include "take/payload_regions.h"
#include "take/picture_video.h"
#include "wire/zstd_contexts.h"

namespace polyhull {
namespace {

// Higher ones take twice the time and more for a few in a hundred.
constexpr int zstd_level = 1;

// Of a matte that may be lost: its noise costs more than the colours do. What is wholly inside or
// outside stays so, the rest moves by 4 of 255 at most.
constexpr int matte_levels = 32;

void round_matte(std::uint8_t* pixels, std::size_t bytes) {
  for (std::size_t i = 3; i < bytes; i += 4) {
    const int level = (pixels[i] * matte_levels + 127) / 255;
    pixels[i] = static_cast<std::uint8_t>((level * 255 + matte_levels / 2) / matte_levels);
  }
}

}  // namespace

struct PacketPacker::State {
  ZstdPacker zstd{ZSTD_createCCtx()};
  PackingSettings settings;
  std::string caps;
  unsigned since_alone = 0;             // packets, that one included; 0: there is none
  std::uint64_t bytes_since_alone = 0;  // of them
  PacketBefore now, before;
  std::vector<std::uint8_t> pictures, block;
  std::vector<VideoEncoder> videos;  // by the order of pictures

  PackedPacket pack(std::int64_t id_before, Bytes packet);
  void round_vertices(PayloadRegions& found, PackedPacket& result);
  void encode_videos(PackedPacket& result);
  void make_head();
  void make_pictures(bool alone);
  std::size_t add_packed(Bytes bytes, Bytes prefix);
};

/// A vertex that moves by half a step along each axis moves by the square root of 3 halves of it.
void PacketPacker::State::round_vertices(PayloadRegions& found, PackedPacket& result) {
  const double mm = 1000.0 * found.metres_per_unit;
  const double step = settings.precision / mm * 2.0 / std::sqrt(3.0);
  if (!found.vertices || !std::isfinite(step) || !(step > 0.0)) return;
  Region& region = found.regions[*found.vertices];
  std::uint8_t* vertices = now.packet.data() + region.offset;
  std::vector<float> exact(region.size / sizeof(float)), moved(exact.size());
  std::memcpy(exact.data(), vertices, region.size);
  if (!round_to_grid(vertices, exact.size(), step)) return;
  region.kind = RegionKind::grid;
  region.step = step;
  std::memcpy(moved.data(), vertices, region.size);
  double most = 0;
  for (std::size_t i = 0; i + 2 < exact.size(); i += 3) {
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c)
      square += std::pow(double{moved[i + c]} - double{exact[i + c]}, 2);
    most = std::max(most, square);
  }
  result.vertex_error = mm * std::sqrt(most);
}

void PacketPacker::State::encode_videos(PackedPacket& result) {
  // All of them: one whose subject is out of the frame just now must not go on from before, either.
  if (result.alone)
    for (VideoEncoder& video : videos) video.begin_anew();
  std::size_t index = 0;
  for (Region& region : now.regions) {
    if (!region.pictured()) continue;
    if (videos.size() <= index) videos.emplace_back();
    VideoEncoder& video = videos[index++];
    if (region.element != 4) continue;
    std::uint8_t* pixels = now.packet.data() + region.offset;
    if (!video.encode(region, pixels, settings.quantizer)) continue;
    round_matte(pixels, region.size);
    result.colour_error += video.error();
    result.colours += std::uint64_t{3} * region.width * region.height;
  }
}

void PacketPacker::State::make_head() {
  const auto count = static_cast<std::uint32_t>(now.regions.size());
  now.head.resize(head_size(now.regions, now.packet.size()));
  std::uint8_t* to = now.head.data();
  const auto put = [&](const void* bytes, std::size_t size) {
    if (size > 0) std::memcpy(to, bytes, size);
    to += size;
  };
  put(&count, sizeof count);
  put(now.regions.data(), count * sizeof(Region));
  std::size_t at = 0;
  for (const Region& region : now.regions) {
    put(now.packet.data() + at, region.offset - at);
    at = std::size_t{region.offset} + region.size;
  }
  put(now.packet.data() + at, now.packet.size() - at);
  for (const Region& region : now.regions) {
    if (region.pictured()) continue;
    filter_numbers(region, now.packet.data() + region.offset, to);
    to += region.size;
  }
}

void PacketPacker::State::make_pictures(bool alone) {
  pictures.resize(pictures_size(now.regions));
  std::uint8_t* to = pictures.data();
  std::size_t index = 0;
  for (const Region& region : now.regions) {
    if (!region.pictured()) continue;
    filter_picture(region, now.packet.data() + region.offset,
                   alone ? PictureBefore{} : before.picture(index), to);
    to += filtered_size(region);
    ++index;
  }
}

std::size_t PacketPacker::State::add_packed(Bytes bytes, Bytes prefix) {
  const std::size_t from = block.size();
  block.resize(from + ZSTD_compressBound(bytes.size()));
  ZSTD_CCtx_reset(zstd.get(), ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(zstd.get(), ZSTD_c_compressionLevel, zstd_level);
  if (!prefix.empty()) ZSTD_CCtx_refPrefix(zstd.get(), prefix.data(), prefix.size());
  const std::size_t size = ZSTD_compress2(zstd.get(), block.data() + from, block.size() - from,
                                          bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0)
    throw Error(Error::Kind::io, "zstd could not pack a take's buffer: {}.",
                ZSTD_getErrorName(size));
  block.resize(from + size);
  return size;
}

PackedPacket PacketPacker::State::pack(std::int64_t id_before, Bytes packet) {
  PackedPacket result;
  result.alone = id_before == 0 || since_alone == 0 || since_alone >= settings.key_interval ||
                 bytes_since_alone + packet.size() > most_key_bytes;
  now.packet.assign(packet.begin(), packet.end());
  PayloadRegions found = find_regions(caps, now.packet);
  if (settings.packing == Packing::lossy) round_vertices(found, result);
  now.regions = std::move(found.regions);
  if (settings.packing == Packing::lossy) encode_videos(result);
  make_head();
  make_pictures(result.alone);
  PackedPrefix prefix;
  prefix.before = result.alone ? 0 : static_cast<std::uint64_t>(id_before);
  prefix.size = static_cast<std::uint32_t>(packet.size());
  prefix.head = static_cast<std::uint32_t>(now.head.size());
  prefix.pictures = static_cast<std::uint32_t>(pictures.size());
  block.resize(sizeof prefix);
  prefix.head_packed =
      static_cast<std::uint32_t>(add_packed(now.head, result.alone ? Bytes() : before.prefix()));
  prefix.pictures_packed =
      pictures.empty() ? 0 : static_cast<std::uint32_t>(add_packed(pictures, {}));
  std::memcpy(block.data(), &prefix, sizeof prefix);
  std::size_t index = 0;
  for (const Region& region : now.regions) {
    if (region.kind == RegionKind::video)
      block.insert(block.end(), videos[index].frame().begin(), videos[index].frame().end());
    if (region.pictured()) ++index;
  }
  result.data = block;
  return result;
}

PacketPacker::PacketPacker() : state_(std::make_unique<State>()) {}
PacketPacker::~PacketPacker() = default;
PacketPacker::PacketPacker(PacketPacker&&) noexcept = default;
PacketPacker& PacketPacker::operator=(PacketPacker&&) noexcept = default;

PackedPacket PacketPacker::pack(const PackingSettings& settings, std::string_view caps,
                                std::span<const std::uint8_t> packet, std::int64_t before) {
  State& s = *state_;
  const bool anew = settings != s.settings || caps != s.caps;
  s.settings = settings;
  s.caps = caps;
  if (anew) s.since_alone = 0;
  if (settings.packing == Packing::none || packet.empty() || packet.size() > most_packet_bytes) {
    s.since_alone = 0;
    return {};
  }
  PackedPacket result;
  try {
    result = s.pack(before, packet);
  } catch (...) {
    s.since_alone = 0;
    throw;
  }
  if (result.data.size() >= packet.size()) {
    s.since_alone = 0;
    return {};
  }
  s.since_alone = result.alone ? 1 : s.since_alone + 1;
  s.bytes_since_alone = (result.alone ? 0 : s.bytes_since_alone) + packet.size();
  std::swap(s.now, s.before);
  return result;
}

}  // namespace polyhull
