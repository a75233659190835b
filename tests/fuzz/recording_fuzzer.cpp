// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as the file of a recorded track.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "base/error.h"
#include "track/packet_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace polyhull;
  static const int file = memfd_create("recording", 0);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  if (file < 0 || ftruncate(file, 0) != 0 ||
      pwrite(file, data, size, 0) != static_cast<ssize_t>(size))
    std::abort();
  try {
    PacketRecording recording(path);
    // No packet of a file is shorter than its own header of 16 bytes.
    for (std::size_t count = 0; const auto datagram = recording.next(); ++count)
      if (count > size / 16 || datagram->bytes.size() > size) std::abort();
  } catch (const Error&) {
  }
  return 0;
}
