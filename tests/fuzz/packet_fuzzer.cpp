// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: headers of GStreamer's data protocol from any bytes, and packed views behind them.
#include <cstdlib>
#include <vector>

#include "base/error.h"
#include "wire/coded_view.h"
#include "wire/packet.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace polyhull;
  const Bytes bytes(data, size);
  try {
    const PacketHeader header = read_packet_header(bytes);
    if (header.time != no_time && header.time > latest_time) std::abort();
    check_packet_payload(header, bytes.subspan(packet_header_size));
  } catch (const Error&) {
  }
  try {
    CodedView coded = read_coded_view({&bytes, 1});
    if (coded.coding == PixelCoding::raw || coded.shape().bytes() > (1u << 24)) return 0;
    std::vector<std::uint8_t> pixels(coded.shape().bytes());
    static PixelDecoder decoder;
    decoder.decode(coded.coding, coded.shape(), coded.block, pixels);
    coded.view.pixels = pixels;
    validate_view(coded.view);
  } catch (const Error&) {
  }
  return 0;
}
