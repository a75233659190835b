// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take_pixels.h"

#include "take/take_reader.h"
#include "wire/view_payload.h"

namespace polyhull::benchmark {

std::vector<Frame> read_frames(const char* path) {
  std::vector<Frame> frames;
  for (const TakeStream& stream : read_take(path).streams) {
    TakeCursor cursor(path, stream.id);
    while (const auto packet = cursor.next()) {
      const View view = read_view(Bytes(packet->data));
      const PixelShape shape{view.roi.width, view.roi.height, bytes_per_pixel(view.format)};
      if (shape.channels != 4) continue;
      Frame frame{shape, view.roi.x, view.roi.y, {}};
      const auto row = static_cast<std::ptrdiff_t>(shape.width) * 4;
      for (int y = 0; y < shape.height; ++y) {
        const auto begin = view.pixels.begin() + static_cast<std::ptrdiff_t>(y) * view.stride;
        frame.pixels.insert(frame.pixels.end(), begin, begin + row);
      }
      frames.push_back(std::move(frame));
    }
  }
  return frames;
}

}  // namespace polyhull::benchmark
