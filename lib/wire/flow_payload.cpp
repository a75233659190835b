// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/flow_payload.h"

#include <algorithm>

#include "base/error.h"
#include "wire/view_table.h"

namespace polyhull {

std::string flows_fault(const Texturing& texturing) {
  const int views = static_cast<int>(texturing.maps.size());
  std::vector<int> of_view(texturing.maps.size(), 0);
  for (const PictureFlow& flow : texturing.flows) {
    const bool known = flow.view >= 0 && flow.view < views && flow.other >= 0 &&
                       flow.other < views && flow.view != flow.other;
    if (!known) return "a flow is between views that are not there";
    if (++of_view[static_cast<std::size_t>(flow.view)] > PictureFlow::most_of_view)
      return "a view has more flows than may be";
    const OcclusionMap& map = texturing.maps[static_cast<std::size_t>(flow.view)];
    const auto of = [](int size) {
      return (size + PictureFlow::coarser - 1) / PictureFlow::coarser;
    };
    if (flow.width != of(map.width) || flow.height != of(map.height))
      return "a flow's size is not that of its view's map";
    if (flow.offsets.size() != 2 * static_cast<std::size_t>(flow.width) * flow.height)
      return "a flow's size contradicts its contents";
  }
  return {};
}

std::size_t packed_flows_size(const std::vector<PictureFlow>& flows) {
  std::size_t size = 0;
  for (const PictureFlow& flow : flows) size += 64 + flow.offsets.size();
  return size;
}

flatbuffers::Offset<flatbuffers::Vector<flatbuffers::Offset<wire::PictureFlow>>> pack_flows(
    flatbuffers::FlatBufferBuilder& builder, const std::vector<PictureFlow>& flows) {
  std::vector<flatbuffers::Offset<wire::PictureFlow>> tables;
  for (const PictureFlow& flow : flows) {
    const auto offsets = builder.CreateVector(flow.offsets);
    tables.push_back(wire::CreatePictureFlow(
        builder, static_cast<std::uint8_t>(flow.view), static_cast<std::uint8_t>(flow.other),
        static_cast<std::uint32_t>(flow.width), static_cast<std::uint32_t>(flow.height), offsets));
  }
  return builder.CreateVector(tables);
}

constexpr std::size_t most_views = 64;  // of a textured mesh

std::vector<PictureFlow> unpack_flows(
    const flatbuffers::Vector<flatbuffers::Offset<wire::PictureFlow>>* tables, std::size_t most) {
  std::vector<PictureFlow> flows;
  if (!tables) return flows;
  if (tables->size() > most_views * PictureFlow::most_of_view)
    throw Error(Error::Kind::bad_input, "Not a usable mesh: it has more flows than views have.");
  std::size_t unpacked = 0;
  for (const wire::PictureFlow* table : *tables) {
    unpacked += sizeof(wire::PictureFlow) + (table->offsets() ? table->offsets()->size() : 0);
    if (unpacked > most)
      throw Error(Error::Kind::bad_input, "Not a usable mesh: its flows share their contents.");
    PictureFlow& flow = flows.emplace_back();
    flow.view = table->view();
    flow.other = table->other();
    // Beyond 31 bits they turn negative, which no map's size is.
    flow.width = static_cast<int>(table->width());
    flow.height = static_cast<int>(table->height());
    flow.offsets = unpack_numbers<std::int8_t>(table->offsets());
  }
  return flows;
}

}  // namespace polyhull
