// SPDX-License-Identifier: LGPL-2.1-or-later
#include <zstd.h>

#include <cstring>
#include <utility>

#include "base/error.h"
#include "take/number_filter.h"
#include "take/packet_before.h"
#include "take/packing.h"
#include "take/picture_video.h"
#include "wire/zstd_contexts.h"

namespace polyhull {
namespace {}  // namespace

struct PacketUnpacker::State {
  ZstdUnpacker zstd{ZSTD_createDCtx()};
  std::int64_t last = 0;
  PacketBefore now, before;
  std::vector<std::uint8_t> pictures;
  std::vector<VideoDecoder> videos;  // by the order of pictures

  void unpack(const PackedPrefix& prefix, Bytes packed);
  void unzip(Bytes bytes, Bytes prefix, std::size_t size, std::vector<std::uint8_t>& out);
  void read_head();
  void read_pictures(bool alone, Bytes frames);
};

void PacketUnpacker::State::unzip(Bytes bytes, Bytes prefix, std::size_t size,
                                  std::vector<std::uint8_t>& out) {
  out.resize(size);
  if (size == 0) return;
  ZSTD_DCtx_reset(zstd.get(), ZSTD_reset_session_and_parameters);
  if (!prefix.empty()) ZSTD_DCtx_refPrefix(zstd.get(), prefix.data(), prefix.size());
  const std::size_t got =
      ZSTD_decompressDCtx(zstd.get(), out.data(), size, bytes.data(), bytes.size());
  if (ZSTD_isError(got) != 0) refuse_packed(ZSTD_getErrorName(got));
  if (got != size) refuse_packed("it unpacks to fewer bytes than it says");
}

void PacketUnpacker::State::read_head() {
  now.regions = read_regions(now.head, now.packet.size());
  if (now.head.size() != head_size(now.regions, now.packet.size()))
    refuse_packed("its head does not fit its regions");
  const std::uint8_t* from =
      now.head.data() + sizeof(std::uint32_t) + now.regions.size() * sizeof(Region);
  const auto take = [&](std::size_t at, std::size_t size) {
    if (size > 0) std::memcpy(now.packet.data() + at, from, size);
    from += size;
  };
  std::size_t at = 0;
  for (const Region& region : now.regions) {
    take(at, region.offset - at);
    at = std::size_t{region.offset} + region.size;
  }
  take(at, now.packet.size() - at);
  for (const Region& region : now.regions) {
    if (region.pictured()) continue;
    unfilter_numbers(region, from, now.packet.data() + region.offset);
    from += region.size;
  }
}

void PacketUnpacker::State::read_pictures(bool alone, Bytes frames) {
  const std::uint8_t* from = pictures.data();
  if (alone)
    for (VideoDecoder& video : videos) video.begin_anew();
  std::size_t index = 0;
  for (const Region& region : now.regions) {
    if (!region.pictured()) continue;
    std::uint8_t* pixels = now.packet.data() + region.offset;
    unfilter_picture(region, from, alone ? PictureBefore{} : before.picture(index), pixels);
    from += filtered_size(region);
    if (videos.size() <= index) videos.emplace_back();
    VideoDecoder& video = videos[index++];
    if (region.kind != RegionKind::video) continue;
    if (region.video_size > frames.size()) refuse_packed("a video's frame is cut off");
    video.decode(region, frames.first(region.video_size), pixels);
    frames = frames.subspan(region.video_size);
  }
}

void PacketUnpacker::State::unpack(const PackedPrefix& prefix, Bytes packed) {
  const bool alone = prefix.before == 0;
  const Bytes rest = packed.subspan(sizeof prefix);
  const Bytes frames = rest.subspan(std::size_t{prefix.head_packed} + prefix.pictures_packed);
  unzip(rest.first(prefix.head_packed), alone ? Bytes() : before.prefix(), prefix.head, now.head);
  now.packet.resize(prefix.size);
  read_head();
  if (prefix.pictures != pictures_size(now.regions))
    refuse_packed("its pictures do not fit their regions");
  unzip(rest.subspan(prefix.head_packed, prefix.pictures_packed), {}, prefix.pictures, pictures);
  read_pictures(alone, frames);
}

PacketUnpacker::PacketUnpacker() : state_(std::make_unique<State>()) {}
PacketUnpacker::~PacketUnpacker() = default;
PacketUnpacker::PacketUnpacker(PacketUnpacker&&) noexcept = default;
PacketUnpacker& PacketUnpacker::operator=(PacketUnpacker&&) noexcept = default;

std::int64_t PacketUnpacker::before(std::span<const std::uint8_t> packed) {
  return static_cast<std::int64_t>(read_packed_prefix(packed).before);
}

std::int64_t PacketUnpacker::last() const {
  return state_->last;
}

std::vector<std::uint8_t> PacketUnpacker::unpack(std::int64_t id,
                                                 std::span<const std::uint8_t> packed) {
  State& s = *state_;
  const std::int64_t last = std::exchange(s.last, 0);
  const PackedPrefix prefix = read_packed_prefix(packed);
  if (prefix.before != 0 && static_cast<std::int64_t>(prefix.before) != last)
    refuse_packed("the packet before it is not there");
  s.unpack(prefix, packed);
  std::swap(s.now, s.before);
  s.last = id;
  return s.before.packet;
}

}  // namespace polyhull
