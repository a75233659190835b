// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: read_mesh() on any bytes.
#include <cstdlib>

#include "base/error.h"
#include "wire/mesh_payload.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const polyhull::Mesh mesh = polyhull::read_mesh(polyhull::Bytes(data, size));
    polyhull::validate_mesh(mesh);
    if (polyhull::write_mesh(mesh).empty()) std::abort();
  } catch (const polyhull::Error&) {
  }
  return 0;
}
