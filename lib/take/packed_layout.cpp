// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/packed_layout.h"

#include <cmath>
#include <cstring>

#include "base/error.h"
#include "take/picture_filter.h"

namespace polyhull {
namespace {

constexpr std::uint32_t largest_side = 32768;
constexpr std::uint32_t largest_canvas = 16383;  // VP8's side

void check_picture(const Region& region) {
  if (region.element != 1 && region.element != 4) refuse_packed("a picture's pixels have no size");
  if (region.width < 1 || region.height < 1 || region.width > largest_side ||
      region.height > largest_side || region.x > largest_side || region.y > largest_side)
    refuse_packed("a picture's size is out of range");
  if (std::uint64_t{region.width} * region.height * region.element != region.size)
    refuse_packed("a picture's size is not that of its bytes");
  if (region.kind == RegionKind::picture) return;
  if (region.element != 4) refuse_packed("a video has no colours");
  if (!fits_video(region)) refuse_packed("a video's canvas does not fit its picture");
}

void check_numbers(const Region& region) {
  const std::uint32_t element = region.element;
  if ((element != 1 && element != 2 && element != 4 && element != 8) ||
      region.size % element != 0 || region.components < 1)
    refuse_packed("a list of numbers contradicts itself");
  if (region.kind != RegionKind::grid) return;
  if (element != 4 || !std::isfinite(region.step) || !(region.step > 0.0))
    refuse_packed("a grid has no step");
}

}  // namespace

void refuse_packed(const char* what) {
  throw Error(Error::Kind::bad_input, "A packed buffer of a take is damaged: {}.", what);
}

bool fits_video(const Region& region) {
  const std::uint64_t picture = std::uint64_t{region.width} * region.height;
  const std::uint64_t canvas = std::uint64_t{region.canvas_width} * region.canvas_height;
  return region.canvas_width <= largest_canvas && region.canvas_height <= largest_canvas &&
         canvas <= 4 * picture + 65'536 && region.canvas_x <= region.x &&
         region.canvas_y <= region.y &&
         region.x - region.canvas_x + region.width <= region.canvas_width &&
         region.y - region.canvas_y + region.height <= region.canvas_height;
}

PackedPrefix read_packed_prefix(Bytes block) {
  PackedPrefix prefix;
  if (block.size() < sizeof prefix) refuse_packed("it is shorter than its sizes");
  std::memcpy(&prefix, block.data(), sizeof prefix);
  if (prefix.version != 1)
    throw Error(Error::Kind::unsupported,
                "A take's buffer is packed in version {}, and this build knows version 1. Use the "
                "polyhull that wrote it, or a newer one.",
                prefix.version);
  const std::size_t most = prefix.size + sizeof(Region) * most_regions + 4;
  if (prefix.size > most_packet_bytes) refuse_packed("it would take more than 256 MiB");
  if (prefix.head > most) refuse_packed("its head is larger than the whole");
  // Besides the pixels, whether each run of them was told by the packet before.
  if (prefix.pictures > 2 * std::size_t{prefix.size})
    refuse_packed("its pictures are larger than the whole");
  if (std::uint64_t{prefix.head_packed} + prefix.pictures_packed > block.size() - sizeof prefix)
    refuse_packed("it is cut off");
  return prefix;
}

std::vector<Region> read_regions(Bytes head, std::size_t size) {
  std::uint32_t count = 0;
  if (head.size() < sizeof count) refuse_packed("its head is empty");
  std::memcpy(&count, head.data(), sizeof count);
  if (count > most_regions || head.size() - sizeof count < count * sizeof(Region))
    refuse_packed("it has too many regions");
  std::vector<Region> regions(count);
  if (count > 0) std::memcpy(regions.data(), head.data() + sizeof count, count * sizeof(Region));
  std::size_t end = 0;
  for (const Region& region : regions) {
    if (region.offset < end || region.offset > size || region.size > size - region.offset)
      refuse_packed("a region is not within it");
    end = std::size_t{region.offset} + region.size;
    switch (region.kind) {
      case RegionKind::numbers:
      case RegionKind::grid:
        check_numbers(region);
        break;
      case RegionKind::picture:
      case RegionKind::video:
        check_picture(region);
        break;
      default:
        refuse_packed("a region is of no known kind");
    }
  }
  return regions;
}

std::size_t head_size(std::span<const Region> regions, std::size_t packet) {
  std::size_t size = sizeof(std::uint32_t) + sizeof(Region) * regions.size() + packet;
  for (const Region& region : regions)
    if (region.pictured()) size -= region.size;
  return size;
}

std::size_t pictures_size(std::span<const Region> regions) {
  std::size_t size = 0;
  for (const Region& region : regions)
    if (region.pictured()) size += filtered_size(region);
  return size;
}

}  // namespace polyhull
