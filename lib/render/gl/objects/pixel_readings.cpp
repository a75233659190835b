// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/pixel_readings.h"

#include <cstring>

#include "base/error.h"

namespace polyhull::gl {

std::uint64_t pixels_that_differ(const std::uint8_t* a, const std::uint8_t* b, std::size_t count) {
  std::uint64_t out = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t x = 0, y = 0;
    std::memcpy(&x, a + 4 * i, 4);
    std::memcpy(&y, b + 4 * i, 4);
    out += x != y;
  }
  return out;
}

unsigned PixelReadings::start(const Rectangle& part) {
  const unsigned place = next_;
  next_ = 1 - place;
  Reading& reading = readings_[place];
  reading.part = part;
  if (part.empty()) return place;
  glBindBuffer(GL_PIXEL_PACK_BUFFER, reading.pixels.get());
  const std::size_t size = 4 * static_cast<std::size_t>(part.width) * part.height;
  if (reading.room < size) {
    reading.room = size;
    glBufferData(GL_PIXEL_PACK_BUFFER, static_cast<GLsizeiptr>(size), nullptr, GL_STREAM_READ);
  }
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glReadPixels(part.x, part.y, part.width, part.height, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glFlush();  // nobody waits, so nobody else makes the driver begin
  return place;
}

std::uint64_t PixelReadings::take(unsigned place, std::uint8_t* target, int stride) {
  Reading& started = readings_[place];
  const Rectangle part = started.part;
  if (part.empty()) return 0;
  std::uint64_t others = 0;
  forget_errors();
  glBindBuffer(GL_PIXEL_PACK_BUFFER, started.pixels.get());
  const std::size_t row = 4 * static_cast<std::size_t>(part.width);
  const auto* pixels = static_cast<const std::uint8_t*>(
      glMapBufferRange(GL_PIXEL_PACK_BUFFER, 0, static_cast<GLsizeiptr>(row) * part.height,
                       GL_MAP_READ_BIT));  // waits until they are there
  if (pixels != nullptr)
    for (int y = 0; y < part.height; ++y) {
      std::uint8_t* to = target + static_cast<std::ptrdiff_t>(part.y + y) * stride + 4 * part.x;
      const std::uint8_t* from = pixels + static_cast<std::size_t>(y) * row;
      others += pixels_that_differ(to, from, static_cast<std::size_t>(part.width));
      std::memcpy(to, from, row);
    }
  const bool whole = pixels != nullptr && glUnmapBuffer(GL_PIXEL_PACK_BUFFER);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  check_errors();
  if (!whole)
    throw Error(Error::Kind::unsupported, "The picture could not be read back from OpenGL.");
  return others;
}

}  // namespace polyhull::gl
