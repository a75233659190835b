// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: parse_rig() on any text.
#include <cstdlib>
#include <string_view>

#include "base/error.h"
#include "rig/rig.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const polyhull::Rig rig =
        polyhull::parse_rig({reinterpret_cast<const char*>(data), size}, "fuzz");
    if (polyhull::rig_to_json(rig).empty()) std::abort();
  } catch (const polyhull::Error&) {
  }
  return 0;
}
