// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: read_view() on any bytes.
#include <cstdlib>

#include "base/error.h"
#include "wire/view_payload.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const polyhull::View view = polyhull::read_view(polyhull::Bytes(data, size));
    polyhull::validate_view(view);
    if (polyhull::write_view(view).empty()) std::abort();
  } catch (const polyhull::Error&) {
  }
  return 0;
}
