// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: polyhull-rig's readers of Kalibr's (first byte even) and OpenTrackIO's files.
#include <cstdlib>
#include <string>

#include "base/error.h"
#include "rig/import.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    if (data[0] % 2 == 0 && polyhull::import::parse_kalibr(text, "fuzz").cameras.empty())
      std::abort();
    if (data[0] % 2 == 1) polyhull::import::parse_opentrackio(text, "fuzz", {});
  } catch (const polyhull::Error&) {
  }
  return 0;
}
