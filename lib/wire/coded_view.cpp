// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/coded_view.h"

#include "wire/view_table.h"

namespace polyhull {

std::vector<std::uint8_t> write_coded_view_header(const View& view, PixelCoding coding,
                                                  std::size_t block_size) {
  validate_view(view);
  flatbuffers::FlatBufferBuilder builder;
  builder.Finish(pack_view(builder, view,
                           {coding, view.roi.width * bytes_per_pixel(view.format), block_size}));
  return write_payload_header(PayloadKind::view, {builder.GetBufferPointer(), builder.GetSize()},
                              block_size);
}

CodedView read_coded_view(std::span<const Bytes> segments) {
  Payload payload(PayloadKind::view, segments);
  const wire::View& table = verified_view(payload);
  CodedView coded;
  coded.coding = static_cast<PixelCoding>(table.coding());
  if (coded.coding == PixelCoding::raw) {
    coded.view = unpack_view(table, payload);
    coded.block = std::exchange(coded.view.pixels, {});
  } else {
    if (coded.coding > PixelCoding::jpeg)
      throw Error(Error::Kind::unsupported,
                  "A view's pixels are coded in a way that this build does not know (number {}).",
                  static_cast<int>(coded.coding));
    coded.view = unpack_all_but_pixels(table);
    coded.block = payload.take_block(table.pixels_size());
    validate_all_but_pixels(coded.view);
    const PixelShape shape = coded.shape();
    if (coded.view.roi.empty() || coded.view.stride != shape.width * shape.channels ||
        shape.bytes() > most_decoded_bytes)
      throw Error(Error::Kind::bad_input,
                  "View of camera '{}': its packed pixels have no region of interest, rows with "
                  "gaps, or would take more than 256 MiB.",
                  coded.view.camera);
  }
  payload.finish();
  return coded;
}

}  // namespace polyhull
